#include "nn/dense.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/rng.h"
#include "nn/adam.h"
#include "warpath/error.h"

namespace warpath::nn {
namespace {

using Floats = AlignedVector<float>;

/// Numbers in [-1,1), another row of them for each key.
Floats numbers(std::size_t count, std::uint64_t key) {
  Floats v(count);
  for (std::size_t i = 0; i < count; ++i) v[i] = 2 * sample_float(key, static_cast<std::uint32_t>(i)) - 1;
  return v;
}

/// Weights with rows padded by zeros, as the kernels have them.
Floats weights(int inputs, int outputs, std::uint64_t key) {
  Floats w = numbers(static_cast<std::size_t>(outputs * padded_inputs(inputs)), key);
  for (std::size_t i = 0; i < w.size(); ++i)
    if (static_cast<int>(i) % padded_inputs(inputs) >= inputs) w[i] = 0;
  return w;
}

/// Distance in units in the last place of the larger of |a|, |b| and `scale`.
double ulps(float a, float b, float scale = 0) {
  const float large = std::max({std::abs(a), std::abs(b), scale, 1e-30f});
  return std::abs(static_cast<double>(a) - static_cast<double>(b)) /
         (std::nextafter(large, INFINITY) - static_cast<double>(large));
}

/// Every case runs on every instruction set; sizes that fill no tile, some of them or all.
struct Size {
  int inputs, outputs;
};
constexpr Size kSizes[] = {{0, 3}, {1, 1}, {2, 16}, {3, 5}, {7, 8}, {16, 15}, {17, 33}, {31, 2}, {64, 64}, {100, 12}};

class Dense : public testing::TestWithParam<std::string> {
 protected:
  ForceSimdTarget m_target{GetParam()};
};
INSTANTIATE_TEST_SUITE_P(Targets, Dense, testing::ValuesIn(simd_targets()), [](const auto& p) { return p.param; });

TEST(Simd, BuiltForAvx2AndAvx512AndNothingElse) {
  for (const std::string& name : simd_targets()) EXPECT_TRUE(name == "AVX3" || name == "AVX2") << name;
  EXPECT_EQ(simd_targets().back(), "AVX2");
}

TEST(Simd, NoSuchTarget) { EXPECT_THROW(ForceSimdTarget("MMX"), ConfigError); }

float apply(Epilogue epilogue, double v, float skip, float act) {
  const float f = static_cast<float>(v), added = static_cast<float>(v + static_cast<double>(skip));
  switch (epilogue) {
    case Epilogue::linear:
      return f;
    case Epilogue::relu:
      return std::max(f, 0.0f);
    case Epilogue::add_relu:
      return std::max(added, 0.0f);
    case Epilogue::add:
      return added;
    case Epilogue::gate:
      return act > 0 ? f : 0;
    case Epilogue::add_gate:
      return act > 0 ? added : 0;
  }
  return NAN;
}

TEST_P(Dense, LayersAgreeWithScalarLoopsInDouble) {
  for (const auto [inputs, outputs] : kSizes)
    for (const Epilogue epilogue :
         {Epilogue::linear, Epilogue::relu, Epilogue::add_relu, Epilogue::add, Epilogue::gate, Epilogue::add_gate}) {
      const Floats w = weights(inputs, outputs, 1), b = numbers(static_cast<std::size_t>(outputs), 2);
      const Floats gain = numbers(static_cast<std::size_t>(outputs), 3);
      const Floats x = numbers(static_cast<std::size_t>(inputs * kBlock), 4);
      const Floats skip = numbers(static_cast<std::size_t>(outputs * kBlock), 5);
      const Floats act = numbers(static_cast<std::size_t>(outputs * kBlock), 6);
      Floats packed(static_cast<std::size_t>(packed_size(inputs, outputs)));
      pack(inputs, outputs, w.data(), gain.data(), b.data(), packed.data());
      Floats y(skip.size() + 16, 7.0f);
      dense(epilogue, inputs, outputs, packed.data(), x.data(), y.data(), skip.data(), act.data());
      for (int o = 0; o < outputs; ++o)
        for (int s = 0; s < kBlock; ++s) {
          double sum = static_cast<double>(b[static_cast<std::size_t>(o)]);
          for (int k = 0; k < inputs; ++k)
            sum += static_cast<double>(gain[static_cast<std::size_t>(o)]) *
                   static_cast<double>(w[static_cast<std::size_t>(o * padded_inputs(inputs) + k)]) *
                   static_cast<double>(x[static_cast<std::size_t>(k * kBlock + s)]);
          const std::size_t i = static_cast<std::size_t>(o * kBlock + s);
          // Sums of `inputs` rounded products of numbers below 1.
          ASSERT_LE(ulps(y[i], apply(epilogue, sum, skip[i], act[i]), 1), 8 + inputs)
              << inputs << " x " << outputs << ", neuron " << o << ", sample " << s;
        }
      EXPECT_TRUE(std::all_of(y.end() - 16, y.end(), [](float v) { return v == 7.0f; })) << "wrote too far";
    }
}

TEST_P(Dense, SkipMayBeTheOutput) {
  const Floats w = weights(9, 11, 1), b = numbers(11, 2), x = numbers(9 * kBlock, 3), skip = numbers(11 * kBlock, 4);
  Floats packed(static_cast<std::size_t>(packed_size(9, 11))), apart(skip.size()), same = skip;
  pack(9, 11, w.data(), nullptr, b.data(), packed.data());
  dense(Epilogue::add_relu, 9, 11, packed.data(), x.data(), apart.data(), skip.data());
  dense(Epilogue::add_relu, 9, 11, packed.data(), x.data(), same.data(), same.data());
  EXPECT_EQ(apart, same);
}

TEST_P(Dense, TransposedWeightsCarryGradientsBack) {
  for (const auto [inputs, outputs] : kSizes) {
    const Floats w = weights(inputs, outputs, 1), gain = numbers(static_cast<std::size_t>(outputs), 3);
    const Floats g = numbers(static_cast<std::size_t>(outputs * kBlock), 4);
    Floats packed(static_cast<std::size_t>(packed_size(outputs, inputs)));
    pack_transposed(inputs, outputs, w.data(), gain.data(), packed.data());
    Floats d_x(static_cast<std::size_t>(inputs * kBlock));
    dense(Epilogue::linear, outputs, inputs, packed.data(), g.data(), d_x.data());
    for (int k = 0; k < inputs; ++k)
      for (int s = 0; s < kBlock; ++s) {
        double sum = 0;
        for (int o = 0; o < outputs; ++o)
          sum += static_cast<double>(gain[static_cast<std::size_t>(o)]) *
                 static_cast<double>(w[static_cast<std::size_t>(o * padded_inputs(inputs) + k)]) *
                 static_cast<double>(g[static_cast<std::size_t>(o * kBlock + s)]);
        ASSERT_LE(ulps(d_x[static_cast<std::size_t>(k * kBlock + s)], static_cast<float>(sum), 1), 8 + outputs);
      }
  }
}

TEST_P(Dense, TransposeTakesPanelsOf16) {
  for (const int features : {1, 5, 16, 17, 40}) {
    const Floats x = numbers(static_cast<std::size_t>(features * kBlock), 1);
    Floats xt(static_cast<std::size_t>(padded_inputs(features) * kBlock), 7.0f);
    transpose(features, x.data(), xt.data());
    for (int f = 0; f < padded_inputs(features); ++f)
      for (int s = 0; s < kBlock; ++s)
        ASSERT_EQ(xt[static_cast<std::size_t>((f / 16 * kBlock + s) * 16 + f % 16)],
                  f < features ? x[static_cast<std::size_t>(f * kBlock + s)] : 0.0f)
            << "feature " << f << " of " << features << ", sample " << s;
  }
}

TEST_P(Dense, GradientOfWeightsAgreesWithScalarLoopsInDouble) {
  for (const auto [inputs, outputs] : kSizes) {
    const Floats x = numbers(static_cast<std::size_t>(inputs * kBlock), 1);
    const Floats g = numbers(static_cast<std::size_t>(outputs * kBlock), 2);
    Floats xt(static_cast<std::size_t>(padded_inputs(inputs) * kBlock));
    transpose(inputs, x.data(), xt.data());
    Floats d_w(static_cast<std::size_t>(outputs * padded_inputs(inputs)), 7.0f),
        d_b(static_cast<std::size_t>(outputs), 7.0f);
    for (int pass = 1; pass <= 2; ++pass) {  // the second one adds the same again
      dense_gradient(inputs, outputs, g.data(), xt.data(), d_w.data(), d_b.data(), pass > 1);
      for (int o = 0; o < outputs; ++o) {
        double bias = 0;
        for (int s = 0; s < kBlock; ++s) bias += static_cast<double>(g[static_cast<std::size_t>(o * kBlock + s)]);
        ASSERT_LE(ulps(d_b[static_cast<std::size_t>(o)], static_cast<float>(pass * bias), 1), 2 * kBlock);
        for (int k = 0; k < padded_inputs(inputs); ++k) {
          double sum = 0;
          for (int s = 0; k < inputs && s < kBlock; ++s)
            sum += static_cast<double>(g[static_cast<std::size_t>(o * kBlock + s)]) *
                   static_cast<double>(x[static_cast<std::size_t>(k * kBlock + s)]);
          ASSERT_LE(
              ulps(d_w[static_cast<std::size_t>(o * padded_inputs(inputs) + k)], static_cast<float>(pass * sum), 1),
              2 * kBlock)
              << inputs << " x " << outputs << ", neuron " << o << ", input " << k;
        }
      }
    }
  }
}

// Sums run over inputs and samples in the same order on every instruction set; only a bias's sum over the lanes
// differs.
TEST(Simd, TargetsAgree) {
  if (simd_targets().size() < 2) GTEST_SKIP() << "this CPU has only " << simd_targets()[0];
  const int inputs = 37, outputs = 43;
  const Floats w = weights(inputs, outputs, 1), b = numbers(43, 2), x = numbers(37 * kBlock, 3),
               g = numbers(43 * kBlock, 4);
  std::vector<Floats> y, d_w, d_b;
  for (const std::string& name : simd_targets()) {
    const ForceSimdTarget force(name);
    Floats packed(static_cast<std::size_t>(packed_size(inputs, outputs)));
    Floats xt(static_cast<std::size_t>(padded_inputs(inputs) * kBlock));
    pack(inputs, outputs, w.data(), nullptr, b.data(), packed.data());
    transpose(inputs, x.data(), xt.data());
    y.emplace_back(43 * kBlock);
    d_w.emplace_back(static_cast<std::size_t>(outputs * padded_inputs(inputs)));
    d_b.emplace_back(43);
    dense(Epilogue::relu, inputs, outputs, packed.data(), x.data(), y.back().data());
    dense_gradient(inputs, outputs, g.data(), xt.data(), d_w.back().data(), d_b.back().data(), false);
  }
  EXPECT_EQ(y[0], y[1]);
  EXPECT_EQ(d_w[0], d_w[1]);
  for (std::size_t o = 0; o < 43; ++o) EXPECT_LE(ulps(d_b[0][o], d_b[1][o], 1), 32) << o;
}

TEST_P(Dense, AdamFollowsItsPaper) {
  const std::size_t count = 48;
  Floats p = numbers(count, 1), m(count, 0.0f), v(count, 0.0f);
  std::vector<double> p_ref(p.begin(), p.end()), m_ref(count), v_ref(count);
  const Adam adam{.rate = 0.01f};
  for (int step = 1; step <= 20; ++step) {
    const Floats g = numbers(count, 100 + static_cast<std::uint64_t>(step));
    adam_step(adam, step, count, g.data(), p.data(), m.data(), v.data());
    for (std::size_t i = 0; i < count; ++i) {
      const double gi = static_cast<double>(g[i]);
      m_ref[i] = 0.9 * m_ref[i] + 0.1 * gi;
      v_ref[i] = 0.999 * v_ref[i] + 0.001 * gi * gi;
      p_ref[i] -=
          0.01 * (m_ref[i] / (1 - std::pow(0.9, step))) / (std::sqrt(v_ref[i] / (1 - std::pow(0.999, step))) + 1e-8);
    }
  }
  for (std::size_t i = 0; i < count; ++i) EXPECT_NEAR(static_cast<double>(p[i]), p_ref[i], 2e-6) << i;
}

TEST_P(Dense, SlotsAreAddedAndAveragesMove) {
  Floats a = numbers(3 * 32, 1);
  const Floats before = a;
  add_slots(3, 32, 16, a.data());
  for (std::size_t i = 0; i < 96; ++i)
    EXPECT_EQ(a[i], i < 16 ? (before[i] + before[32 + i]) + before[64 + i] : before[i]) << i;
  Floats average(32, 1.0f);
  move_average(0.25f, 32, before.data(), average.data());
  for (std::size_t i = 0; i < 32; ++i) EXPECT_NEAR(average[i], 0.75f + 0.25f * before[i], 1e-6f) << i;
}

}  // namespace
}  // namespace warpath::nn
