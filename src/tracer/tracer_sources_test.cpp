// The door of the tracer: what it draws from a PrimarySource, and what it shows to it and to a VertexRecorder.
#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "path/layout.h"
#include "tracer/test_scene.h"
#include "tracer/tracer.h"

namespace warpath {
namespace {

using testing::Estimate;
using testing::estimate;
using testing::facing;
using testing::make_ids;
using testing::make_rectangle;
using testing::make_sphere;
using testing::SceneBuilder;

// A room with everything that draws numbers: several lights, glass, rough metal, motion, a lens.
Scene busy_scene() {
  SceneBuilder b;
  b.box(b.diffuse(Color(0.7f, 0.6f, 0.5f)));
  b.light(make_rectangle(facing({0, 0.99f, 0}, {0, -1, 0}, 0.3f)), Color(5.0f));
  b.light(make_sphere({-0.6f, -0.5f, -0.3f}, 0.1f), Color(4.0f, 2.0f, 1.0f));
  b.emitter(PointEmitter{{0.5f, 0.5f, 0.5f}, Color(0.2f)});
  Dielectric glass;
  glass.specular_reflectance = glass.specular_transmittance = b.constant(Color(1.0f));
  b.shape(make_sphere({0.3f, -0.6f, -0.2f}, 0.3f), b.bsdf(glass));
  RoughConductor metal;
  metal.distribution = MicrofacetType::ggx;
  metal.alpha_u = metal.alpha_v = b.constant(Color(0.3f));
  metal.specular_reflectance = b.constant(Color(0.9f));
  metal.eta = Color(0.2f), metal.k = Color(3.0f);
  Sphere ball = make_sphere({-0.3f, 0.2f, -0.6f}, 0.25f);
  ball.center[1] = {0.1f, 0.2f, -0.6f};
  b.shape(ball, b.bsdf(metal));
  b.look({0, 0, 0.9f}, {0, 0, -1}, {0, 1, 0}, 70);
  b.scene.sensor.aperture_radius = 0.02f;
  b.scene.sensor.focus_distance = 1.5f;
  b.scene.integrator.rr_depth = 3;
  return std::move(b.scene);
}

TEST(Batches, ResultsDependNeitherOnTheirSizeNorOnThreads) {
  const Tracer tracer(busy_scene());
  const std::size_t n = 1500;
  const auto ids = make_ids(100, n);
  PathResults whole;
  UniformSource source(3, ids);
  tracer.trace(source, n, whole);
  for (const std::size_t size : {std::size_t{1}, std::size_t{7}, std::size_t{64}, std::size_t{1000}}) {
    std::vector<Color> parts(n);
    tbb::parallel_for(std::size_t{0}, (n + size - 1) / size, [&](std::size_t batch) {
      const std::size_t first = batch * size, count = std::min(size, n - first);
      PathResults results;
      UniformSource part(3, std::span(ids).subspan(first, count));
      tracer.trace(part, count, results);
      std::copy_n(results.radiance.begin(), count, parts.begin() + static_cast<std::ptrdiff_t>(first));
    });
    std::size_t different = 0;
    for (std::size_t i = 0; i < n; ++i) different += std::memcmp(&parts[i], &whole.radiance[i], sizeof(Color)) != 0;
    EXPECT_EQ(different, 0u) << "batches of " << size;
  }
}

// Every group's number, handed out as y, gives the path that drew it.
TEST(Sources, FixedSourceRepeatsWhatUniformSourceDrew) {
  const Tracer tracer(busy_scene());
  const Layout layout =
      Layout::parse("film+lens+time+bounce1.light+bounce1.light_uv+bounce1.lobe+bounce1+bounce2+bounce3.rr");
  const std::size_t n = 500;
  const auto ids = make_ids(0, n);
  std::vector<double> y;
  for (std::size_t i = 0; i < n; ++i)
    for (int c = 0; c < layout.dims(); ++c) y.push_back(sample_float(sample_key(3, ids[i]), layout.dimension(c)));
  PathResults a, b;
  UniformSource uniform(3, ids);
  tracer.trace(uniform, n, a);
  FixedSource fixed(3, ids, layout, y.data(), static_cast<std::size_t>(layout.dims()));
  tracer.trace(fixed, n, b);
  for (std::size_t i = 0; i < n; ++i) {
    EXPECT_EQ(a.radiance[i], b.radiance[i]);
    EXPECT_EQ(a.film_x[i], b.film_x[i]);
  }
}

// Draws every number of some groups from the density 1/2 + u and checks what the tracer says of them.
class LinearSource : public UniformSource {
 public:
  LinearSource(std::uint64_t seed, std::span<const std::uint64_t> ids, bool wants)
      : UniformSource(seed, ids), m_wants(wants) {}
  bool wants_context() const override { return m_wants; }
  bool draw(Group group, std::span<const std::uint32_t> lanes, const VertexContext* context, float* u0, float* u1,
            float* inv_q) override {
    EXPECT_TRUE(std::is_sorted(lanes.begin(), lanes.end()));
    EXPECT_FALSE(lanes.empty());
    EXPECT_EQ(context != nullptr, m_wants && group.bounce > 0);
    if (context)
      for (std::size_t i = 0; i < lanes.size(); ++i) {
        float cosine = 0, length = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          cosine += context->normal[k][i] * context->wi[k][i];
          length += sqr(context->normal[k][i]);
          EXPECT_LE(std::fabs(context->position[k][i]), 1.001f);
          EXPECT_GE(context->albedo[k][i], 0);
        }
        EXPECT_GT(cosine, -1e-4f);
        EXPECT_NEAR(length, 1, 1e-4f);
        EXPECT_GE(context->roughness[i], 0);
        EXPECT_LE(context->roughness[i], 1);
      }
    UniformSource::draw(group, lanes, context, u0, u1, inv_q);
    const auto warp = [](float u) { return std::min(kOneMinusEpsilon, std::sqrt(0.25f + 2 * u) - 0.5f); };
    for (std::size_t i = 0; i < lanes.size(); ++i) {
      u0[i] = warp(u0[i]);
      inv_q[i] = 1 / (0.5f + u0[i]);
      if (!u1) continue;
      u1[i] = warp(u1[i]);
      inv_q[i] /= 0.5f + u1[i];
    }
    return true;
  }

 private:
  bool m_wants;
};

TEST(Sources, WeightsOfAWarpedSourceLeaveTheMeanAlone) {
  Scene scene = busy_scene();
  scene.integrator.max_depth = 5;
  const Tracer tracer(std::move(scene));
  const Estimate plain = estimate(tracer, 20, 400000);
  for (const bool wants : {false, true}) {
    double sum[3] = {}, squares[3] = {};
    const std::size_t n = 400000;
    PathResults results;
    for (std::size_t first = 0; first < n; first += 2000) {
      const auto ids = make_ids(first, 2000);
      LinearSource source(21, ids, wants);
      tracer.trace(source, ids.size(), results);
      for (const Color& r : results.radiance)
        for (int c = 0; c < 3; ++c) sum[c] += r[c], squares[c] += static_cast<double>(r[c]) * r[c];
    }
    for (int c = 0; c < 3; ++c) {
      const double mean = sum[c] / n, error = std::sqrt((squares[c] / n - mean * mean) / n);
      // Fails by chance once in 150,000 runs.
      EXPECT_NEAR(mean, plain.mean[c], 4.5 * std::hypot(error, plain.error[c]));
    }
  }
}

class SumRecorder : public VertexRecorder {
 public:
  explicit SumRecorder(std::size_t lanes) : first(lanes, 0.0f), last_scatter_return(lanes, 0.0f) {}
  void record(const VertexRecords& r) override {
    EXPECT_EQ(r.bounce, bounces + 1) << "bounce by bounce";
    bounces = r.bounce;
    for (std::size_t i = 0; i < r.lanes.size(); ++i) {
      if (r.bounce == 1) first[r.lanes[i]] = r.light_return[i] + r.scatter_return[i];
      for (const float* number : r.numbers) {
        EXPECT_GE(number[i], 0);
        EXPECT_LT(number[i], 1);
      }
      EXPECT_GT(r.inv_q_light[i], 0);
      EXPECT_GT(r.inv_q_scatter[i], 0);
      EXPECT_LT(r.context.material[i], 100u);
    }
    vertices += r.lanes.size();
  }
  std::vector<float> first, last_scatter_return;
  std::uint16_t bounces = 0;
  std::size_t vertices = 0;
};

TEST(Recorder, LightAndBeyondOfTheFirstVertexAddUpToTheRadiance) {
  const Tracer tracer(busy_scene());
  const std::size_t n = 2000;
  const auto ids = make_ids(0, n);
  for (const bool warped : {false, true}) {
    SumRecorder recorder(n);
    PathResults with, without;
    UniformSource uniform(3, ids);
    LinearSource linear(3, ids, true);
    PrimarySource& source = warped ? static_cast<PrimarySource&>(linear) : uniform;
    tracer.trace(source, n, with, &recorder);
    tracer.trace(source, n, without);
    EXPECT_GT(recorder.vertices, n);
    double camera = 1;
    for (std::size_t i = 0; i < n; ++i) {
      EXPECT_EQ(with.radiance[i], without.radiance[i]);
      if (warped) {  // what is recorded is over the throughput before the vertex
        const auto dimension = [&](std::uint32_t d) {
          const float u = sample_float(sample_key(3, ids[i]), d);
          return 1 / (0.5 + std::sqrt(0.25 + 2 * u) - 0.5);
        };
        camera = 1;
        for (std::uint32_t d = 0; d < kCameraDimensions; ++d) camera *= dimension(d);
      }
      const double expected = luminance(with.radiance[i]) / camera;
      EXPECT_NEAR(recorder.first[i], expected, 2e-4 * (0.01 + expected));
    }
  }
}

}  // namespace
}  // namespace warpath
