#include "nn/residual_net.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "core/rng.h"
#include "nn/actnorm.h"
#include "nn/dense.h"
#include "warpath/error.h"

namespace warpath::nn {
namespace {

using Floats = AlignedVector<float>;
using Doubles = std::vector<double>;

Doubles layer(const DenseLayer& l, const Doubles& p, const Doubles& x) {
  Doubles y(static_cast<std::size_t>(l.outputs));
  for (std::size_t o = 0; o < y.size(); ++o) {
    const double gain = l.normalised ? p[l.gain + o] : 1;
    y[o] = p[l.bias + o];
    for (std::size_t k = 0; k < x.size(); ++k)
      y[o] += gain * p[l.weight + o * static_cast<std::size_t>(padded_inputs(l.inputs)) + k] * x[k];
  }
  return y;
}

/// The network in plain loops and doubles, for one sample.
Doubles reference(const ResidualNet& net, const Doubles& p, const Doubles& x) {
  const auto relu = [](Doubles v) {
    for (double& e : v) e = std::max(e, 0.0);
    return v;
  };
  if (net.layers().size() == 1) return layer(net.layers()[0], p, x);
  Doubles h = relu(layer(net.layers()[0], p, x));
  for (std::size_t l = 1; l + 2 < net.layers().size(); l += 2) {
    Doubles sum = layer(net.layers()[l + 1], p, relu(layer(net.layers()[l], p, h)));
    for (std::size_t i = 0; i < h.size(); ++i) sum[i] += h[i];
    h = relu(sum);
  }
  return layer(net.layers().back(), p, h);
}

struct Case {
  std::string target;
  int inputs, width, blocks, outputs;
  Norm norm;
  Products products = Products::floats;
};

class ResidualNetTest : public testing::TestWithParam<Case> {
 protected:
  Case m_case = GetParam();
  ForceSimdTarget m_target{m_case.target};
  ResidualNet m_net{m_case.inputs, m_case.width, m_case.blocks, m_case.outputs, m_case.norm, m_case.products};

  Floats parameters() const {
    Floats p(m_net.parameter_count());
    m_net.initialise(p.data(), 1, 1);
    for (const DenseLayer& l : m_net.layers())
      for (std::size_t o = 0; o < static_cast<std::size_t>(l.outputs); ++o) {
        p[l.bias + o] = sample_float(2, static_cast<std::uint32_t>(l.bias + o)) - 0.5f;
        if (l.normalised) p[l.gain + o] = 0.5f + sample_float(3, static_cast<std::uint32_t>(l.gain + o));
      }
    return p;
  }
  Floats block(int rows, std::uint64_t key) const {
    Floats x(static_cast<std::size_t>(rows * kBlock));
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = 2 * sample_float(key, static_cast<std::uint32_t>(i)) - 1;
    return x;
  }
  struct Trained {
    Floats out, gradients, d_x;
  };
  /// Forward and backward, twice, the second time added to the first: the mean of both.
  Trained train(const Floats& p, const Floats& x, const Floats& g) const {
    Floats packed(m_net.packed_count()), back(m_net.packed_back_count()), activations(m_net.activation_count());
    Floats scratch(m_net.scratch_count(), 5.0f);
    Trained t{Floats(g.size()), Floats(p.size(), 7.0f), Floats(x.size(), 1.0f)};
    m_net.pack_for_training(p.data(), packed.data(), back.data());
    for (const bool again : {false, true}) {
      std::copy(x.begin(), x.end(), activations.begin());
      m_net.forward(packed.data(), activations.data(), t.out.data());
      m_net.backward(back.data(), activations.data(), g.data(), t.gradients.data(), again, t.d_x.data(), again,
                     scratch.data());
    }
    for (float& v : t.gradients) v /= 2;
    for (float& v : t.d_x) v /= 2;
    return t;
  }
  Doubles sample(const Floats& x, int rows, std::size_t s) const {
    Doubles v;
    for (std::size_t r = 0; r < static_cast<std::size_t>(rows); ++r)
      v.push_back(static_cast<double>(x[r * kBlock + s]));
    return v;
  }
};

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const std::string& target : simd_targets())
    for (const Norm norm : {Norm::none, Norm::actnorm}) {
      all.push_back({target, 3, 16, 1, 2, norm});
      all.push_back({target, 0, 16, 2, 1, norm});
      all.push_back({target, 18, 32, 2, 5, norm});
      all.push_back({target, 2, 48, 0, 3, norm});
      all.push_back({target, 66, 64, 1, 98, norm});
    }
  return all;
}
INSTANTIATE_TEST_SUITE_P(Nets, ResidualNetTest, testing::ValuesIn(cases()), [](const auto& p) {
  return p.param.target + "_" + std::to_string(p.param.inputs) + "_" + std::to_string(p.param.width) + "_" +
         (p.param.norm == Norm::none ? "plain" : "actnorm");
});

TEST_P(ResidualNetTest, ForwardAgreesWithPlainLoops) {
  const Floats p = parameters(), x = block(m_case.inputs, 4);
  const Doubles exact(p.begin(), p.end());
  Floats packed(m_net.packed_count()), out(static_cast<std::size_t>(m_case.outputs * kBlock));
  Floats scratch(static_cast<std::size_t>(2 * m_case.width * kBlock));
  m_net.pack(p.data(), packed.data());
  m_net.infer(packed.data(), x.data(), scratch.data(), out.data());
  EXPECT_EQ(out, train(p, x, block(m_case.outputs, 5)).out);
  for (std::size_t s = 0; s < kBlock; ++s) {
    const Doubles y = reference(m_net, exact, sample(x, m_case.inputs, s));
    for (std::size_t o = 0; o < y.size(); ++o)
      EXPECT_NEAR(static_cast<double>(out[o * kBlock + s]), y[o], 1e-5 * (1 + std::abs(y[o]))) << o << ", " << s;
  }
}

// The loss is sum_i g_i out_i. Central differences of the reference in double are exact to 1e-9 or so, unless a ReLU
// changes sides within the step: then the difference is skipped, which must stay rare.
TEST_P(ResidualNetTest, BackwardAgreesWithFiniteDifferences) {
  const Floats p = parameters(), x = block(m_case.inputs, 4), g = block(m_case.outputs, 5);
  auto [out, gradients, d_x] = train(p, x, g);
  m_net.unfold(p.data(), gradients.data());

  const Doubles exact(p.begin(), p.end());
  const auto loss = [&](const Doubles& q, std::size_t only, std::size_t input, double shift) {
    double sum = 0;
    for (std::size_t s = 0; s < kBlock; ++s) {
      if (only < kBlock && s != only) continue;
      Doubles v = sample(x, m_case.inputs, s);
      if (only < kBlock) v[input] += shift;
      const Doubles y = reference(m_net, q, v);
      for (std::size_t o = 0; o < y.size(); ++o) sum += static_cast<double>(g[o * kBlock + s]) * y[o];
    }
    return sum;
  };
  int checked = 0, skipped = 0;
  const auto compare = [&](const auto& f, double gradient, const std::string& what) {
    const double h = 1e-5, wide = (f(h) - f(-h)) / (2 * h), narrow = (f(h / 2) - f(-h / 2)) / h;
    if (std::abs(wide - narrow) > 1e-6 * (1 + std::abs(wide))) {
      ++skipped;
      return;
    }
    ++checked;
    EXPECT_NEAR(gradient, wide, 2e-4 * (1 + std::abs(wide))) << what;
  };
  for (const DenseLayer& l : m_net.layers()) {
    const auto check = [&](std::size_t i, const char* what) {
      compare(
          [&](double h) {
            Doubles q = exact;
            q[i] += h;
            return loss(q, kBlock, 0, 0);
          },
          static_cast<double>(gradients[i]), fmt::format("{} {} of layer {} -> {}", what, i, l.inputs, l.outputs));
    };
    for (std::uint32_t n = 0; n < 6; ++n) {
      const std::size_t o = sample_bits(6, n) % static_cast<std::size_t>(l.outputs);
      if (l.inputs > 0)
        check(l.weight + o * static_cast<std::size_t>(padded_inputs(l.inputs)) +
                  sample_bits(7, n) % static_cast<std::size_t>(l.inputs),
              "weight");
      check(l.bias + o, "bias");
      if (l.normalised) check(l.gain + o, "gain");
    }
  }
  for (std::size_t k = 0; k < static_cast<std::size_t>(m_case.inputs); ++k)
    for (std::size_t s = 0; s < kBlock; s += 13)
      compare([&](double h) { return loss(exact, s, k, h); }, static_cast<double>(d_x[k * kBlock + s]),
              fmt::format("input {} of sample {}", k, s));
  EXPECT_LT(skipped, checked / 5 + 3);
}

/// Root mean square of a - b, and the largest of them, over the root mean square of b.
std::array<double, 2> relative(const Floats& a, const Floats& b, std::size_t from, std::size_t count) {
  double squares = 0, errors = 0, most = 0;
  for (std::size_t i = from; i < from + count; ++i) {
    const double error = static_cast<double>(a[i]) - static_cast<double>(b[i]);
    squares += static_cast<double>(b[i]) * static_cast<double>(b[i]);
    errors += error * error;
    most = std::max(most, std::abs(error));
  }
  const double n = static_cast<double>(count), scale = std::sqrt(squares / n) + 1e-20;
  return {std::sqrt(errors / n) / scale, most / scale};
}

class Bf16Test : public ResidualNetTest {
  void SetUp() override {
    if (fastest_products_of_cpu != Products::bf16) GTEST_SKIP() << "this CPU does not multiply bfloat16";
  }
  static const inline Products fastest_products_of_cpu = fastest_products();
};
INSTANTIATE_TEST_SUITE_P(Nets, Bf16Test,
                         testing::Values(Case{"AVX2", 3, 16, 1, 2, Norm::actnorm, Products::bf16},
                                         Case{"AVX2", 0, 16, 2, 1, Norm::actnorm, Products::bf16},
                                         Case{"AVX2", 17, 32, 2, 5, Norm::none, Products::bf16},
                                         Case{"AVX2", 2, 48, 0, 3, Norm::none, Products::bf16},
                                         Case{"AVX2", 66, 64, 1, 98, Norm::none, Products::bf16}));

// bfloat16 has 8 significant bits: a rounding errs by 2^-9 at most, some 2^-10 of a number on average. Where it would
// move a sample to the other side of a ReLU, the gradients are those of another path: biases keep them off.
TEST_P(Bf16Test, TrainsAsFloatsDo) {
  Floats p = parameters();
  for (const DenseLayer& l : m_net.layers()) {
    for (std::size_t i = l.weight; i < l.bias; ++i) p[i] *= 0.1f;
    for (std::size_t o = 0; o < static_cast<std::size_t>(l.outputs); ++o)
      p[l.bias + o] += sample_float(8, static_cast<std::uint32_t>(o)) < 0.7f ? 4.0f : -4.0f;
  }
  const Floats x = block(m_case.inputs, 4);
  Floats g = block(m_case.outputs, 5);
  for (float& v : g) v += 1.5f;  // sums that do not cancel
  const Trained rounded = train(p, x, g);
  m_net = ResidualNet(m_case.inputs, m_case.width, m_case.blocks, m_case.outputs, m_case.norm, Products::floats);
  const Trained exact = train(p, x, g);
  const auto compare = [](const Floats& a, const Floats& b, std::size_t from, std::size_t count, const char* what) {
    const auto [error, most] = relative(a, b, from, count);
    EXPECT_LT(error, 0.01) << what << " " << from;
    EXPECT_LT(most, 0.06) << what << " " << from;
  };
  EXPECT_NE(rounded.out, exact.out);
  compare(rounded.out, exact.out, 0, exact.out.size(), "outputs");
  if (m_case.inputs > 0) compare(rounded.d_x, exact.d_x, 0, exact.d_x.size(), "inputs");
  for (const DenseLayer& l : m_net.layers()) {
    const auto outputs = static_cast<std::size_t>(l.outputs);
    if (l.inputs > 0)
      compare(rounded.gradients, exact.gradients, l.weight, outputs * static_cast<std::size_t>(padded_inputs(l.inputs)),
              "weights");
    compare(rounded.gradients, exact.gradients, l.bias, outputs, "bias");
  }
}

class ActnormTest : public ResidualNetTest {};
INSTANTIATE_TEST_SUITE_P(Nets, ActnormTest,
                         testing::Values(Case{"AVX2", 3, 16, 1, 2, Norm::actnorm},
                                         Case{"AVX2", 18, 32, 2, 5, Norm::actnorm}));

TEST_P(ActnormTest, StandardisesWhatGoesIntoReLUs) {
  Floats p(m_net.parameter_count());
  m_net.initialise(p.data(), 1, 1);
  const int blocks = 4;
  Floats x = block(blocks * m_case.inputs, 4);
  initialise_actnorm(m_net, blocks, x.data(), p.data());
  const Doubles exact(p.begin(), p.end());
  // The first layer's, from the reference.
  const DenseLayer& l = m_net.layers()[0];
  Doubles mean(static_cast<std::size_t>(l.outputs)), square = mean;
  for (std::size_t b = 0; b < blocks; ++b)
    for (std::size_t s = 0; s < kBlock; ++s) {
      Doubles v;
      for (std::size_t k = 0; k < static_cast<std::size_t>(m_case.inputs); ++k)
        v.push_back(static_cast<double>(x[(b * static_cast<std::size_t>(m_case.inputs) + k) * kBlock + s]));
      const Doubles y = layer(l, exact, v);
      for (std::size_t o = 0; o < y.size(); ++o) {
        mean[o] += y[o] / (blocks * kBlock);
        square[o] += y[o] * y[o] / (blocks * kBlock);
      }
    }
  for (std::size_t o = 0; o < mean.size(); ++o) {
    EXPECT_NEAR(mean[o], 0, 1e-4);
    EXPECT_NEAR(square[o], 1, 1e-3);
  }
}

TEST(ResidualNet, Settings) {
  EXPECT_THROW(ResidualNet(2, 20, 1, 2, Norm::none), ConfigError);
  EXPECT_THROW(ResidualNet(2, 16, -1, 2, Norm::none), ConfigError);
  EXPECT_EQ(ResidualNet(2, 64, 1, 2, Norm::none).multiply_adds(), 2u * 64 + 2 * 64 * 64 + 64 * 2);
  EXPECT_EQ(ResidualNet(0, 64, 1, 25, Norm::none).layers().size(), 1u) << "of constants a bias alone is trained";
}

}  // namespace
}  // namespace warpath::nn
