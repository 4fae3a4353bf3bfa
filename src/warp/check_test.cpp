#include "warp/check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/tensor_file.h"

namespace warpath {
namespace {

using testing::HasSubstr;

/// y = z^2 in 1D, q = 1 / (2 sqrt(y)): a warp that is right until it is told otherwise.
class Square : public Warp {
 public:
  double log_q_error = 0;       // in both directions
  double log_sample_error = 0;  // in forward alone
  double draw_error = 0;        // power other than 2
  bool reaches_one = false;
  bool depends_on_batch = false;

  int dims() const override { return 1; }
  std::string family() const override { return "square"; }
  void forward(Batch<const double> z, Batch<double> y, std::span<double> log_det) const override {
    for (std::size_t i = 0; i < z.rows(); ++i) {
      const double x = std::max(z(i, 0), 1e-12);
      y(i, 0) = reaches_one && x > 0.999 ? 1.0 : std::pow(x, 2 + draw_error);
      log_det[i] = std::log(2 * x) - log_q_error + log_sample_error;
      if (depends_on_batch) log_det[i] += 1e-3 * static_cast<double>(z.rows() % 2);
    }
  }
  void inverse(Batch<const double> y, Batch<double> z, std::span<double> log_det) const override {
    for (std::size_t i = 0; i < y.rows(); ++i) {
      z(i, 0) = std::sqrt(y(i, 0));
      log_det[i] = -std::log(2 * std::max(z(i, 0), 1e-12)) + log_q_error;
    }
  }
  void save(TensorFile&, const std::string&) const override {}
};

TEST(Check, PassesWhatIsRight) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    CheckOptions options;
    options.seed = seed;
    EXPECT_EQ(check_proposal(Square(), options), "");
    EXPECT_EQ(check_warp(Square(), options), "");
  }
}

TEST(Check, SeesADensityThatIsNotNormalised) {
  Square warp;
  warp.log_q_error = 0.1;
  EXPECT_THAT(check_proposal(warp), HasSubstr("mean of 2 q / (1 + q)"));
  EXPECT_THAT(check_warp(warp), HasSubstr("central differences"));
}

TEST(Check, SeesSamplesThatDoNotFollowTheDensity) {
  Square warp;
  warp.draw_error = 0.3;
  const std::string text = check_proposal(warp);
  EXPECT_THAT(text, HasSubstr("density: chi^2"));
  EXPECT_THAT(text, HasSubstr("of coordinate 0"));
  EXPECT_THAT(text, HasSubstr("seed 1, 65536 draws, false-alarm rate 1e-06"));
  EXPECT_THAT(check_warp(warp), HasSubstr("forward(inverse(y)) is off"));
}

TEST(Check, SeesASampleThatContradictsTheDensity) {
  Square warp;
  warp.log_sample_error = 1e-6;
  EXPECT_THAT(check_proposal(warp), HasSubstr("log q of sample and log_density differ by 1e-06"));
  EXPECT_THAT(check_warp(warp), HasSubstr("log_det there and back"));
}

TEST(Check, SeesNumbersThatReachOne) {
  Square warp;
  warp.reaches_one = true;
  EXPECT_THAT(check_proposal(warp), HasSubstr("not in [0,1)"));
}

TEST(Check, SeesSamplesThatDependOnTheirBatch) {
  Square warp;
  warp.depends_on_batch = true;
  EXPECT_THAT(check_proposal(warp), HasSubstr("batches: row"));
}

}  // namespace
}  // namespace warpath
