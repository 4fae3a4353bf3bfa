#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tracer/material.h"
#include "tracer/scatter.h"

namespace warpath {
namespace {

// Agreement with Mitsuba 3 on every BSDF and texture: tests/mitsuba/bsdf_values.py writes what is compared here.

using Json = nlohmann::json;

const std::filesystem::path kData = std::filesystem::path(WARPATH_SOURCE_DIR) / "tests" / "data";

const Json& data() {
  static const Json json = Json::parse(std::ifstream(kData / "bsdf_values.json"));
  return json;
}

Vec3 vector(const Json& j, std::size_t first = 0) { return {j.at(first), j.at(first + 1), j.at(first + 2)}; }

/// The file rounds to five digits, and both sides compute in float.
void expect_near(float ours, float theirs, float scale, const std::string& where) {
  EXPECT_NEAR(ours, theirs, 1e-3f * scale + 2e-5f) << where;
}

void compare(const Json& c) {
  const std::string name = c["name"];
  // Beside the images that it names.
  const auto file = kData / ("bsdf_values." + std::to_string(::getpid()) + ".xml");
  std::ofstream(file) << c["xml"].get<std::string>();
  Scene scene;
  try {
    scene = load_scene(file);
  } catch (const std::exception& e) {
    std::filesystem::remove(file);
    FAIL() << name << ": " << e.what();
  }
  std::filesystem::remove(file);
  ASSERT_EQ(scene.shapes.size(), 1u);
  const Materials materials(scene);
  const BsdfId bsdf = scene.shapes[0].bsdf;

  for (std::size_t k = 0; k < data()["wi"].size(); ++k) {
    SurfacePoint point;
    point.ng = point.ns = {0, 0, 1};
    point.dp_du = {1, 0, 0};
    point.dp_dv = {0, 1, 0};
    point.dn_du = point.dn_dv = Vec3(0.0f);
    point.wi = vector(data()["wi"][k]);
    point.uv = {data()["uv"][k][0], data()["uv"][k][1]};
    Scatter scatter;
    materials.at(bsdf, point, scatter);
    // Mitsuba's frame here; ours depends on the normal alone.
    scatter.frame = {{1, 0, 0}, {0, 1, 0}, scatter.frame.n};

    const Json& expected = c["points"][k];
    for (std::size_t i = 0; i < expected["eval"].size(); ++i) {
      const Json& e = expected["eval"][i];
      const std::string where = name + ", wi " + std::to_string(k) + ", wo " + std::to_string(i);
      float pdf;
      const Color value = eval_pdf_bsdf(scatter, vector(data()["wo"][k][i]), pdf);
      const Vec3 theirs = vector(e);
      const float scale = std::max({theirs.x, theirs.y, theirs.z});
      for (int channel = 0; channel < 3; ++channel) expect_near(value[channel], theirs[channel], scale, where);
      // Where there is no light the density matters to nobody; Mitsuba's principled leaves some there.
      if (scale > 0) expect_near(pdf, e[3], e[3], where + " pdf");
    }

    bool own_frame = false;  // isotropic lobes under a map, whose frame depends on the normal alone
    for (int i = 0; i < scatter.perturbed_count; ++i) own_frame |= !scatter.perturbed[i].follows_tangent;
    if (own_frame) continue;
    // There Mitsuba 3.9 draws normals from a wider distribution than it weights them by.
    const bool biased = name.starts_with("roughdielectric") && name.ends_with(" all");
    for (std::size_t i = 0; i < expected["samples"].size(); ++i) {
      const Json& e = expected["samples"][i];
      const Json& u = data()["lobe_dir"][i];
      const std::string where = name + ", wi " + std::to_string(k) + ", sample " + std::to_string(i);
      const BsdfSample s = sample_bsdf(scatter, u[0], {u[1], u[2]});
      const Vec3 weight = vector(e, 3);
      const float scale = std::max({weight.x, weight.y, weight.z});
      if (scale == 0) {
        EXPECT_EQ(max_component(s.weight), 0) << where;
        continue;
      }
      for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(s.wo[axis], vector(e)[axis], 2e-4f) << where;
      if (!biased)
        for (int channel = 0; channel < 3; ++channel)
          expect_near(s.weight[channel], weight[channel], scale, where + " weight");
      expect_near(s.pdf, e[6], 4 * e[6].get<float>(), where + " pdf");  // it varies fast where it is sharp
      EXPECT_NEAR(s.eta, e[7].get<float>(), 6e-5f) << where;
      EXPECT_EQ(s.delta, e[8].get<float>() != 0) << where;
    }
  }
}

TEST(Mitsuba, AgreesOnBsdfsAndTextures) {
  ASSERT_GT(data()["cases"].size(), 70u);
  for (const Json& c : data()["cases"]) compare(c);
}

}  // namespace
}  // namespace warpath
