// Drawing the numbers of a vertex, on one thread: what the path knows there is looked up once, then come the numbers of
// light sampling and those of scattering.
//   bench_vertex [--benchmark_filter=...]      ns/vertex of each part
#include <benchmark/benchmark.h>

#include <ctime>

#include "bench/nn/fma_peak.h"
#include "core/floating_point.h"
#include "core/rng.h"
#include "path/vertex.h"
#include "train/conditional_kdtree_learner.h"
#include "train/conditional_spline_learner.h"
#include "train/field_learner.h"

namespace {
using namespace warpath;

constexpr std::size_t kVertices = 2048;

/// Vertices on the walls of a room, as a batch of paths meets them: neighbours first, then all over.
struct Vertices {
  VertexBuffer buffer;
  explicit Vertices(std::uint64_t seed) {
    for (std::size_t i = 0; i < kVertices; ++i) {
      const std::uint64_t key = sample_key(seed, i);
      const auto side = static_cast<std::uint32_t>(sample_float(key, 3) * 6);
      Vertex v;
      for (std::uint32_t k = 0; k < 3; ++k) v.position[k] = sample_float(key, k);
      v.position[side / 2] = side % 2 ? 1.0f : 0.0f;
      v.normal[side / 2] = side % 2 ? -1.0f : 1.0f;
      v.wi = v.albedo = {0.5f, 0.5f, 0.5f};
      v.roughness = 1;
      v.film = {v.position[0], v.position[2]};
      v.kind = static_cast<std::uint8_t>(SurfaceKind::diffuse);
      v.material = side;
      buffer.add(v);
    }
  }
};

/// What passes would teach: light from a corner.
std::shared_ptr<const VertexProposal> teach(VertexLearner& learner) {
  for (std::uint64_t pass = 0; pass < 4; ++pass) {
    for (std::uint64_t b = 0; b < 64; ++b) {
      const Vertices vertices(100 * pass + b);
      std::array<std::vector<float>, kBounceDimensions> u;
      std::vector<float> inv_q(kVertices, 1.0f), light, scatter_return;
      std::vector<std::uint32_t> lanes;
      for (std::uint32_t i = 0; i < kVertices; ++i) {
        for (std::uint32_t d = 0; d < kBounceDimensions; ++d)
          u[d].push_back(sample_float(sample_key(1000 + 100 * pass + b, i), d));
        light.push_back(u[1][i] < 0.3f && u[2][i] > 0.5f ? 1.0f : 0.0f);
        scatter_return.push_back(u[4][i] < 0.5f && u[5][i] < vertices.buffer.view().position[0][i] ? 1.0f : 0.1f);
        lanes.push_back(i);
      }
      VertexRecords records;
      records.bounce = 1;
      records.lanes = lanes;
      records.context = vertices.buffer.view();
      for (std::size_t d = 0; d < kBounceDimensions; ++d) records.numbers[d] = u[d].data();
      records.inv_q_light = records.inv_q_scatter = inv_q.data();
      records.light_return = light.data();
      records.scatter_return = scatter_return.data();
      const auto recorder = learner.make_recorder();
      recorder->record(records);
      learner.merge(*recorder);
    }
    learner.fit();
  }
  return learner.fit();
}

std::shared_ptr<const VertexProposal> field() {
  FieldLearner learner({}, 1);
  return teach(learner);
}

const Layout& first_hit() {
  static const Layout numbers = Layout::parse("bounce1.light+bounce1.light_uv+bounce1.lobe+bounce1");
  return numbers;
}
std::shared_ptr<const VertexProposal> conditional_kdtree() {
  ConditionalKdTreeSettings settings;
  settings.numbers = first_hit();
  ConditionalKdTreeLearner learner(settings, 320, 180, 0.1);
  return teach(learner);
}
std::shared_ptr<const VertexProposal> conditional_spline() {
  ConditionalSplineSettings settings;
  settings.numbers = first_hit();
  ConditionalSplineLearner learner(settings, 0.1, 1);
  return teach(learner);
}

/// CPU seconds of this thread: others may be using the machine.
double thread_seconds() {
  timespec time;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

void draw(benchmark::State& state, const std::shared_ptr<const VertexProposal>& warp) {
  const FlushDenormals flush;
  const Vertices vertices(7);
  std::vector<std::uint32_t> places(kVertices * warp->place_size());
  std::array<std::vector<double>, 3> z;
  std::array<std::vector<float>, 3> y;
  std::vector<float> inv_q(kVertices);
  for (std::uint32_t a = 0; a < 3; ++a) {
    y[a].resize(kVertices);
    for (std::size_t i = 0; i < kVertices; ++i) z[a].push_back(sample_double(sample_key(3, i), a));
  }
  double locating = 0, light = 0, scatter = 0;
  const auto context = vertices.buffer.view();
  const auto sample = [&](VertexDecision which) {
    warp->sample(which, context, places.data(), kVertices, {z[0].data(), z[1].data(), z[2].data()},
                 {y[0].data(), y[1].data(), y[2].data()}, inv_q.data());
    benchmark::ClobberMemory();
  };
  for (auto _ : state) {
    const double start = thread_seconds();
    warp->locate(context, kVertices, places.data());
    benchmark::ClobberMemory();
    const double located = thread_seconds();
    sample(VertexDecision::light_sampling);
    const double lit = thread_seconds();
    sample(VertexDecision::scattering);
    const double scattered = thread_seconds();
    locating += located - start, light += lit - located, scatter += scattered - lit;
  }
  const double over = 1e9 / static_cast<double>(state.iterations() * kVertices);
  static const double peak = bench::fma_peak();
  state.counters["peak_GFLOP/s"] = peak * 1e-9;
  state.counters["ns/vertex"] = (locating + light + scatter) * over;
  state.counters["locate"] = locating * over;
  state.counters["light"] = light * over;
  state.counters["scatter"] = scatter * over;
}

void draw_field(benchmark::State& state) {
  static const auto warp = field();
  draw(state, warp);
}
void draw_conditional_kdtree(benchmark::State& state) {
  static const auto warp = conditional_kdtree();
  draw(state, warp);
}
void draw_conditional_spline(benchmark::State& state) {
  static const auto warp = conditional_spline();
  draw(state, warp);
}
BENCHMARK(draw_field)->Name("draw/field");
BENCHMARK(draw_conditional_kdtree)->Name("draw/kdtree of the first hit");
BENCHMARK(draw_conditional_spline)->Name("draw/spline of the first hit");

}  // namespace

BENCHMARK_MAIN();
