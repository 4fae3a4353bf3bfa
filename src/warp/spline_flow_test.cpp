#include "warp/spline_flow.h"

#include <gtest/gtest.h>

#include "core/rng.h"
#include "warp/spline_reference.h"
#include "warpath/error.h"

namespace warpath::spline {
namespace {

using nn::kBlock;
using Floats = nn::AlignedVector<float>;
using Doubles = nn::AlignedVector<double>;

struct Case {
  int dims, bins, encoding_bins, blocks;
  double uniform;  ///< 0: likelihood
  std::string target;
  SplineSettings::Masks masks = SplineSettings::Masks::binary;
  int couplings = 3;
  int context_rows = 0;
};

SplineSettings settings(const Case& c) {
  SplineSettings s;
  s.masks = c.masks;
  s.couplings = c.couplings;
  s.width = 16;
  s.blocks = c.blocks;
  s.bins = c.bins;
  s.encoding_bins = c.encoding_bins;
  return s;
}

/// Parameters of no identity: every tensor filled with random numbers.
Floats random_parameters(const Flow& flow) {
  Floats p = flow.initial(1);
  std::uint32_t n = 0;
  for (const ParameterView& view : flow.views()) {
    const float size = view.name.ends_with("weight") ? 1.7f / std::sqrt(static_cast<float>(view.cols)) : 1.0f;
    for (std::size_t r = 0; r < view.rows; ++r)
      for (std::size_t c = 0; c < view.cols; ++c)
        p[view.offset + r * view.stride + c] = size * (2 * sample_float(17, n++) - 1);
  }
  return p;
}

class SplineFlowTest : public testing::TestWithParam<Case> {
 protected:
  Case m_case = GetParam();
  nn::ForceSimdTarget m_target{m_case.target};
  Flow m_flow{m_case.dims, settings(m_case), m_case.context_rows};
  Floats m_parameters = random_parameters(m_flow);
  Doubles m_y = block_of_y(m_case.dims);
  Floats m_context = block_of_context(m_case.context_rows);

  /// A block of y that are floats, so that the training pass sees the same numbers; some near the border.
  static Doubles block_of_y(int dims) {
    Doubles y(static_cast<std::size_t>(dims * kBlock));
    for (std::size_t i = 0; i < y.size(); ++i) {
      y[i] = static_cast<double>(sample_float(3, static_cast<std::uint32_t>(i)));
      if (i % 29 == 7) y[i] *= 0x1p-20;
      if (i % 31 == 8 && i % 29 != 7) y[i] = 1 - 0x1p-20;
    }
    return y;
  }
  static Floats block_of_context(int rows) {
    Floats context(static_cast<std::size_t>(rows * kBlock));
    for (std::size_t i = 0; i < context.size(); ++i)
      context[i] = 2 * sample_float(23, static_cast<std::uint32_t>(i)) - 1;
    return context;
  }
  std::vector<double> context(std::size_t s) const {
    std::vector<double> rows;
    for (std::size_t r = 0; r < static_cast<std::size_t>(m_case.context_rows); ++r)
      rows.push_back(static_cast<double>(m_context[r * kBlock + s]));
    return rows;
  }
  std::vector<double> sample(std::size_t s) const {
    std::vector<double> v;
    for (std::size_t i = 0; i < static_cast<std::size_t>(m_case.dims); ++i) v.push_back(m_y[i * kBlock + s]);
    return v;
  }
};

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const std::string& target : nn::simd_targets()) {
    all.push_back({1, 16, 8, 1, 0, target});
    all.push_back({2, 2, 0, 0, 0, target});
    all.push_back({3, 5, 8, 1, 0.1, target});
    all.push_back({5, 16, 16, 1, 0.3, target});
    all.push_back({8, 64, 4, 2, 0, target});
    all.push_back({32, 8, 3, 1, 0, target});
    // No gradients go through the first layer, some through the second.
    all.push_back({4, 8, 5, 1, 0.1, target, SplineSettings::Masks::autoregressive, 1});
    all.push_back({3, 8, 5, 0, 0, target, SplineSettings::Masks::autoregressive, 2});
    // Conditioned; a single dimension, too.
    all.push_back({3, 8, 5, 1, 0.1, target, SplineSettings::Masks::autoregressive, 1, 7});
    all.push_back({4, 6, 3, 0, 0, target, SplineSettings::Masks::binary, 3, 20});
    all.push_back({1, 6, 3, 1, 0.2, target, SplineSettings::Masks::binary, 2, 3});
  }
  return all;
}
INSTANTIATE_TEST_SUITE_P(Flows, SplineFlowTest, testing::ValuesIn(cases()), [](const auto& p) {
  const bool binary = p.param.masks == SplineSettings::Masks::binary;
  return fmt::format("{}_{}D_{}{}", p.param.target, p.param.dims, binary ? "binary" : "autoregressive",
                     p.param.context_rows > 0 ? "_conditioned" : "");
});

TEST_P(SplineFlowTest, DensityAgreesWithTheReference) {
  PackedParameters packed;
  m_flow.pack(m_parameters.data(), packed, false);
  Doubles z(m_y.size()), log_q(kBlock);
  Floats scratch(m_flow.scratch_count());
  m_flow.inverse(packed, m_y.data(), m_context.data(), z.data(), log_q.data(), scratch.data());
  const Reference reference(m_flow, {m_parameters.begin(), m_parameters.end()});
  double most = 0;
  for (std::size_t s = 0; s < kBlock; ++s) {
    const double exact = reference.log_density(sample(s), context(s));
    // Each spline's bins are differences of float knots: relative errors of 1e-7 times the number of bins.
    EXPECT_NEAR(log_q[s], exact, 2e-6 * (8 + m_case.bins) * m_case.dims) << s;
    most = std::max(most, std::abs(exact));
  }
  EXPECT_GT(most, 0.3) << "too flat for a test";
}

TEST_P(SplineFlowTest, ForwardUndoesInverse) {
  PackedParameters packed;
  m_flow.pack(m_parameters.data(), packed, false);
  Doubles z(m_y.size()), y(m_y.size()), there(kBlock), back(kBlock);
  Floats scratch(m_flow.scratch_count());
  m_flow.inverse(packed, m_y.data(), m_context.data(), z.data(), there.data(), scratch.data());
  m_flow.forward(packed, z.data(), m_context.data(), y.data(), back.data(), scratch.data());
  for (std::size_t i = 0; i < y.size(); ++i) EXPECT_NEAR(y[i], m_y[i], 1e-6) << i;
  for (std::size_t s = 0; s < kBlock; ++s) EXPECT_NEAR(there[s], -back[s], 1e-5) << s;
}

// Central differences of the reference's loss in double; those that cross a kink of a ReLU, or a knot, where S'' jumps,
// are told by two step sizes that do not agree, and must stay rare.
TEST_P(SplineFlowTest, GradientsAgreeWithFiniteDifferences) {
  using Loss = SplineSettings::Loss;
  PackedParameters packed;
  m_flow.pack(m_parameters.data(), packed, true);
  Floats weight(kBlock), target(kBlock), gradients(m_parameters.size() + 16, 0.0f);
  Floats scratch(m_flow.training_scratch_count() + 16, 3.0f);
  for (std::size_t s = 0; s < kBlock; ++s) {
    weight[s] = s < 50 ? 0.5f + sample_float(9, static_cast<std::uint32_t>(s)) : 0.0f;
    target[s] = 3 * sample_float(10, static_cast<std::uint32_t>(s));
  }
  gradients.back() = 5;
  const FlowObjective objective{m_case.uniform > 0 ? Loss::variance : Loss::likelihood, m_case.uniform,
                                m_case.uniform > 0 ? 50.0 : 1.0};  // nothing is cut off
  const double loss = m_flow.train_block(packed, m_y.data(), m_context.data(), weight.data(), target.data(), objective,
                                         gradients.data(), false, scratch.data());
  const Floats once(gradients.begin(), gradients.begin() + static_cast<std::ptrdiff_t>(m_parameters.size()));
  m_flow.train_block(packed, m_y.data(), m_context.data(), weight.data(), target.data(), objective, gradients.data(),
                     true, scratch.data());
  for (std::size_t i = 0; i < once.size(); ++i)
    ASSERT_NEAR(gradients[i], 2 * once[i], 1e-4f * (1 + std::abs(once[i]))) << i;
  EXPECT_EQ(gradients.back(), 5.0f) << "wrote too far";
  gradients = once;
  EXPECT_EQ(Floats(scratch.end() - 16, scratch.end()), Floats(16, 3.0f)) << "wrote behind the scratch";

  Reference reference(m_flow, {m_parameters.begin(), m_parameters.end()});
  const auto loss_at = [&](std::size_t i, double shift) {
    reference.parameters()[i] += shift;
    double sum = 0;
    for (std::size_t s = 0; s < 50; ++s) {
      const double log_q = reference.log_density(sample(s), context(s));
      const double w = static_cast<double>(weight[s]), mixed = (1 - m_case.uniform) * std::exp(log_q) + m_case.uniform;
      sum += w * (m_case.uniform > 0 ? static_cast<double>(target[s]) / mixed : -log_q);
    }
    reference.parameters()[i] -= shift;
    return sum;
  };
  EXPECT_NEAR(loss, loss_at(0, 0), 1e-4 * (m_case.dims + std::abs(loss)));
  int checked = 0, skipped = 0;
  std::uint32_t n = 0;
  for (const ParameterView& view : m_flow.views())
    for (int i = 0; i < 8 && view.cols > 0; ++i) {
      const std::size_t r = sample_bits(11, n++) % view.rows, c = sample_bits(12, n++) % view.cols;
      const std::size_t at = view.offset + r * view.stride + c;
      const double h = 1e-6;
      const double wide = (loss_at(at, h) - loss_at(at, -h)) / (2 * h);
      const double narrow = (loss_at(at, h / 2) - loss_at(at, -h / 2)) / h;
      if (std::abs(wide - narrow) > 1e-5 * (1 + std::abs(wide))) {
        ++skipped;
        continue;
      }
      ++checked;
      EXPECT_NEAR(static_cast<double>(gradients[at]) * objective.scale, wide, 2e-3 * (1 + std::abs(wide)))
          << view.name << "(" << r << ", " << c << ")";
    }
  EXPECT_LT(skipped, checked / 4) << "too many kinks for a test";
}

TEST(SplineFlow, Settings) {
  const auto refused = [](auto change) {
    SplineSettings s;
    change(s);
    EXPECT_THROW(Flow(2, s), ConfigError);
  };
  refused([](SplineSettings& s) { s.couplings = 0; });
  refused([](SplineSettings& s) { s.width = 17; });
  refused([](SplineSettings& s) { s.bins = 1; });
  refused([](SplineSettings& s) { s.bins = 65; });
  refused([](SplineSettings& s) { s.encoding_bins = -1; });
}

}  // namespace
}  // namespace warpath::spline
