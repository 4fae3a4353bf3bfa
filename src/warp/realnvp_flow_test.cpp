#include "warp/realnvp_flow.h"

#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "core/rng.h"
#include "warp/realnvp_kernels.h"
#include "warp/realnvp_reference.h"
#include "warpath/error.h"

namespace warpath::realnvp {
namespace {

using nn::kBlock;
using Floats = nn::AlignedVector<float>;
using Doubles = nn::AlignedVector<double>;

struct Case {
  int dims;
  bool shared;
  int bins;
  RealNvpSettings::Norm norm;
  double uniform;
  std::string target;
};

/// Parameters of no identity: every tensor filled with random numbers, scales and t included.
Floats random_parameters(const Flow& flow) {
  Floats p = flow.initial(1);
  std::uint32_t n = 0;
  for (const ParameterView& view : flow.views()) {
    const float size = view.name.ends_with("weight") ? 1.2f / std::sqrt(static_cast<float>(view.cols)) : 0.4f;
    for (std::size_t r = 0; r < view.rows; ++r)
      for (std::size_t c = 0; c < view.cols; ++c) {
        float& value = p[view.offset + r * view.stride + c];
        value = size * (2 * sample_float(17, n++) - 1) + (view.name.ends_with("gain") ? 1.0f : 0.0f);
      }
  }
  return p;
}

/// A block of y, mostly inside, with some so near to the border that couplings go on with slope 1 there.
Doubles block_of_y(int dims) {
  Doubles y(static_cast<std::size_t>(dims * kBlock));
  for (std::size_t i = 0; i < y.size(); ++i) {
    y[i] = 0.001 + 0.998 * sample_double(3, static_cast<std::uint32_t>(i));
    if (i % 29 == 7) y[i] = 1e-9 * y[i];
    if (i % 31 == 8 && i % 29 != 7) y[i] = 1 - 1e-9 * y[i];
  }
  return y;
}

class FlowTest : public testing::TestWithParam<Case> {
 protected:
  static RealNvpSettings settings(const Case& c) {
    RealNvpSettings s;
    s.couplings = 3;
    s.width = 16;
    s.blocks = 1;
    s.shared = c.shared;
    s.norm = c.norm;
    s.encoding_bins = c.bins;
    s.masks = c.dims == 4 ? RealNvpSettings::Masks::alternating : RealNvpSettings::Masks::binary;
    return s;
  }
  Case m_case = GetParam();
  nn::ForceSimdTarget m_target{m_case.target};
  Flow m_flow{m_case.dims, settings(m_case)};
  Floats m_parameters = random_parameters(m_flow);
  Doubles m_y = block_of_y(m_case.dims);

  std::vector<double> sample(std::size_t s) const {
    std::vector<double> v;
    for (std::size_t i = 0; i < static_cast<std::size_t>(m_case.dims); ++i) v.push_back(m_y[i * kBlock + s]);
    return v;
  }
};

std::vector<Case> cases() {
  std::vector<Case> all;
  using Norm = RealNvpSettings::Norm;
  for (const std::string& target : nn::simd_targets()) {
    all.push_back({1, false, 0, Norm::actnorm, 0, target});
    all.push_back({2, true, 0, Norm::none, 0, target});
    all.push_back({3, false, 5, Norm::none, 0.1, target});
    all.push_back({4, false, 0, Norm::actnorm, 0, target});
    all.push_back({5, true, 16, Norm::actnorm, 0.3, target});
    all.push_back({32, false, 0, Norm::none, 0, target});
  }
  return all;
}
INSTANTIATE_TEST_SUITE_P(Flows, FlowTest, testing::ValuesIn(cases()),
                         [](const auto& p) { return p.param.target + "_" + std::to_string(p.param.dims) + "D"; });

TEST_P(FlowTest, DensityAgreesWithTheReference) {
  PackedParameters packed;
  m_flow.pack(m_parameters.data(), packed, false);
  Doubles z(m_y.size()), log_q(kBlock);
  Floats scratch(m_flow.scratch_count());
  m_flow.inverse(packed, m_y.data(), z.data(), log_q.data(), scratch.data());
  const Reference reference(m_flow, {m_parameters.begin(), m_parameters.end()});
  for (std::size_t s = 0; s < kBlock; ++s) {
    const double exact = reference.log_density(sample(s));
    EXPECT_NEAR(log_q[s], exact, 2e-5 * (m_case.dims + std::abs(exact))) << s;
  }
}

TEST_P(FlowTest, ForwardUndoesInverse) {
  PackedParameters packed;
  m_flow.pack(m_parameters.data(), packed, false);
  Doubles z(m_y.size()), y(m_y.size()), there(kBlock), back(kBlock);
  Floats scratch(m_flow.scratch_count());
  m_flow.inverse(packed, m_y.data(), z.data(), there.data(), scratch.data());
  m_flow.forward(packed, z.data(), y.data(), back.data(), scratch.data());
  // A z that lies within rounding of 1 has lost what it knew: these weights are wild, e^-40 is among their densities.
  int lost = 0;
  for (std::size_t s = 0; s < kBlock; ++s) {
    bool near_border = false;
    for (std::size_t i = s; i < z.size(); i += kBlock) near_border = near_border || z[i] < 1e-10 || 1 - z[i] < 1e-10;
    if (near_border) {
      ++lost;
      continue;
    }
    for (std::size_t i = s; i < y.size(); i += kBlock) EXPECT_NEAR(y[i], m_y[i], 1e-5) << i;
    EXPECT_NEAR(there[s], -back[s], 1e-4 * (1 + std::abs(there[s]))) << s;
  }
  EXPECT_LT(lost, kBlock * 3 / 4);
}

// Central differences of the reference's loss in double; those that cross a kink of a ReLU are told by two step sizes
// that do not agree, and must stay rare.
TEST_P(FlowTest, GradientsAgreeWithFiniteDifferences) {
  PackedParameters packed;
  m_flow.pack(m_parameters.data(), packed, true);
  Floats weight(kBlock), gradients(m_parameters.size() + 16, 0.0f), scratch(m_flow.training_scratch_count());
  for (std::size_t s = 0; s < kBlock; ++s)
    weight[s] = s < 50 ? 0.5f + sample_float(9, static_cast<std::uint32_t>(s)) : 0.0f;
  gradients.back() = 5;
  const FlowObjective objective{
      m_case.uniform > 0 ? RealNvpSettings::Loss::variance : RealNvpSettings::Loss::likelihood, m_case.uniform,
      m_case.uniform > 0 ? 50.0 : 1.0};  // nothing is cut off
  Floats target(kBlock);
  for (std::size_t s = 0; s < kBlock; ++s) target[s] = 3 * sample_float(10, static_cast<std::uint32_t>(s));
  const double loss = m_flow.train_block(packed, m_y.data(), nullptr, weight.data(), target.data(), objective,
                                         gradients.data(), false, scratch.data());
  const Floats once(gradients.begin(), gradients.begin() + static_cast<std::ptrdiff_t>(m_parameters.size()));
  m_flow.train_block(packed, m_y.data(), nullptr, weight.data(), target.data(), objective, gradients.data(), true,
                     scratch.data());
  for (std::size_t i = 0; i < once.size(); ++i)
    ASSERT_NEAR(gradients[i], 2 * once[i], 1e-4f * (1 + std::abs(once[i]))) << i;
  EXPECT_EQ(gradients.back(), 5.0f) << "wrote too far";
  gradients = once;
  for (const Coupling& c : m_flow.couplings())
    for (std::size_t n = 0; n < c.nets.size(); ++n)
      c.nets[n].unfold(m_parameters.data() + c.parameters[n], gradients.data() + c.parameters[n]);

  Reference reference(m_flow, {m_parameters.begin(), m_parameters.end()});
  const auto loss_at = [&](std::size_t i, double shift) {
    reference.parameters()[i] += shift;
    double sum = 0;
    for (std::size_t s = 0; s < 50; ++s) {
      const double log_q = reference.log_density(sample(s));
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
    for (int i = 0; i < 3 && view.cols > 0; ++i) {
      const std::size_t r = sample_bits(11, n++) % view.rows, c = sample_bits(12, n++) % view.cols;
      const std::size_t at = view.offset + r * view.stride + c;
      const double h = 1e-5;
      const double wide = (loss_at(at, h) - loss_at(at, -h)) / (2 * h);
      const double narrow = (loss_at(at, h / 2) - loss_at(at, -h / 2)) / h;
      if (std::abs(wide - narrow) > 1e-5 * (1 + std::abs(wide))) {
        ++skipped;
        continue;
      }
      ++checked;
      EXPECT_NEAR(static_cast<double>(gradients[at]) * objective.scale, wide, 1e-3 * (1 + std::abs(wide)))
          << view.name << "(" << r << ", " << c << ")";
    }
  EXPECT_LT(skipped, checked / 4) << "too many kinks for a test";
}

// Far beyond what a flow does, and where it must do nothing.
TEST(Kernels, ShiftLogitFollowsItsFormula) {
  for (const std::string& target : nn::simd_targets()) {
    const nn::ForceSimdTarget force(target);
    constexpr int kRows = 32;
    Doubles z(kRows * kBlock), y(kRows * kBlock), log_det(kBlock, 0.5);
    Floats v0(z.size()), v1(z.size());
    for (std::size_t i = 0; i < z.size(); ++i) {
      z[i] = i % 13 == 0 ? 0.0 : sample_double(4, static_cast<std::uint32_t>(i));
      v0[i] = 4 * sample_float(5, static_cast<std::uint32_t>(i)) - 2;
      const bool still = i % kBlock < 8;
      v1[i] = still ? v0[i] : v0[i] + 600 * sample_float(6, static_cast<std::uint32_t>(i)) - 300;
    }
    shift_logit(kRows, z.data(), v0.data(), v1.data(), y.data(), log_det.data());
    for (std::size_t s = 0; s < kBlock; ++s) {
      double exact = 0.5;
      for (std::size_t i = s; i < z.size(); i += kBlock) {
        const double back = std::clamp(static_cast<double>(v0[i]) - static_cast<double>(v1[i]), -300.0, 300.0);
        const double sum = z[i] + (1 - z[i]) * std::exp(back);
        EXPECT_NEAR(y[i], z[i] / sum, 1e-6 * z[i] / sum) << i;
        EXPECT_LT(y[i], 1) << i;
        if (s < 8) {
          EXPECT_EQ(y[i], z[i]) << i;
        }
        exact += back - 2 * std::log(sum);
      }
      EXPECT_NEAR(log_det[s], exact, s < 8 ? 0 : 1e-5) << s;
    }
  }
}

// Which dimensions each coupling keeps, as digits.
std::vector<std::string> kept(int dims, int couplings, RealNvpSettings::Masks masks) {
  RealNvpSettings s;
  s.couplings = couplings;
  s.masks = masks;
  std::vector<std::string> names;
  const Flow flow(dims, s);
  for (const Coupling& c : flow.couplings()) names.push_back(fmt::format("{}", fmt::join(c.kept, "")));
  return names;
}

TEST(Flow, Masks) {
  using Names = std::vector<std::string>;
  using Masks = RealNvpSettings::Masks;
  EXPECT_EQ(kept(1, 2, Masks::binary), (Names{"", ""}));
  EXPECT_EQ(kept(2, 4, Masks::binary), (Names{"0", "1", "0", "1"}));
  EXPECT_EQ(kept(4, 4, Masks::alternating), (Names{"02", "13", "02", "13"}));
  EXPECT_EQ(kept(4, 8, Masks::binary), (Names{"02", "13", "01", "23", "03", "12", "02", "13"}));
  EXPECT_EQ(kept(3, 6, Masks::binary), (Names{"02", "1", "01", "2", "0", "12"}));
  EXPECT_EQ(kept(8, 6, Masks::binary), (Names{"0246", "1357", "0145", "2367", "0123", "4567"}));
}

// No dimension may be without company on the kept side, or on the moved one.
TEST(Flow, EverySplitHasTwoSides) {
  for (int dims = 2; dims <= 32; ++dims) {
    RealNvpSettings s;
    s.couplings = 64;
    const Flow flow(dims, s);
    for (const Coupling& c : flow.couplings()) {
      EXPECT_FALSE(c.kept.empty()) << dims;
      EXPECT_FALSE(c.moved.empty()) << dims;
    }
  }
}

TEST(Flow, Settings) {
  RealNvpSettings s;
  s.couplings = 0;
  EXPECT_THROW(Flow(2, s), ConfigError);
  s.couplings = 2;
  s.width = 17;
  EXPECT_THROW(Flow(2, s), ConfigError);
}

}  // namespace
}  // namespace warpath::realnvp
