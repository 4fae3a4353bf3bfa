#include "tracer/material.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tracer/bsdf_test_cases.h"
#include "tracer/rough_transmittance.h"
#include "tracer/scatter.h"
#include "warpath/error.h"

namespace warpath {
namespace {

using test::BsdfBuilder;

Scatter resolve(const BsdfBuilder& b, BsdfId id, const Vec3& local_wi = {0.6f, 0, 0.8f}) {
  static std::vector<std::unique_ptr<Materials>> kept;  // scatters point into them
  kept.push_back(std::make_unique<Materials>(b.scene));
  Scatter s;
  kept.back()->at(id, test::test_point(local_wi), s);
  return s;
}

TEST(Materials, BlendsAndMasksBecomeWeightedLobes) {
  BsdfBuilder b;
  const BsdfId blend = b.add(BlendBsdf{b.diffuse(), b.mirror(), b.value(0.25f)});
  const Scatter s = resolve(b, b.add(Mask{blend, b.value(0.8f)}));
  ASSERT_EQ(s.lobe_count, 3);
  EXPECT_NEAR(s.lobes[0].weight, 0.2f, 1e-6f);  // the blend's second comes first
  EXPECT_NEAR(s.lobes[1].weight, 0.6f, 1e-6f);
  EXPECT_NEAR(s.lobes[2].weight, 0.2f, 1e-6f);
  EXPECT_TRUE(sample_bsdf(s, 0.1f, {0.5f, 0.5f}).delta);
  EXPECT_FALSE(sample_bsdf(s, 0.5f, {0.5f, 0.5f}).delta);
  EXPECT_TRUE(sample_bsdf(s, 0.9f, {0.5f, 0.5f}).null);
}

TEST(Materials, LobesWithoutWeightAreLeftOut) {
  BsdfBuilder b;
  const Scatter opaque = resolve(b, b.add(Mask{b.diffuse(), b.value(1.5f)}));
  EXPECT_EQ(opaque.lobe_count, 1);
  EXPECT_EQ(kind(opaque), SurfaceKind::diffuse);
  const Scatter clear = resolve(b, b.add(Mask{b.diffuse(), b.value(0)}));
  EXPECT_EQ(clear.lobe_count, 1);
  EXPECT_EQ(kind(clear), SurfaceKind::null);
}

// A mirror in a blend keeps its own probability, so that the blend's albedo is the blend of the albedos.
TEST(Materials, DeltaLobeInABlendIsUnbiased) {
  BsdfBuilder b;
  const Scatter s = resolve(b, b.add(BlendBsdf{b.diffuse(0.2f, 0.2f, 0.2f), b.mirror(), b.value(0.4f)}));
  double sum = 0;
  constexpr int kSteps = 1000;
  for (int i = 0; i < kSteps; ++i) sum += sample_bsdf(s, (i + 0.5f) / kSteps, {0.3f, 0.7f}).weight.x;
  EXPECT_NEAR(sum / kSteps, 0.4 * 1 + 0.6 * 0.2, 1e-3);
}

TEST(Materials, TwoSidedTurnsItsFrameTowardsWi) {
  BsdfBuilder b;
  const BsdfId sided = b.add(TwoSided{b.diffuse(), -1}), masked = b.add(Mask{sided, b.value(0.5f)});
  for (const BsdfId id : {sided, masked}) {
    const Scatter front = resolve(b, id), back = resolve(b, id, {0.6f, 0, -0.8f});
    EXPECT_GT(front.frame.n.dot(front.wi), 0);
    EXPECT_GT(back.frame.n.dot(back.wi), 0);
    float pdf;
    EXPECT_GT(eval_pdf_bsdf(back, back.wi, pdf).x, 0);
  }
  const Scatter back = resolve(b, b.diffuse(), {0.6f, 0, -0.8f});
  float pdf;
  EXPECT_EQ(eval_pdf_bsdf(back, back.wi, pdf).x, 0);
  EXPECT_EQ(pdf, 0);
}

TEST(Materials, KindsAndRoughness) {
  BsdfBuilder b;
  const auto ggx = MicrofacetType::ggx;
  const BsdfId diffuse = b.diffuse(), mirror = b.mirror(), glossy = b.rough_conductor(ggx, 0.25f, 0.25f),
               plastic = b.plastic(), glass = b.dielectric(1.5f), none = b.add(Null{}),
               blend = b.add(BlendBsdf{diffuse, mirror, b.value(0.25f)});
  const auto expect = [&](BsdfId id, SurfaceKind k, float r, bool smooth) {
    const Scatter s = resolve(b, id);
    EXPECT_EQ(kind(s), k) << id;
    EXPECT_NEAR(roughness(s), r, 1e-6f) << id;
    EXPECT_EQ(is_smooth(s), smooth) << id;
  };
  expect(diffuse, SurfaceKind::diffuse, 1, true);
  expect(mirror, SurfaceKind::delta, 0, false);
  expect(glossy, SurfaceKind::glossy, 0.5f, true);
  expect(plastic, SurfaceKind::mixed, 0.5f, true);
  expect(glass, SurfaceKind::delta, 0, false);
  expect(none, SurfaceKind::null, 0, false);
  expect(blend, SurfaceKind::mixed, 0.75f, true);
}

TEST(Materials, TangentsAndCoordinatesOnlyWhereNeeded) {
  BsdfBuilder b;
  const auto ggx = MicrofacetType::ggx;
  const TextureId board = b.texture(CheckerboardTexture{});
  const BsdfId plain = b.add(TwoSided{b.rough_conductor(ggx, 0.2f, 0.2f), -1});
  const BsdfId brushed = b.add(Mask{b.rough_conductor(ggx, 0.2f, 0.3f), b.value(0.5f)});
  const BsdfId mapped = b.add(NormalMap{b.diffuse(), b.normal_map(), true, true});
  const BsdfId textured = b.add(BlendBsdf{b.diffuse(), b.mirror(), board});
  const Materials m(b.scene);
  EXPECT_FALSE(m.needs_tangents(plain));
  EXPECT_TRUE(m.needs_tangents(brushed));
  EXPECT_TRUE(m.needs_tangents(mapped));
  EXPECT_FALSE(m.needs_tangents(textured));
  EXPECT_TRUE(m.needs_uv(textured));
  EXPECT_FALSE(m.needs_uv(plain));
}

TEST(Materials, TooDeepNestsAreRefusedByName) {
  BsdfBuilder b;
  b.scene.file = "kitchen.xml";
  BsdfId id = b.diffuse();
  for (int i = 0; i < 8; ++i) id = b.add(BlendBsdf{id, b.mirror(), b.value(0.5f)});
  b.scene.bsdfs.back().id = "onion";
  try {
    const Materials m(b.scene);
    FAIL() << "no error";
  } catch (const SceneError& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr("kitchen.xml: bsdf \"bsdf10\" nests too much: 6 lobes"));
  }
}

TEST(Materials, NestsThatContainThemselvesAreRefused) {
  BsdfBuilder b;
  b.add(Mask{0, b.value(0.5f)});
  EXPECT_THROW(Materials{b.scene}, SceneError);
}

TEST(RoughTransmittance, IsAShareAndFallsTowardsGrazing) {
  for (const auto type : {MicrofacetType::ggx, MicrofacetType::beckmann}) {
    for (const float alpha : {0.01f, 0.2f, 0.8f}) {
      const RoughInterface r = make_rough_interface(type, alpha, 1.5f);
      // Of a smooth surface 0.596 and 0.96; shadowing takes from both.
      EXPECT_LT(r.internal_reflectance, 0.6f);
      EXPECT_GT(r.internal_reflectance, alpha < 0.1f ? 0.58f : 0.15f);
      EXPECT_NEAR(r.external_transmittance(1), 0.96f, alpha < 0.1f ? 1e-3f : 0.06f);
      for (int i = 0; i <= 100; ++i) {
        const float t = r.external_transmittance(i / 100.0f);
        EXPECT_TRUE(t >= 0 && t <= 0.961f) << t;
      }
      EXPECT_LT(r.external_transmittance(0.02f), r.external_transmittance(0.5f));
    }
  }
}

}  // namespace
}  // namespace warpath
