#include "estimate/vertex_source.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace warpath {
namespace {

/// Uniform numbers, and `expected` back from everywhere.
class Expects final : public VertexProposal {
 public:
  explicit Expects(float expected) : m_expected(expected) {}
  std::string family() const override { return "expects"; }
  const Layout& numbers() const override { return m_numbers; }
  void locate(const VertexContext&, std::size_t n, std::uint32_t* places) const override { std::fill_n(places, n, 0); }
  void sample(VertexDecision, const VertexContext&, const std::uint32_t*, std::size_t n,
              const std::array<const double*, 3>& z, const std::array<float*, 3>& y, float* inv_q) const override {
    for (std::size_t a = 0; a < 3; ++a) std::copy_n(z[a], n, y[a]);
    std::fill_n(inv_q, n, 1.0f);
  }
  void inverse_density(VertexDecision, const VertexContext&, const std::uint32_t*, std::size_t n,
                       const std::array<const float*, 3>&, float* inv_q) const override {
    std::fill_n(inv_q, n, 1.0f);
  }
  bool expect_return(const std::uint32_t*, std::size_t n, const float*, float* expected) const override {
    std::fill_n(expected, n, m_expected);
    return true;
  }
  void save(TensorFile&, const std::string&) const override {}

 private:
  Layout m_numbers;
  float m_expected;
};

struct Roulette {
  bool drawn;
  double survived = 0, weight = 0, mean = 0;  // share, mean of 1 / q of those that survived, and of all
};

constexpr std::size_t kPaths = 100000;

/// Roulette at a vertex with throughput 1 under a pixel of brightness 1, where the renderer lets go on what is less
/// than `survival`.
Roulette play(const VertexProposal& warp, float survival, bool knows_brightness = true) {
  std::vector<std::uint64_t> ids(kPaths);
  std::iota(ids.begin(), ids.end(), 0);
  std::vector<std::uint32_t> lanes(ids.begin(), ids.end());
  const std::vector<float> ones(kPaths, 1.0f), survivals(kPaths, survival);
  VertexContext context;
  context.throughput = ones.data();
  context.survival = survivals.data();
  std::vector<float> u(kPaths), v(kPaths), inv_q(kPaths, 1.0f);
  const Latents latents(7, ids);
  VertexSourceScratch scratch;
  VertexSource source(latents, warp, ones, ones, knows_brightness ? std::span(ones) : std::span<const float>(),
                      scratch);
  source.draw({GroupKind::lobe, 1}, lanes, &context, u.data(), nullptr, inv_q.data());
  source.draw({GroupKind::dir, 1}, lanes, &context, u.data(), v.data(), inv_q.data());
  Roulette roulette{source.draw({GroupKind::rr, 1}, lanes, &context, u.data(), nullptr, inv_q.data())};
  if (!roulette.drawn) return roulette;
  for (std::size_t i = 0; i < kPaths; ++i) {
    EXPECT_TRUE(u[i] >= 0 && u[i] < 1);
    const bool survives = u[i] < survival;
    roulette.survived += survives;
    roulette.weight += survives ? inv_q[i] : 0;
    roulette.mean += inv_q[i];
  }
  for (double* sum : {&roulette.survived, &roulette.weight, &roulette.mean}) *sum /= kPaths;
  return roulette;
}

// 4.5 standard errors: one false alarm in 147,000 choices of seeds, for each line.
TEST(VertexSource, RouletteGoesByWhatIsExpectedAndStaysUnbiased) {
  for (const float survival : {0.02f, 0.3f, 0.95f}) {
    double before = 0;
    for (const float expected : {0.0f, 0.05f, 0.1f, 0.2f, 1.0f, HUGE_VALF}) {
      const Roulette r = play(Expects(expected), survival);
      ASSERT_TRUE(r.drawn);
      // Those that survive stand for as many as the renderer would have let go on, at weight 1 each.
      const double p = r.survived, w = survival / p, n = kPaths;
      EXPECT_NEAR(r.weight, survival, 1e-5 + 4.5 * w * std::sqrt(p * (1 - p) / n));
      if (p < 1) {
        const double spread = std::fabs(w - (1 - survival) / (1 - p));
        EXPECT_NEAR(r.mean, 1, 1e-5 + 4.5 * spread * std::sqrt(p * (1 - p) / n));
      }
      EXPECT_GE(p, before);
      before = p;
      EXPECT_GT(p, 0.1);
      if (expected >= 1) {
        EXPECT_EQ(p, 1);
      }
    }
    EXPECT_GT(before, play(Expects(0), survival).survived + 0.5);
  }
}

TEST(VertexSource, RouletteIsTheRenderersUntilPixelsAreKnown) { EXPECT_FALSE(play(Expects(1), 0.3f, false).drawn); }

}  // namespace
}  // namespace warpath
