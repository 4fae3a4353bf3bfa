#include "warp/realnvp.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "core/rng.h"
#include "core/tensor_file.h"
#include "warp/check.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr int kDims[] = {1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 32};

RealNvpSettings small(bool shared = false, RealNvpSettings::Norm norm = RealNvpSettings::Norm::actnorm) {
  RealNvpSettings s;
  s.couplings = 4;
  s.width = 16;
  s.shared = shared;
  s.norm = norm;
  return s;
}

/// A Real NVP that bends the hypercube: random scales, shifts and gains.
std::shared_ptr<const RealNvp> bent(int dims, const RealNvpSettings& settings) {
  realnvp::Flow flow(dims, settings);
  auto p = flow.initial(3);
  std::uint32_t n = 0;
  const float size = dims > 8 ? 0.1f : 0.3f;
  for (const ParameterView& view : flow.views())
    for (std::size_t r = 0; r < view.rows; ++r)
      for (std::size_t c = 0; c < view.cols; ++c)
        p[view.offset + r * view.stride + c] += size * (2 * sample_float(5, n++) - 1) * (view.cols > 1 ? 0.5f : 1.0f);
  return std::make_shared<RealNvp>(std::move(flow), std::move(p));
}

// float32 networks: ln q of a y and of the same y a rounding error away.
CheckOptions tolerances() {
  CheckOptions options;
  options.log_q_tolerance = 1e-3;
  options.difference_step = 2e-4;
  options.log_det_tolerance = 2e-2;
  options.kink = 2e-2;
  options.border = 1e-7;  // doubles near 1 are too coarse to stretch; the tracer's floats are coarser still
  return options;
}

class RealNvpTest : public testing::TestWithParam<std::tuple<int, bool>> {};
INSTANTIATE_TEST_SUITE_P(Dims, RealNvpTest, testing::Combine(testing::ValuesIn(kDims), testing::Bool()),
                         [](const auto& p) {
                           return std::to_string(std::get<0>(p.param)) + (std::get<1>(p.param) ? "D_shared" : "D");
                         });

TEST_P(RealNvpTest, KeepsEveryPromise) {
  const auto warp = bent(std::get<0>(GetParam()), small(std::get<1>(GetParam())));
  EXPECT_EQ(check_proposal(*warp, tolerances()), "");
  EXPECT_EQ(check_warp(*warp, tolerances()), "");
}

TEST_P(RealNvpTest, IsExactlyTheIdentityUntrained) {
  const int dims = std::get<0>(GetParam());
  const std::size_t rows = 200, cols = static_cast<std::size_t>(dims);
  const auto warp = RealNvp::untrained(dims, small(std::get<1>(GetParam())), 7);
  Matrix<double> z(rows, cols), y(rows, cols);
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t d = 0; d < cols; ++d) z(i, d) = sample_double(sample_key(1, i), static_cast<std::uint32_t>(d));
  z(0, 0) = 0;
  z(1, 0) = 0x1p-53;
  z(2, 0) = 1 - 0x1p-53;
  z(3, 0) = 1e-300;
  std::vector<double> log_det(rows, 9);
  warp->forward(z.batch(), y.batch(), log_det);
  EXPECT_EQ(y.values(), z.values());
  EXPECT_EQ(log_det, std::vector<double>(rows, 0.0));
  warp->inverse(z.batch(), y.batch(), log_det);
  EXPECT_EQ(y.values(), z.values());
  EXPECT_EQ(log_det, std::vector<double>(rows, 0.0));
}

TEST_P(RealNvpTest, DensityIsFiniteAtTheBorder) {
  const int dims = std::get<0>(GetParam());
  const auto warp = bent(dims, small(std::get<1>(GetParam())));
  const double corners[] = {0, 5e-324, 1e-300, 1e-8, 1 - 1e-8, 1 - 0x1p-53};
  Matrix<double> y(std::size(corners), static_cast<std::size_t>(dims)), z = y;
  for (std::size_t i = 0; i < y.rows(); ++i)
    for (std::size_t d = 0; d < y.cols(); ++d) y(i, d) = corners[(i + d * i) % std::size(corners)];
  std::vector<double> log_q(y.rows());
  warp->log_density(y.batch(), log_q);
  for (const double l : log_q) EXPECT_TRUE(std::isfinite(l)) << l;
  warp->forward(y.batch(), z.batch(), log_q);
  for (const double l : log_q) EXPECT_TRUE(std::isfinite(l)) << l;
  for (const double x : z.values()) EXPECT_TRUE(x >= 0 && x < 1) << x;
}

TEST_P(RealNvpTest, ComesBackFromAFile) {
  const auto warp = bent(std::get<0>(GetParam()), small(std::get<1>(GetParam())));
  TensorFile file;
  warp->save(file, "a.");
  const auto loaded = RealNvp::load(file, "a.");
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->parameters(), warp->parameters());
  EXPECT_EQ(loaded->settings().couplings, warp->settings().couplings);
  EXPECT_EQ(loaded->settings().shared, warp->settings().shared);
}

// One flow on every instruction set: transcendental functions and sums in other lanes may differ in the last bits.
TEST(RealNvp, InstructionSetsAgree) {
  const auto warp = bent(6, small());
  Matrix<double> z(100, 6);
  for (std::size_t i = 0; i < z.values().size(); ++i) z.values()[i] = sample_double(3, static_cast<std::uint32_t>(i));
  std::vector<Matrix<double>> y;
  std::vector<std::vector<double>> log_det;
  for (const std::string& target : nn::simd_targets()) {
    const nn::ForceSimdTarget force(target);
    y.emplace_back(100, 6);
    log_det.emplace_back(100);
    warp->forward(z.batch(), y.back().batch(), log_det.back());
  }
  for (std::size_t t = 1; t < y.size(); ++t) {
    for (std::size_t i = 0; i < z.values().size(); ++i) EXPECT_NEAR(y[t].values()[i], y[0].values()[i], 1e-6);
    for (std::size_t i = 0; i < 100; ++i) EXPECT_NEAR(log_det[t][i], log_det[0][i], 1e-5);
  }
}

TEST(RealNvp, BatchStatisticsAreStored) {
  const auto warp = bent(3, small(false, RealNvpSettings::Norm::batch));
  TensorFile file;
  warp->save(file, "");
  EXPECT_EQ(RealNvp::load(file, "")->parameters(), warp->parameters());
  const std::vector<float> negative(16, -1.0f);
  file.put<float>("coupling0.s.layer0.variance", {16}, negative);
  EXPECT_THROW(RealNvp::load(file, ""), FileError);
}

TEST(RealNvp, BrokenFilesAreErrors) {
  TensorFile good;
  bent(2, small())->save(good, "w.");
  const auto broken = [&](const auto& change) {
    TensorFile file = good;
    change(file);
    EXPECT_THROW(RealNvp::load(file, "w."), FileError);
  };
  broken([](TensorFile& f) { f.metadata()["w.couplings"] = "5"; });
  broken([](TensorFile& f) { f.metadata()["w.couplings"] = "0"; });
  broken([](TensorFile& f) { f.metadata()["w.width"] = "17"; });
  broken([](TensorFile& f) { f.metadata()["w.width"] = "8192"; });
  broken([](TensorFile& f) { f.metadata()["w.norm"] = "layer"; });
  broken([](TensorFile& f) { f.metadata().erase("w.blocks"); });
  broken([](TensorFile& f) {
    const std::vector<float> nan(1, NAN);
    f.put<float>("w.coupling0.scale", {1}, nan);
  });
  EXPECT_NO_THROW(RealNvp::load(good, "w."));
}

}  // namespace
}  // namespace warpath
