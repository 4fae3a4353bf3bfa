// BSDFs, spectra and textures of scene files.
#include <OpenImageIO/imageio.h>

#include "scene/scene_fixture.h"

namespace warpath {
namespace {

using MaterialTest = SceneTest;

// ---- BSDFs --------------------------------------------------------------------------------------------------------

TEST_F(MaterialTest, BsdfDefaultsAreMitsubas) {
  expect_color(constant(bsdf<Diffuse>("<bsdf type=\"diffuse\"/>").reflectance), 0.5f, 0.5f, 0.5f);
  const auto mirror = bsdf<Conductor>("<bsdf type=\"conductor\"/>");
  expect_color(mirror.eta, 0, 0, 0);
  expect_color(mirror.k, 1, 1, 1);
  EXPECT_FLOAT_EQ(bsdf<Dielectric>("<bsdf type=\"dielectric\"/>").eta, 1.5046f / 1.000277f);
  EXPECT_FLOAT_EQ(bsdf<ThinDielectric>("<bsdf type=\"thindielectric\"/>").eta, 1.5046f / 1.000277f);
  EXPECT_FLOAT_EQ(bsdf<Plastic>("<bsdf type=\"plastic\"/>").eta, 1.49f / 1.000277f);
  const auto plastic = bsdf<RoughPlastic>("<bsdf type=\"roughplastic\"/>");
  EXPECT_EQ(plastic.distribution, MicrofacetType::beckmann);
  EXPECT_FLOAT_EQ(plastic.alpha, 0.1f);
  EXPECT_TRUE(plastic.sample_visible);
  EXPECT_FALSE(plastic.nonlinear);
  expect_color(constant(plastic.diffuse_reflectance), 0.5f, 0.5f, 0.5f);
  const auto metal = bsdf<RoughConductor>("<bsdf type=\"roughconductor\"/>");
  EXPECT_EQ(metal.alpha_u, metal.alpha_v);
  expect_color(constant(metal.alpha_u), 0.1f, 0.1f, 0.1f);
  expect_color(metal.k, 1, 1, 1);
}

TEST_F(MaterialTest, IndicesOfRefraction) {
  EXPECT_FLOAT_EQ(bsdf<Dielectric>(R"(<bsdf type="dielectric"><string name="int_ior" value="Diamond"/>
    <float name="ext_ior" value="1"/></bsdf>)")
                      .eta,
                  2.419f);
  EXPECT_FLOAT_EQ(bsdf<Plastic>(R"(<bsdf type="plastic"><integer name="int_ior" value="2"/>
    <string name="ext_ior" value="vacuum"/></bsdf>)")
                      .eta,
                  2);
  EXPECT_EQ(error("<bsdf type=\"dielectric\"><string name=\"int_ior\" value=\"diamant\"/></bsdf>"),
            "s.xml:3:25: no index of refraction is known for \"diamant\"; did you mean \"diamond\"?");
  EXPECT_EQ(error("<bsdf type=\"dielectric\"><float name=\"ext_ior\" value=\"0\"/></bsdf>"),
            "s.xml:3:25: \"ext_ior\" must be greater than 0, not 0");
}

TEST_F(MaterialTest, NamedMetalsAreMitsubas) {
  // eta and k of `conductor` in Mitsuba 3.9.1, scalar_rgb.
  const auto gold =
      bsdf<RoughConductor>("<bsdf type=\"roughconductor\"><string name=\"material\" value=\"Au\"/></bsdf>");
  expect_color(gold.eta, 0.143036f, 0.3753071f, 1.4420453f);
  expect_color(gold.k, 3.982997f, 2.3855565f, 1.6033592f);
  EXPECT_EQ(error("<bsdf type=\"conductor\"><string name=\"material\" value=\"au\"/></bsdf>"),
            "s.xml:3:24: unknown material \"au\"; did you mean \"Au\"?");
  EXPECT_EQ(
      error(
          "<bsdf type=\"conductor\"><string name=\"material\" value=\"Au\"/><float name=\"eta\" value=\"1\"/></bsdf>"),
      "s.xml:3:24: give either a \"material\" or \"eta\" and \"k\", not both");
}

TEST_F(MaterialTest, AnisotropicRoughness) {
  const auto metal = bsdf<RoughConductor>(R"(<bsdf type="roughconductor"><float name="alpha_u" value="0.2"/>
    <float name="alpha_v" value="0.3"/><string name="distribution" value="GGX"/></bsdf>)");
  EXPECT_EQ(metal.distribution, MicrofacetType::ggx);
  EXPECT_FLOAT_EQ(constant(metal.alpha_u).x, 0.2f);
  EXPECT_FLOAT_EQ(constant(metal.alpha_v).x, 0.3f);
  EXPECT_EQ(error("<bsdf type=\"roughconductor\"><float name=\"alpha_u\" value=\"0.2\"/></bsdf>"),
            "s.xml:3:29: \"alpha_u\" and \"alpha_v\" must be given together");
  EXPECT_EQ(error("<bsdf type=\"roughplastic\"><string name=\"distribution\" value=\"ggk\"/></bsdf>"),
            "s.xml:3:27: unknown distribution \"ggk\"; did you mean \"ggx\"?");
}

TEST_F(MaterialTest, PrincipledIndexOfRefraction) {
  // Mitsuba: eta = 2 / (1 - sqrt(0.08 specular)) - 1
  EXPECT_FLOAT_EQ(bsdf<Principled>("<bsdf type=\"principled\"/>").eta, 1.5f);
  EXPECT_NEAR(bsdf<Principled>("<bsdf type=\"principled\"><float name=\"specular\" value=\"0.3\"/></bsdf>").eta,
              1.36664, 1e-5);
  const auto glass = bsdf<Principled>(
      "<bsdf type=\"principled\"><float name=\"eta\" value=\"1\"/><float name=\"spec_trans\" value=\"1\"/><float "
      "name=\"sheen\" value=\"0\"/></bsdf>");
  EXPECT_FLOAT_EQ(glass.eta, 1.001f);
  EXPECT_GE(glass.spec_trans, 0);
  EXPECT_LT(glass.sheen, 0);
  EXPECT_LT(glass.clearcoat, 0);
}

TEST_F(MaterialTest, NestedBsdfsAndTheirLimits) {
  const Scene scene =
      load_with_sensor(R"(<bsdf type="twosided" id="a"><bsdf type="diffuse" id="front"/><bsdf type="plastic"/></bsdf>
    <bsdf type="mask"><ref id="a"/><float name="opacity" value="0.25"/></bsdf>
    <bsdf type="blendbsdf"><ref id="front"/><ref id="a"/><float name="weight" value="0.3"/></bsdf>)");
  ASSERT_EQ(scene.bsdfs.size(), 5u);
  EXPECT_EQ(scene.bsdfs[0].id, "front");
  const auto& twosided = std::get<TwoSided>(scene.bsdfs[2].model);
  EXPECT_EQ(twosided.front, 0);
  EXPECT_EQ(twosided.back, 1);
  EXPECT_EQ(std::get<Mask>(scene.bsdfs[3].model).nested, 2);
  EXPECT_EQ(std::get<BlendBsdf>(scene.bsdfs[4].model).first, 0);
  EXPECT_EQ(std::get<BlendBsdf>(scene.bsdfs[4].model).second, 2);

  EXPECT_EQ(error("<bsdf type=\"twosided\"/>"), "s.xml:3:1: \"twosided\" needs 1 or 2 BSDFs in it, it has 0");
  EXPECT_EQ(error("<bsdf type=\"mask\"><bsdf type=\"null\"/>\n<bsdf type=\"null\"/></bsdf>"),
            "s.xml:4:1: \"mask\" holds 1 BSDF, not 2");
  EXPECT_EQ(error("<bsdf type=\"twosided\"><bsdf type=\"dielectric\"/></bsdf>"),
            "s.xml:3:1: \"twosided\" holds only BSDFs that let no light through (put \"mask\" around it, not into it)");
  EXPECT_EQ(error("<bsdf type=\"blendbsdf\"><bsdf type=\"null\"/><bsdf type=\"diffuse\"/></bsdf>"),
            "s.xml:3:1: \"blendbsdf\" needs a \"weight\"");
  EXPECT_EQ(error("<bsdf type=\"bumpmap\"><bsdf type=\"diffuse\"/></bsdf>"),
            "s.xml:3:1: \"bumpmap\" needs one texture in it, it has 0");
}

TEST_F(MaterialTest, UnknownPluginsAndProperties) {
  EXPECT_EQ(error("  <bsdf type=\"rougplastic\"/>"),
            "s.xml:3:3: unknown bsdf \"rougplastic\"; did you mean \"roughplastic\"?");
  EXPECT_EQ(error("<bsdf type=\"diffuse\">\n <rgb name=\"reflectence\" value=\"1\"/></bsdf>"),
            "s.xml:4:2: bsdf \"diffuse\" has no property \"reflectence\"; did you mean \"reflectance\"?");
  EXPECT_EQ(error("<bsdf type=\"diffuse\"><emitter type=\"area\"/></bsdf>"),
            "s.xml:3:22: emitter \"area\" cannot stand in bsdf \"diffuse\"");
  EXPECT_EQ(error("<shape type=\"spere\"/>"), "s.xml:3:1: unknown shape \"spere\"; did you mean \"sphere\"?");
  EXPECT_EQ(error("<emitter type=\"envmapp\"/>"), "s.xml:3:1: unknown emitter \"envmapp\"; did you mean \"envmap\"?");
  EXPECT_EQ(error("<shape type=\"cube\"><float name=\"radius\" value=\"1\"/></shape>").substr(0, 54),
            "s.xml:3:20: shape \"cube\" has no property \"radius\"; kno");
  EXPECT_EQ(error("<shape type=\"cube\"><medium name=\"interior\" type=\"homogeneous\"/></shape>").substr(0, 60),
            "s.xml:3:20: participating media are not supported yet (<medi");
}

TEST_F(MaterialTest, ReflectancesLieBetweenZeroAndOne) {
  EXPECT_EQ(error("<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"1 1.5 0\"/></bsdf>"),
            "s.xml:3:22: the reflectance (1, 1.5, 0) is not between 0 and 1");
}

// ---- Spectra and textures -----------------------------------------------------------------------------------------

TEST_F(MaterialTest, SpectraAsMitsubaRgb) {
  // Values from Mitsuba 3.9.1, scalar_rgb.
  expect_color(
      constant(
          bsdf<Diffuse>(
              R"(<bsdf type="diffuse"><spectrum name="reflectance" value="400:0.2, 500:0.3, 600:0.5, 700:0.1"/></bsdf>)")
              .reflectance),
      0.4590376f, 0.3914854f, 0.2340128f);
  expect_color(
      constant(bsdf<Diffuse>(R"(<bsdf type="diffuse"><spectrum name="reflectance" value="0.3"/></bsdf>)").reflectance),
      0.3f, 0.3f, 0.3f);
  expect_color(
      emitter<PointEmitter>(
          R"(<emitter type="point"><spectrum name="intensity" value="400:1, 500:2, 600:0.5, 700:1"/></emitter>)")
          .intensity,
      0.3886336f, 1.3364054f, 1.4245192f);
  expect_color(
      emitter<PointEmitter>(R"(<emitter type="point"><spectrum name="intensity" value="2"/></emitter>)").intensity,
      2.4095879f, 1.896582f, 1.8178321f);
  expect_color(
      emitter<PointEmitter>(R"(<emitter type="point"><float name="intensity" value="2"/></emitter>)").intensity, 2, 2,
      2);
  expect_color(
      emitter<PointEmitter>(
          R"(<emitter type="point"><spectrum name="intensity" type="d65"><float name="scale" value="3"/></spectrum></emitter>)")
          .intensity,
      3, 3, 3);
  EXPECT_EQ(error("<emitter type=\"point\"><spectrum name=\"intensity\" type=\"blackbody\"/></emitter>"),
            "s.xml:3:23: the spectrum \"blackbody\" needs a spectral renderer; warpath renders RGB: use an <rgb>");
}

class ImageTest : public SceneTest {
 protected:
  template <class T>
  void write_image(const std::string& name, int width, int height, int channels, OIIO::TypeDesc type,
                   const std::vector<T>& pixels) {
    const auto path = (m_files.folder() / name).string();
    auto output = OIIO::ImageOutput::create(path);
    ASSERT_TRUE(output);
    OIIO::ImageSpec spec(width, height, channels, type);
    spec["oiio:UnassociatedAlpha"] = 1;
    ASSERT_TRUE(output->open(path, spec));
    ASSERT_TRUE(output->write_image(type, pixels.data()));
    output->close();
  }
  std::string textured(const std::string& properties) {
    return "<bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"bitmap\">" + properties + "</texture></bsdf>";
  }
};

TEST_F(ImageTest, EightBitsStayAndAlphaGoes) {
  write_image<std::uint8_t>("a.png", 2, 1, 4, OIIO::TypeDesc::UINT8, {10, 20, 30, 0, 40, 50, 60, 128});
  const Scene scene = load_with_sensor(
      textured("<string name=\"filename\" value=\"a.png\"/><string name=\"filter_type\" value=\"nearest\"/>") +
      textured("<string name=\"filename\" value=\"./a.png\"/><string name=\"wrap_mode\" value=\"clamp\"/>") +
      textured("<string name=\"filename\" value=\"a.png\"/><boolean name=\"raw\" value=\"true\"/>"));
  const auto& first = std::get<BitmapTexture>(scene.textures.at(0));
  const auto& second = std::get<BitmapTexture>(scene.textures.at(1));
  const auto& raw = std::get<BitmapTexture>(scene.textures.at(2));
  EXPECT_EQ(std::get<std::vector<std::uint8_t>>(first.image->pixels),
            (std::vector<std::uint8_t>{10, 20, 30, 40, 50, 60}));
  EXPECT_EQ(first.image->width, 2);
  EXPECT_EQ(first.image->channels, 3);
  EXPECT_TRUE(first.image->srgb);
  EXPECT_EQ(first.image, second.image);  // one file, one image
  EXPECT_FALSE(raw.image->srgb);
  EXPECT_EQ(first.filter, BitmapTexture::Filter::nearest);
  EXPECT_EQ(first.wrap, BitmapTexture::Wrap::repeat);
  EXPECT_EQ(second.filter, BitmapTexture::Filter::bilinear);
  EXPECT_EQ(second.wrap, BitmapTexture::Wrap::clamp);
}

TEST_F(ImageTest, OtherDepthsBecomeLinearFloats) {
  write_image<std::uint16_t>("grey.png", 1, 1, 1, OIIO::TypeDesc::UINT16, {32768});
  write_image<float>("c.exr", 1, 1, 3, OIIO::TypeDesc::FLOAT, {0.5f, 2.0f, 8.0f});
  const Scene scene = load_with_sensor(textured("<string name=\"filename\" value=\"grey.png\"/>") +
                                       textured("<string name=\"filename\" value=\"c.exr\"/>") +
                                       "<emitter type=\"envmap\"><string name=\"filename\" value=\"grey.png\"/><float "
                                       "name=\"scale\" value=\"3\"/></emitter>");
  const auto& grey = *std::get<BitmapTexture>(scene.textures.at(0)).image;
  EXPECT_EQ(grey.channels, 1);
  EXPECT_FALSE(grey.srgb);
  EXPECT_NEAR(std::get<std::vector<float>>(grey.pixels).at(0), 0.21404, 1e-4);  // sRGB 0.5, decoded
  EXPECT_EQ(std::get<std::vector<float>>(std::get<BitmapTexture>(scene.textures.at(1)).image->pixels),
            (std::vector<float>{0.5f, 2, 8}));
  const auto& envmap = std::get<EnvmapEmitter>(scene.emitters.at(0).model);
  EXPECT_EQ(envmap.image->channels, 3);
  EXPECT_EQ(std::get<std::vector<float>>(envmap.image->pixels).size(), 3u);
  EXPECT_EQ(envmap.scale, 3);
}

TEST_F(ImageTest, MissingAndBrokenFiles) {
  m_files.write("Wood.png", "no image");
  EXPECT_EQ(error(textured("<string name=\"filename\" value=\"wood.png\"/>")),
            "s.xml:3:64: there is no file \"wood.png\"; did you mean \"Wood.png\"?");
  EXPECT_EQ(error(textured("<string name=\"filename\" value=\"Wood.png\"/>")).substr(0, 22), "s.xml:3:64: Wood.png: ");
  EXPECT_EQ(error(textured("")), "s.xml:3:22: texture \"bitmap\" needs a <string name=\"filename\">");
}

TEST_F(MaterialTest, CheckerboardTransformAsMitsuba) {
  const Scene scene =
      load_with_sensor(R"(<bsdf type="diffuse"><texture type="checkerboard" name="reflectance"><transform name="to_uv">
    <scale x="4" y="8"/><translate x="0.25" y="0.5"/><rotate z="1" angle="30"/></transform></texture></bsdf>)");
  const auto& checkerboard = std::get<CheckerboardTexture>(scene.textures.at(0));
  expect_color(checkerboard.color0, 0.4f, 0.4f, 0.4f);
  expect_color(checkerboard.color1, 0.2f, 0.2f, 0.2f);
  const float rows[2][3] = {{3.4641f, -4, -0.0334936f}, {2, 6.9282f, 0.558013f}};  // Mitsuba 3.9.1's to_uv
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(checkerboard.to_uv[j][i], rows[i][j], 1e-5);
}

}  // namespace
}  // namespace warpath
