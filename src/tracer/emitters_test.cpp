#include "tracer/emitters.h"

#include <gtest/gtest.h>

#include <boost/math/distributions/chi_squared.hpp>
#include <functional>

#include "tracer/compiled_scene.h"
#include "tracer/sampling.h"
#include "tracer/test_scene.h"
#include "tracer/workspace.h"
#include "warpath/error.h"

namespace warpath {
namespace {

using testing::facing;
using testing::make_rectangle;
using testing::make_sphere;
using testing::scale;
using testing::SceneBuilder;
using testing::translate;

// Density with which light sampling at `from` makes the directions of a stream of rays that start there.
std::vector<float> densities(const CompiledScene& scene, Workspace& w, std::size_t n, const Vec3& from, float time) {
  scene.embree.intersect(w.rays, n, w.hits, false);
  std::vector<float> pdf(n);
  for (std::size_t i = 0; i < n; ++i) {
    if (w.hits.shape[i] == kNoHit) {
      if (scene.emitters.has_environment()) pdf[i] = scene.emitters.environment_pdf(w.rays.direction(i));
      continue;
    }
    SurfacePoint point;
    const Vec3 p = scene.surfaces.at(w.hits, i, w.rays, point);
    const int emitter = scene.surfaces.emitter(w.hits.shape[i]);
    if (emitter >= 0 && point.ns.dot(point.wi) > 0)
      pdf[i] = scene.emitters.pdf(emitter, from, p, point, w.hits.primitive[i], time);
  }
  return pdf;
}

struct LightCase {
  const char* name;
  std::function<void(SceneBuilder&)> build;
  Vec3 from{0, 0, 0};
  float time = 0;
};
void PrintTo(const LightCase& c, std::ostream* out) { *out << c.name; }

TextureId picture(SceneBuilder& b) {
  auto image = std::make_shared<Image>();
  image->width = 5, image->height = 3, image->channels = 3;
  std::vector<float> pixels;
  for (std::uint32_t i = 0; i < 45; ++i) pixels.push_back(i % 7 == 3 ? 8 : 0.2f * sample_float(9, i));
  image->pixels = pixels;
  BitmapTexture t;
  t.image = image;
  b.scene.textures.push_back(t);
  return static_cast<TextureId>(b.scene.textures.size() - 1);
}
std::shared_ptr<Image> sky(int width, int height) {
  auto image = std::make_shared<Image>();
  image->width = width, image->height = height, image->channels = 3;
  std::vector<float> pixels;
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(3 * width * height); ++i)
    pixels.push_back(0.1f + sample_float(5, i) * (i / 3 == 20 ? 30 : 1));
  image->pixels = pixels;
  return image;
}
Matrix4 tilted() {
  Matrix4 m;
  m.setEulerAngles(Vec3(0.4f, -0.3f, 0.9f));
  return m;
}

std::vector<LightCase> flat_lights() {
  return {
      {"rectangle",
       [](SceneBuilder& b) {
         b.light(make_rectangle(facing({0.5f, 0, 2}, {0.2f, 0.1f, -1}, 1.5f)), Color(1.0f));
       }},
      {"rectangle_behind",
       [](SceneBuilder& b) {
         b.light(make_rectangle(facing({0, 0, 2}, {0, 0, 1}, 1)), Color(1.0f));
       }},
      {"rectangle_flipped",
       [](SceneBuilder& b) {
         b.light(make_rectangle(facing({0, 0, 2}, {0, 0, 1}, 1), true), Color(1.0f));
       }},
      {"rectangle_textured",
       [](SceneBuilder& b) {
         b.light(make_rectangle(facing({0, 0, 1}, {0, 0, -1}, 1)), b.diffuse(Color(0.0f)), picture(b));
       }},
      {"mesh",
       [](SceneBuilder& b) {
         b.light(SceneBuilder::grid(3, facing({0, 1, 2}, {0, -0.3f, -1}, 1)), Color(1.0f));
       }},
      {"mesh_textured",
       [](SceneBuilder& b) {
         b.light(SceneBuilder::grid(4, facing({0, 0, 1}, {0, 0, -1}, 1)), b.diffuse(Color(0.0f)), picture(b));
       }},
  };
}
std::vector<LightCase> curved_lights() {
  return {
      {"disk",
       [](SceneBuilder& b) {
         const Matrix4 m = scale({1.5f, 0.7f, 1}) * facing({0.3f, 0, 2}, {0, 0, -1}, 1);
         b.light(Disk{{m, m}, false}, Color(1.0f));
       }},
      {"sphere",
       [](SceneBuilder& b) {
         b.light(make_sphere({1, 1, 2}, 1.2f), Color(1.0f));
       }},
      {"sphere_far",
       [](SceneBuilder& b) {
         b.light(make_sphere({0, 0, 30}, 0.5f), Color(1.0f));
       }},
      {"sphere_inside",
       [](SceneBuilder& b) {
         b.light(make_sphere({0.3f, 0.2f, 0}, 1, true), Color(1.0f));
       }},
      {"cylinder",
       [](SceneBuilder& b) {
         const Matrix4 m = scale({0.5f, 0.5f, 2}) * tilted() * translate({1, -1, 1});
         b.light(Cylinder{{m, m}, false}, Color(1.0f));
       }},
  };
}
std::vector<LightCase> environments_and_many() {
  return {
      {"envmap",
       [](SceneBuilder& b) {
         b.emitter(EnvmapEmitter{sky(16, 8), 2, tilted()});
       }},
      {"constant", [](SceneBuilder& b) { b.emitter(ConstantEmitter{Color(1.0f)}); }},
      {"many",
       [](SceneBuilder& b) {
         b.light(make_rectangle(facing({0, 0, 2}, {0, 0, -1}, 1)), Color(1.0f));
         b.light(make_sphere({0, 3, 0}, 1), Color(1.0f));
         b.emitter(ConstantEmitter{Color(0.5f)});
         b.scene.emitters[0].sampling_weight = 3;
         b.scene.emitters[1].sampling_weight = 0.5f;
       }},
  };
}
std::vector<LightCase> moving_lights() {
  return {
      {"moving_rectangle",
       [](SceneBuilder& b) {
         b.light(Rectangle{{facing({-3, 0, 2}, {0, 0, -1}, 1), facing({1, 0, 2}, {0, 0, -1}, 1.5f)}, false},
                 Color(1.0f));
       },
       {0, 0, 0},
       0.7f},
      {"moving_mesh",
       [](SceneBuilder& b) {
         Mesh mesh = SceneBuilder::grid(3, facing({-3, 0, 2}, {0, 0, -1}, 1));
         mesh.positions_end = SceneBuilder::grid(3, facing({1, 0, 2}, {0, 0, -1}, 2)).positions;
         b.light(mesh, Color(1.0f));
       },
       {0, 0, 0},
       0.3f},
      {"moving_sphere",
       [](SceneBuilder& b) {
         Sphere s = make_sphere({-3, 0, 2}, 1);
         s.center[1] = {3, 0, 2};
         s.radius[1] = 0.5f;
         b.light(s, Color(1.0f));
       },
       {0, 0, 0},
       0.6f},
  };
}
std::vector<LightCase> light_cases() {
  std::vector<LightCase> cases;
  for (const auto& some : {flat_lights(), curved_lights(), environments_and_many(), moving_lights()})
    cases.insert(cases.end(), some.begin(), some.end());
  return cases;
}

class Lights : public ::testing::TestWithParam<LightCase> {};

TEST_P(Lights, DensityOfASampleIsWhatTheLightSaysOfItsDirection) {
  SceneBuilder b;
  GetParam().build(b);
  const CompiledScene scene(std::move(b.scene));
  const Vec3 from = GetParam().from;
  const float time = GetParam().time;
  const std::size_t n = 1000;
  Workspace w;
  w.resize(n);
  std::vector<float> expected;
  for (std::uint32_t i = 0; expected.size() < n && i < 4 * n; ++i) {
    EmitterSample s;
    if (!scene.emitters.sample(from, sample_float(1, 3 * i), {sample_float(1, 3 * i + 1), sample_float(1, 3 * i + 2)},
                               time, s))
      continue;
    EXPECT_NEAR(s.wo.length(), 1, 1e-5f);
    EXPECT_FALSE(s.delta);
    w.rays.set(expected.size(), from, s.wo, 1e9f, time);
    expected.push_back(s.pdf);
  }
  const auto found = densities(scene, w, expected.size(), from, time);
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) wrong += !(std::fabs(found[i] - expected[i]) < 2e-3f * expected[i]);
  EXPECT_LE(wrong, expected.size() / 50) << "of " << expected.size() << "; a few rays miss an edge or graze";
}

// 4,000 samples over 12 x 24 bins; each test fails by chance once in 1,000,000 runs.
TEST_P(Lights, DirectionsFollowTheirDensity) {
  SceneBuilder b;
  GetParam().build(b);
  if (std::string_view(GetParam().name) == "sphere_far") GTEST_SKIP() << "smaller than the bins resolve";
  const CompiledScene scene(std::move(b.scene));
  const Vec3 from = GetParam().from;
  const float time = GetParam().time;
  constexpr int kRows = 12, kColumns = 24, kBins = kRows * kColumns, kFine = 64;
  constexpr std::uint32_t kSamples = 4000;

  std::vector<double> expected(kBins), counts(kBins);
  Workspace w;
  w.resize(kFine * kFine);
  for (int bin = 0; bin < kBins; ++bin) {
    for (int k = 0; k < kFine * kFine; ++k) {
      const float u = (bin % kColumns + (k % kFine + 0.5f) / kFine) / kColumns;
      const float v = (bin / kColumns + (k / kFine + 0.5f) / kFine) / kRows;
      w.rays.set(static_cast<std::size_t>(k), from, sample_sphere({u, v}), 1e9f, time);
    }
    double sum = 0;
    for (const float pdf : densities(scene, w, kFine * kFine, from, time)) sum += pdf;
    expected[bin] = sum / (kFine * kFine) * 4 * kPi / kBins * kSamples;
  }
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    EmitterSample s;
    if (!scene.emitters.sample(from, sample_float(2, 3 * i), {sample_float(2, 3 * i + 1), sample_float(2, 3 * i + 2)},
                               time, s))
      continue;
    const float phi = std::atan2(s.wo.y, s.wo.x) / (2 * kPi);
    const int column = std::min(kColumns - 1, static_cast<int>((phi < 0 ? phi + 1 : phi) * kColumns));
    const int row = std::min(kRows - 1, static_cast<int>((1 - s.wo.z) / 2 * kRows));
    counts[row * kColumns + column] += 1;
  }
  double chi2 = 0, pooled_expected = 0, pooled_count = 0;
  int dof = 0;
  const auto add = [&](double count, double mean) { chi2 += (count - mean) * (count - mean) / mean, ++dof; };
  for (int bin = 0; bin < kBins; ++bin) {
    if (expected[bin] < 8) {
      pooled_expected += expected[bin], pooled_count += counts[bin];
      continue;
    }
    add(counts[bin], expected[bin]);
  }
  if (pooled_expected > 8)
    add(pooled_count, pooled_expected);
  else
    EXPECT_LE(pooled_count, 40) << "samples where the density is next to 0";
  if (dof == 0) return;
  const double p = boost::math::cdf(boost::math::complement(boost::math::chi_squared(dof), chi2));
  EXPECT_GT(p, 1e-6) << "chi2 " << chi2 << " at " << dof << " degrees of freedom";
}

INSTANTIATE_TEST_SUITE_P(, Lights, ::testing::ValuesIn(light_cases()),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(Emitters, RectangleBehindTheReferencePointGivesNothing) {
  SceneBuilder b;
  b.light(make_rectangle(facing({0, 0, 2}, {0, 0, 1}, 1)), Color(1.0f));
  const CompiledScene scene(std::move(b.scene));
  EmitterSample s;
  EXPECT_FALSE(scene.emitters.sample(Vec3(0), 0.5f, {0.3f, 0.4f}, 0, s));
}

TEST(Emitters, DeltaLightsGiveTheirClosedForms) {
  const Vec3 from(1, 2, 3);
  const auto sample = [&](auto model) {
    SceneBuilder b;
    b.emitter(model);
    const CompiledScene scene(std::move(b.scene));
    EmitterSample s;
    EXPECT_TRUE(scene.emitters.sample(from, 0.5f, {0.5f, 0.5f}, 0, s));
    EXPECT_TRUE(s.delta);
    EXPECT_FLOAT_EQ(s.pdf, 1);
    return s;
  };
  const auto point = sample(PointEmitter{{1, 2, 7}, Color(8.0f, 4.0f, 2.0f)});
  EXPECT_NEAR((point.wo - Vec3(0, 0, 1)).length(), 0, 1e-6f);
  EXPECT_FLOAT_EQ(point.distance, 4);
  EXPECT_FLOAT_EQ(point.weight.x, 0.5f);
  const auto sun = sample(DirectionalEmitter{{0, -1, 0}, Color(3.0f)});
  EXPECT_NEAR((sun.wo - Vec3(0, 1, 0)).length(), 0, 1e-6f);
  EXPECT_TRUE(std::isinf(sun.distance));
  EXPECT_FLOAT_EQ(sun.weight.x, 3);
  // A spot at the origin of a frame whose z points at an angle to the reference point.
  const auto spot = [&](float degrees) {
    const Vec3 position(1, 2, 0), forward(std::sin(degrees * kPi / 180), 0, std::cos(degrees * kPi / 180));
    return sample(SpotEmitter{testing::look_at(position, position + forward, {0, 1, 0}), Color(9.0f), -1, 20, 10});
  };
  EXPECT_NEAR(spot(0).weight.x, 1, 1e-5f);
  EXPECT_NEAR(spot(9.9f).weight.x, 1, 1e-5f);
  EXPECT_NEAR(spot(15).weight.x, 0.5f, 1e-4f);
  EXPECT_NEAR(spot(21).weight.x, 0, 1e-6f);
}

TEST(Emitters, EnvironmentImageHasMitsubasOrientation) {
  auto image = std::make_shared<Image>();
  image->width = 8, image->height = 5, image->channels = 3;
  std::vector<float> pixels(8 * 5 * 3);
  for (int y = 0; y < 5; ++y)
    for (int x = 0; x < 8; ++x) pixels[3 * (y * 8 + x)] = 10.0f * y + x;
  image->pixels = pixels;
  EnvmapEmitter e;
  e.image = image;
  const Environment env(e);
  EXPECT_NEAR(env.radiance({0, 1, 0}).x, 0 + 3.5f, 4) << "the top row is +y";
  // Column x stands at azimuth (x + 1/2) / 8 of a turn that starts at -z and goes over +x.
  for (int x = 0; x < 8; ++x) {
    const float phi = (x + 0.5f) / 8 * 2 * kPi;
    EXPECT_NEAR(env.radiance({std::sin(phi), 0, -std::cos(phi)}).x, 20 + x, 1e-3f);
  }
}

TEST(Emitters, TwoEnvironmentsAreAnError) {
  SceneBuilder b;
  b.emitter(ConstantEmitter{Color(1.0f)});
  b.emitter(ConstantEmitter{Color(1.0f)});
  EXPECT_THROW(CompiledScene scene(std::move(b.scene)), SceneError);
}

}  // namespace
}  // namespace warpath
