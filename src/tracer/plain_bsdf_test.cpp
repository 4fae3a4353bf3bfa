#include "tracer/plain_bsdf.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/rng.h"
#include "tracer/bsdf_test_cases.h"
#include "tracer/sampling.h"
#include "tracer/scatter.h"
#include "tracer/simd_targets.h"
#include "tracer/workspace.h"

namespace warpath {
namespace {

constexpr std::size_t kCount = 3001;
constexpr Color kReflectance{0.1f, 0.4f, 0.7f};

/// Plain BSDFs of every kind; all have kReflectance.
std::vector<test::BsdfCase> plain_cases(test::BsdfBuilder& b) {
  std::vector<test::BsdfCase> cases;
  const auto add = [&](const char* name, BsdfId id) {
    cases.push_back({name, id});
    cases.push_back({std::string("twosided ") + name, b.add(TwoSided{id, id})});
  };
  add("diffuse", b.diffuse(kReflectance.x, kReflectance.y, kReflectance.z));
  const TextureId reflectance = b.color(kReflectance.x, kReflectance.y, kReflectance.z), grey = b.value(0.6f);
  for (const auto d : {MicrofacetType::ggx, MicrofacetType::beckmann}) {
    add(d == MicrofacetType::ggx ? "ggx" : "beckmann",
        b.add(RoughPlastic{d, 0.1f, true, 1.5f, reflectance, grey, true}));
    add("wide", b.add(RoughPlastic{d, 0.6f, true, 1.9f, reflectance, grey, false}));
  }
  return cases;
}

/// Vertices with all kinds of directions, their numbers, and directions of light.
struct Vertices {
  Vertices() {
    const auto floats = [&] { return memory.emplace_back(kCount + Arena::kPad).data(); };
    const auto vectors = [&] { return Vec3Array{floats(), floats(), floats()}; };
    memory.reserve(64);
    plain = {vectors(), vectors(), vectors()};
    wo = vectors(), value = vectors(), made = vectors();
    lobe = floats(), u = floats(), v = floats(), pdf = floats();
    for (std::size_t k = 0; k < kCount; ++k) {
      const std::uint64_t key = sample_key(11, k);
      const auto number = [&](std::uint32_t d) { return sample_float(key, d); };
      // Every fifth normal is an axis, one of them the pole of the frame.
      Vec3 normal = sample_sphere({number(0), number(1)});
      if (k % 5 == 0) normal = k % 10 == 0 ? Vec3(-0.36f, -0.48f, -0.8f) : Vec3(0, 0, 1);
      plain.normal.set(k, normal);
      plain.wi.set(k, sample_sphere({number(2), number(3)}));
      plain.reflectance.set(k, {kReflectance.x, kReflectance.y, kReflectance.z});
      wo.set(k, sample_sphere({number(4), number(5)}));
      lobe[k] = number(6), u[k] = number(7), v[k] = number(8);
    }
  }
  std::vector<std::vector<float>> memory;
  PlainVertices plain;
  Vec3Array wo, value, made;
  float *lobe, *u, *v, *pdf;
};

Scatter resolve(const Materials& materials, BsdfId id, const Vertices& w, std::size_t k) {
  SurfacePoint point;
  point.ns = point.ng = w.plain.normal[k];
  point.wi = w.plain.wi[k];
  Scatter scatter;
  materials.at(id, point, scatter);
  return scatter;
}

/// Relative to what rounding of the half vector does to a lobe of alpha 0.1.
void expect_near(float a, float b) { EXPECT_NEAR(a, b, 1e-4f * std::max(std::abs(a), std::abs(b)) + 1e-6f); }

/// Calls check(plain, vertices, resolve), where resolve(k) is the BSDF at vertex k, for every plain one and SIMD
/// target.
template <class Check>
void on_every_plain_bsdf(const Check& check) {
  test::BsdfBuilder builder;
  const auto cases = plain_cases(builder);
  const Materials materials(builder.scene);
  testing::on_every_simd_target([&] {
    for (const auto& bsdf : cases) {
      SCOPED_TRACE(bsdf.name);
      const PlainBsdf* plain = materials.plain(bsdf.id);
      ASSERT_NE(plain, nullptr);
      Vertices w;
      check(*plain, w, [&](std::size_t k) { return resolve(materials, bsdf.id, w, k); });
    }
  });
}

TEST(PlainBsdf, EvaluatesAsTheBsdfDoes) {
  on_every_plain_bsdf([](const PlainBsdf& plain, Vertices& w, const auto& bsdf_at) {
    eval_plain(plain, w.plain, 0, kCount, w.wo, w.value, w.pdf);
    int lit = 0;
    for (std::size_t k = 0; k < kCount && !HasFailure(); ++k) {
      float pdf;
      const Color value = eval_pdf_bsdf(bsdf_at(k), w.wo[k], pdf);
      for (int c = 0; c < 3; ++c) expect_near(w.value[k][c], value[c]);
      expect_near(w.pdf[k], pdf);
      lit += pdf > 0;
    }
    EXPECT_GT(lit, 600);
  });
}

TEST(PlainBsdf, SamplesAsTheBsdfDoes) {
  on_every_plain_bsdf([](const PlainBsdf& plain, Vertices& w, const auto& bsdf_at) {
    sample_plain(plain, w.plain, 0, kCount, w.lobe, w.u, w.v, w.made, w.value, w.pdf);
    int made = 0;
    for (std::size_t k = 0; k < kCount && !HasFailure(); ++k) {
      const Scatter scatter = bsdf_at(k);
      const BsdfSample s = sample_bsdf(scatter, w.lobe[k], {w.u[k], w.v[k]});
      if (s.pdf == 0 || w.pdf[k] == 0) {  // a direction in the surface may be on either side
        EXPECT_LT(std::abs(s.pdf - w.pdf[k]), 1e-4f);
        continue;
      }
      EXPECT_LT((s.wo - w.made[k]).length(), 2e-5f);
      // Of the direction that it made: a narrow lobe changes much from one to the other.
      float pdf;
      const Color value = eval_pdf_bsdf(scatter, w.made[k], pdf);
      expect_near(w.pdf[k], pdf);
      for (int c = 0; c < 3; ++c) expect_near(w.value[k][c], value[c] / pdf);
      ++made;
    }
    EXPECT_GT(made, 1000);
  });
}

TEST(PlainBsdf, GuidesAsTheBsdfDoes) {
  test::BsdfBuilder builder;
  const auto cases = plain_cases(builder);
  const Materials materials(builder.scene);
  const Vertices w;
  for (const auto& bsdf : cases) {
    SCOPED_TRACE(bsdf.name);
    const PlainBsdf& plain = *materials.plain(bsdf.id);
    const Scatter scatter = resolve(materials, bsdf.id, w, 1);
    EXPECT_EQ(plain_roughness(plain), roughness(scatter));
    EXPECT_EQ(plain_kind(plain), kind(scatter));
    const Color a = albedo(scatter), b = plain_albedo(plain, w.plain.wi[1].dot(w.plain.normal[1]), kReflectance);
    for (int c = 0; c < 3; ++c) expect_near(a[c], b[c]);
  }
}

TEST(PlainBsdf, NothingElseIsPlain) {
  test::BsdfBuilder b;
  const BsdfId diffuse = b.diffuse(), glossy = b.rough_conductor(MicrofacetType::ggx, 0.3f, 0.3f);
  Image image{1, 1, 1, false, std::vector<std::uint8_t>{200}};
  const TextureId picture =
      b.texture(BitmapTexture{.image = std::make_shared<const Image>(std::move(image)), .to_uv = {}});
  const std::vector<BsdfId> others = {
      glossy,
      b.plastic(),
      b.add(Mask{diffuse, b.value(0.5f)}),
      b.add(TwoSided{diffuse, glossy}),
      b.add(TwoSided{diffuse, b.diffuse()}),
      b.add(NormalMap{diffuse, b.normal_map(), true, true}),
      b.rough_plastic(MicrofacetType::ggx, 0.2f, false),
      b.add(RoughPlastic{MicrofacetType::ggx, 0.2f, true, 1.5f, b.value(0.5f), picture, true}),
  };
  const Materials materials(b.scene);
  for (const BsdfId id : others) EXPECT_EQ(materials.plain(id), nullptr) << id;
  EXPECT_NE(materials.plain(diffuse), nullptr);
}

}  // namespace
}  // namespace warpath
