#include "warp/spline.h"

#include <gtest/gtest.h>

#include "core/rng.h"
#include "core/tensor_file.h"
#include "warp/check.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr int kDims[] = {1, 2, 3, 4, 5, 8, 16, 32};

SplineSettings small() {
  SplineSettings s;
  s.couplings = 4;
  s.width = 16;
  s.bins = 8;
  s.encoding_bins = 16;
  return s;
}

/// A spline flow that bends the hypercube: random weights.
std::shared_ptr<const Spline> bent(int dims, const SplineSettings& settings) {
  spline::Flow flow(dims, settings);
  auto p = flow.initial(3);
  std::uint32_t n = 0;
  const float size = dims > 8 ? 0.1f : dims > 4 ? 0.15f : 0.3f;
  for (const ParameterView& view : flow.views())
    for (std::size_t r = 0; r < view.rows; ++r)
      for (std::size_t c = 0; c < view.cols; ++c)
        p[view.offset + r * view.stride + c] += size * (2 * sample_float(5, n++) - 1);
  return std::make_shared<Spline>(std::move(flow), std::move(p));
}

// A y and the same y a rounding of doubles away may give networks neighbouring floats.
CheckOptions tolerances() {
  CheckOptions options;
  options.log_q_tolerance = 1e-4;
  options.difference_step = 2e-4;  // networks see floats
  options.log_det_tolerance = 2e-2;
  options.kink = 2e-2;
  return options;
}

Matrix<double> uniform_rows(std::size_t rows, int dims) {
  Matrix<double> z(rows, static_cast<std::size_t>(dims));
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t d = 0; d < z.cols(); ++d) z(i, d) = sample_double(sample_key(1, i), static_cast<std::uint32_t>(d));
  return z;
}

class SplineTest : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Dims, SplineTest, testing::ValuesIn(kDims),
                         [](const auto& p) { return std::to_string(p.param) + "D"; });

TEST_P(SplineTest, KeepsEveryPromise) {
  const auto warp = bent(GetParam(), small());
  EXPECT_EQ(check_proposal(*warp, tolerances()), "");
  EXPECT_EQ(check_warp(*warp, tolerances()), "");
}

TEST_P(SplineTest, KeepsEveryPromiseAutoregressive) {
  SplineSettings settings = small();
  settings.couplings = GetParam() > 2 ? 1 : 2;
  settings.masks = SplineSettings::Masks::autoregressive;
  const auto warp = bent(GetParam(), settings);
  EXPECT_EQ(check_proposal(*warp, tolerances()), "");
  EXPECT_EQ(check_warp(*warp, tolerances()), "");
}

TEST_P(SplineTest, IsTheIdentityUntrained) {
  for (const int bins : {2, 7, 16, 64}) {
    SplineSettings s = small();
    s.bins = bins;
    const auto warp = Spline::untrained(GetParam(), s, 7);
    EXPECT_EQ(check_warp(*warp), "");
    const Matrix<double> z = uniform_rows(200, GetParam());
    Matrix<double> y(z.rows(), z.cols());
    std::vector<double> log_det(z.rows(), 9);
    warp->forward(z.batch(), y.batch(), log_det);
    for (std::size_t i = 0; i < z.values().size(); ++i) EXPECT_NEAR(y.values()[i], z.values()[i], 1e-14);
    for (const double l : log_det) EXPECT_NEAR(l, 0, 1e-12);
  }
}

TEST_P(SplineTest, DensityIsFiniteAtTheBorder) {
  const auto warp = bent(GetParam(), small());
  const double corners[] = {0, 5e-324, 1e-300, 1e-8, 1 - 1e-8, 1 - 0x1p-53};
  Matrix<double> y(std::size(corners), static_cast<std::size_t>(GetParam())), z = y;
  for (std::size_t i = 0; i < y.rows(); ++i)
    for (std::size_t d = 0; d < y.cols(); ++d) y(i, d) = corners[(i + d * i) % std::size(corners)];
  std::vector<double> log_q(y.rows());
  warp->log_density(y.batch(), log_q);
  for (const double l : log_q) EXPECT_TRUE(std::isfinite(l)) << l;
  warp->forward(y.batch(), z.batch(), log_q);
  for (const double l : log_q) EXPECT_TRUE(std::isfinite(l)) << l;
  for (const double x : z.values()) EXPECT_TRUE(x >= 0 && x < 1) << x;
}

TEST_P(SplineTest, ComesBackFromAFile) {
  for (const auto masks : {SplineSettings::Masks::binary, SplineSettings::Masks::autoregressive}) {
    SplineSettings settings = small();
    settings.masks = masks;
    const auto warp = bent(GetParam(), settings);
    TensorFile file;
    warp->save(file, "a.");
    const auto loaded = Spline::load(file, "a.");
    ASSERT_TRUE(loaded);
    EXPECT_EQ(loaded->parameters(), warp->parameters());
    EXPECT_EQ(loaded->settings().bins, warp->settings().bins);
    EXPECT_EQ(loaded->settings().encoding_bins, warp->settings().encoding_bins);
    EXPECT_EQ(loaded->settings().masks, masks);
  }
}

// A density that factors as q(y_0) q(y_1 | y_0) q(y_2 | y_0, y_1) ...: the number of dimension k depends on those up to
// k alone.
TEST(Spline, AutoregressiveMasksLookBack) {
  SplineSettings settings = small();
  settings.couplings = 1;
  settings.masks = SplineSettings::Masks::autoregressive;
  const auto warp = bent(5, settings);
  for (std::size_t changed = 0; changed < 5; ++changed) {
    Matrix<double> y(2, 5), z(2, 5);
    for (std::size_t d = 0; d < 5; ++d) y(0, d) = y(1, d) = 0.3 + 0.1 * static_cast<double>(d);
    y(1, changed) = 0.9;
    std::vector<double> log_det(2);
    warp->inverse(y.batch(), z.batch(), log_det);
    for (std::size_t d = 0; d < 5; ++d) EXPECT_EQ(z(0, d) == z(1, d), d < changed) << d << " of " << changed;
  }
}

// Weights as wild as can be: bins as narrow and slopes as steep as they get, everywhere.
TEST(Spline, StaysFiniteWithWildWeights) {
  spline::Flow flow(4, small());
  auto p = flow.initial(3);
  std::uint32_t n = 0;
  for (const ParameterView& view : flow.views())
    for (std::size_t r = 0; r < view.rows; ++r)
      for (std::size_t c = 0; c < view.cols; ++c)
        p[view.offset + r * view.stride + c] = 100 * (2 * sample_float(5, n++) - 1);
  const Spline warp(std::move(flow), std::move(p));
  const Matrix<double> z = uniform_rows(1000, 4);
  Matrix<double> y(z.rows(), 4), back(z.rows(), 4);
  std::vector<double> log_det(z.rows()), log_back(z.rows());
  warp.forward(z.batch(), y.batch(), log_det);
  warp.inverse(y.batch(), back.batch(), log_back);
  for (std::size_t i = 0; i < z.rows(); ++i) {
    EXPECT_TRUE(std::isfinite(log_det[i]) && std::isfinite(log_back[i]));
    for (std::size_t d = 0; d < 4; ++d) EXPECT_TRUE(y(i, d) >= 0 && y(i, d) < 1 && back(i, d) >= 0 && back(i, d) < 1);
  }
}

// One flow on every instruction set: networks and knots may differ in the last bits of floats, so y by a few units in
// the last place of 1 in float, and ln q by as many for each of the bends between.
TEST(Spline, InstructionSetsAgree) {
  const auto warp = bent(6, small());
  const Matrix<double> z = uniform_rows(300, 6);
  std::vector<Matrix<double>> y;
  std::vector<std::vector<double>> log_det;
  for (const std::string& target : nn::simd_targets()) {
    const nn::ForceSimdTarget force(target);
    y.emplace_back(z.rows(), 6);
    log_det.emplace_back(z.rows());
    warp->forward(z.batch(), y.back().batch(), log_det.back());
  }
  constexpr double kUlp = 0x1p-23;
  for (std::size_t t = 1; t < y.size(); ++t) {
    for (std::size_t i = 0; i < z.values().size(); ++i) EXPECT_NEAR(y[t].values()[i], y[0].values()[i], 8 * kUlp);
    for (std::size_t i = 0; i < z.rows(); ++i) EXPECT_NEAR(log_det[t][i], log_det[0][i], 64 * kUlp);
  }
}

TEST(Spline, BrokenFilesAreErrors) {
  TensorFile good;
  bent(2, small())->save(good, "w.");
  const auto broken = [&](const auto& change) {
    TensorFile file = good;
    change(file);
    EXPECT_THROW(Spline::load(file, "w."), FileError);
  };
  broken([](TensorFile& f) { f.metadata()["w.couplings"] = "5"; });
  broken([](TensorFile& f) { f.metadata()["w.couplings"] = "0"; });
  broken([](TensorFile& f) { f.metadata()["w.width"] = "17"; });
  broken([](TensorFile& f) { f.metadata()["w.bins"] = "1"; });
  broken([](TensorFile& f) { f.metadata()["w.bins"] = "65"; });
  broken([](TensorFile& f) { f.metadata()["w.bins"] = "16"; });
  broken([](TensorFile& f) { f.metadata().erase("w.blocks"); });
  broken([](TensorFile& f) { f.metadata()["w.masks"] = "some"; });
  broken([](TensorFile& f) {
    const std::vector<float> nan(16, NAN);
    f.put<float>("w.coupling0.layer0.bias", {16}, nan);
  });
  EXPECT_NO_THROW(Spline::load(good, "w."));
}

}  // namespace
}  // namespace warpath
