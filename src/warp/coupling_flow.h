#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "nn/simd.h"
#include "warp/flow_loss.h"
#include "warpath/batch.h"

namespace warpath {

/// A tensor of a flow's parameters: rows x cols, rows `stride` apart, from `offset` on.
struct ParameterView {
  std::string name;  ///< `coupling0.s.layer1.weight`, `coupling0.scale`, ...
  std::size_t offset, rows, cols, stride;
};

/// Parameters as the kernels want them: the networks' weights, their transposes for training, and a family's own.
struct PackedParameters {
  nn::AlignedVector<float> forward, back, scales;
};

/// A stack of coupling layers over the hypercube as arithmetic over blocks of nn::kBlock samples [DSB17]. It holds
/// shapes, no parameters. Rows are nn::kBlock numbers of one dimension; all arrays are aligned to nn::kAlignment.
class CouplingFlow {
 public:
  virtual ~CouplingFlow() = default;
  virtual int dims() const = 0;
  virtual std::size_t parameter_count() const = 0;  ///< padding included; a multiple of 16
  virtual std::size_t coupling_count() const = 0;
  /// Where a coupling's parameters start; parameter_count() behind the last one.
  virtual std::size_t first_parameter(std::size_t coupling) const = 0;
  virtual std::vector<ParameterView> views() const = 0;
  virtual std::size_t multiply_adds() const = 0;  ///< of the networks, for one sample forward
  virtual int context_rows() const { return 0; }  ///< rows that its networks see besides, which condition the density
  /// Parameters of the identity.
  virtual nn::AlignedVector<float> initial(std::uint64_t seed) const = 0;

  /// Sizes `packed`, without transposes unless `back`; then pack_coupling fills it, one coupling at a time.
  virtual void resize(PackedParameters& packed, bool back) const = 0;
  virtual void pack_coupling(std::size_t coupling, const float* parameters, PackedParameters& packed) const = 0;
  void pack(const float* parameters, PackedParameters& packed, bool back) const;

  /// Floats of scratch that forward and inverse need.
  virtual std::size_t scratch_count() const = 0;
  /// z -> y and ln|det dy/dz|, rows of kBlock doubles: z, y: dims x kBlock (y may be z), log_det: kBlock.
  virtual void forward(const PackedParameters& packed, const double* z, double* y, double* log_det,
                       float* scratch) const = 0;
  /// y -> z and ln|det dz/dy|.
  virtual void inverse(const PackedParameters& packed, const double* y, double* z, double* log_det,
                       float* scratch) const = 0;

  /// Floats of scratch that train_block needs.
  virtual std::size_t training_scratch_count() const = 0;
  /// The loss over one block, see block_loss, and its gradient. y: dims x kBlock doubles; weight: kBlock, 0 for samples
  /// that only fill the block; target: kBlock, g of each, may be null with Loss::likelihood. gradients:
  /// parameter_count(), layout as the parameters, of the weights as they are packed (see unfold), padding between
  /// tensors untouched; it is added to what is there if `accumulate`. context: context_rows() x kBlock.
  virtual double train_block(const PackedParameters& packed, const double* y, const float* context, const float* weight,
                             const float* target, const FlowObjective& objective, float* gradients, bool accumulate,
                             float* scratch) const = 0;
  /// Turns one coupling's gradients of packed weights into those of the parameters, in place. Both arrays whole.
  virtual void unfold(std::size_t coupling, const float* parameters, float* gradients) const = 0;
};

/// Runs z -> y (`forward`) or y -> z over rows of any number, a block at a time; from and to may be the same memory.
void run_flow(const CouplingFlow& flow, const PackedParameters& packed, bool forward, Batch<const double> from,
              Batch<double> to, std::span<double> log_det);

/// The dimensions that coupling number c moves, 1 in the set; the others condition them. Binary masks: the couplings
/// 2 p and 2 p + 1 use one split, from either side. Split p tells dimensions apart by the parity of some bits of their
/// number: first of each bit alone, so that any two dimensions part within log2(dims) splits [GIK20], then of ever more
/// bits together. A single dimension is always moved.
std::vector<bool> binary_mask(int dims, int coupling);

}  // namespace warpath
