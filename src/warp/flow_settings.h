#pragma once

namespace warpath {

/// How a normalising flow is trained, whatever its layers are.
struct FlowTraining {
  /// What training minimises: -ln q, the paper's maximum likelihood; or the variance of the estimate g / q, by way of
  /// ln E[g / q] over examples that were drawn by g, with q mixed with `uniform`: the chi-squared divergence of
  /// [MMRGN19]. The second one mends the tails.
  enum class Loss { likelihood, variance } loss = Loss::variance;
  double rate = 6e-3;  ///< Adam's step size at the start; it falls when the held-out loss no longer does
  int batch = 2000;
  int max_steps = 10'000;               ///< training ends sooner, when the held-out loss no longer falls
  double held_out = 0.05;               ///< share of the examples that is never trained on
  double expected_uniform_share = 0.1;  ///< of the samples that are drawn, which Loss::variance counts on
  /// Each time an example is shown, it is moved by a Gaussian of jitter / sqrt(examples) in each dimension (as wide as
  /// a slab that holds sqrt(examples) of them, times this), so that small sets are not learned by heart. 0: not at all.
  double jitter = 0;
  double average = 0.998;    ///< decay per step of the moving average of the weights that is handed out; 0 for none
  int evaluate_every = 100;  ///< steps between evaluations of the held-out loss
  int patience = 3;    ///< evaluations without gain, after which the rate falls to a third, and at last training ends
  int rate_drops = 2;  ///< how often the rate falls
};

/// Settings of the Real NVP warp and its training. Defaults are the ones that docs/results.md measures.
struct RealNvpSettings : FlowTraining {
  RealNvpSettings() { jitter = 2; }
  int couplings = 16;
  int width = 32;
  int blocks = 1;          ///< residual blocks of two dense layers in each of s and t
  int encoding_bins = 15;  ///< of the one-blob encoding of what the networks see [MMRGN19]; 0: logits alone
  bool shared = true;      ///< s and t from one network with two heads; the paper has two
  /// Which dimensions a coupling moves: every other one, or halves that change from pair to pair of couplings, so that
  /// any two dimensions come to stand on different sides.
  enum class Masks { alternating, binary } masks = Masks::binary;
  enum class Norm { none, actnorm, batch } norm = Norm::actnorm;
};
/// The architecture that the authors of [ZZ19] released, and their training: 12 couplings, separate s and t, 512 wide,
/// 8 blocks, maximum likelihood at rate 1e-4.
RealNvpSettings released_realnvp();

/// Settings of the rational-quadratic spline flow [DBMP19] and its training.
struct SplineSettings : FlowTraining {
  SplineSettings() {
    rate = 1e-2;
    max_steps = 2000;
  }
  int couplings = 6;       ///< with Masks::autoregressive: layers of as many couplings as there are dimensions
  int width = 32;          ///< neurons in a hidden layer, a multiple of 16
  int blocks = 1;          ///< residual blocks of two dense layers in each coupling's network
  int bins = 8;            ///< of each spline, 2 to 64
  int encoding_bins = 32;  ///< of the one-blob encoding of what the networks see [MMRGN19]; 0: the numbers alone
  /// binary: a coupling moves half of the dimensions, given the others, and the halves change from pair to pair;
  /// autoregressive: it moves one, given those before it, or, in every other layer, those behind it.
  enum class Masks { binary, autoregressive } masks = Masks::binary;
};

}  // namespace warpath
