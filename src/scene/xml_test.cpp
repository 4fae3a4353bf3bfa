#include "scene/xml.h"

#include <gtest/gtest.h>

#include "scene/object.h"
#include "scene/temporary_files.h"

namespace warpath {
namespace {

using Defines = std::vector<std::pair<std::string, std::string>>;

class XmlTest : public testing::Test {
 protected:
  XmlDocument read(std::string_view text, const Defines& defines = {}) {
    return read_scene_xml(m_files.write("s.xml", text), defines);
  }
  ObjectTree build(std::string_view text) { return build_objects(read(text).root); }
  std::string error(std::string_view text, const Defines& defines = {}) {
    return error_of<SceneError>(m_files, [&] { build_objects(read(text, defines).root); });
  }
  TemporaryFiles m_files;
};

TEST_F(XmlTest, SubstitutesParameters) {
  const auto document = read(R"(<scene version="3.0.0">
  <default name="a" value="1"/><default name="ab" value="2"/><default name="c" value="$a$ab"/>
  <float name="x" value="$ab $a \$a $c"/>
</scene>)",
                             {{"a", "7"}});
  EXPECT_EQ(*document.root.children.at(0).attribute("value"), "2 7 $a 72");
}

TEST_F(XmlTest, FirstDefaultHolds) {
  const auto document = read(R"(<scene version="3.0.0"><default name="a" value="1"/><default name="a" value="2"/>
    <float name="x" value="$a"/></scene>)");
  EXPECT_EQ(*document.root.children.at(0).attribute("value"), "1");
}

TEST_F(XmlTest, UnknownParameterIsNamedWithItsPlace) {
  EXPECT_EQ(error("<scene version=\"3.0.0\">\n  <default name=\"resx\" value=\"1\"/>\n  <integer name=\"w\" "
                  "value=\"$rexs\"/>\n</scene>"),
            "s.xml:3:3: undefined parameter \"$rexs\"; did you mean \"resx\"?");
}

TEST_F(XmlTest, DefineThatNobodyUsesIsBadUsage) {
  const std::string text =
      R"(<scene version="3.0.0"><default name="spp" value="1"/><float name="x" value="$spp"/></scene>)";
  EXPECT_EQ(error_of<ConfigError>(m_files,
                                  [&] {
                                    read(text, {{"sp", "4"}});
                                  }),
            "-D sp=4: s.xml has no parameter \"sp\"; did you mean \"spp\"?");
}

TEST_F(XmlTest, MalformedXmlIsNamedWithItsPlace) {
  EXPECT_EQ(error("<scene version=\"3.0.0\">\n<bsdf type=\"diffuse\">\n</scene>"),
            "s.xml:3:3: not well-formed XML: Start-end tags mismatch");
  EXPECT_EQ(error("<scene>\n</scene>"), "s.xml:1:1: the root element <scene> has no version; write version=\"3.0.0\"");
  EXPECT_EQ(error("<scene version=\"3.0.0\">\n stray </scene>").substr(0, 30), "s.xml:1:24: text between eleme");
}

TEST_F(XmlTest, MissingFile) {
  EXPECT_EQ(error_of<SceneError>(m_files, [&] { read_scene_xml(m_files.folder() / "no.xml", {}); }),
            "no.xml: no such scene file");
}

TEST_F(XmlTest, IncludesAreSplicedInAndPlacesStayTheirs) {
  m_files.write("parts/materials.xml",
                "<scene version=\"3.0.0\">\n  <bsdf type=\"diffuse\" id=\"grey\"/>\n <include filename=\"one.xml\" "
                "name=\"extra\"/></scene>");
  m_files.write("parts/one.xml", "<bsdf version=\"3.0.0\" type=\"diffuse\" id=\"$name\"/>");
  const auto tree = build(R"(<scene version="3.0.0"><default name="name" value="white"/>
    <include filename="parts/materials.xml"/><bsdf type="twosided"><ref id="white"/></bsdf></scene>)");
  ASSERT_EQ(tree.scene().properties.size(), 3u);
  EXPECT_EQ(tree.objects.at(1)->id, "grey");
  EXPECT_EQ(error_of<SceneError>(m_files, [&] { fail(tree.objects[1]->where, "here"); }),
            "parts/materials.xml:2:3: here");
  EXPECT_EQ(tree.scene().properties[1].name, "extra");
  EXPECT_EQ(tree.objects.at(2)->id, "white");
  EXPECT_EQ(std::get<const Object*>(tree.objects[3]->properties[0].value), tree.objects[2].get());
}

TEST_F(XmlTest, IncludeErrors) {
  EXPECT_EQ(error("<scene version=\"3.0.0\">\n\n <include filename=\"no.xml\"/></scene>"),
            "s.xml:3:2: included file \"no.xml\" cannot be opened");
  EXPECT_EQ(error("<scene version=\"3.0.0\">\n <include filename=\"s.xml\"/></scene>"),
            "s.xml:2:2: includes are nested more than 15 deep; does a file include itself?");
}

TEST_F(XmlTest, PathsAreSearchedFirst) {
  m_files.write("library/x.obj", "");
  m_files.write("x.obj", "");
  const auto document = read(R"(<scene version="3.0.0"><path value="library"/></scene>)");
  EXPECT_EQ(find_file(document.folders, "x.obj"), m_files.folder() / "library/x.obj");
  EXPECT_EQ(error("<scene version=\"3.0.0\"><path value=\"nowhere\"/></scene>"),
            "s.xml:1:24: <path>: there is no folder \"nowhere\"");
}

TEST_F(XmlTest, References) {
  EXPECT_EQ(error(R"(<scene version="3.0.0"><bsdf type="diffuse" id="Wood"/><shape type="cube">
  <ref id="wood"/></shape></scene>)"),
            "s.xml:2:3: there is no object with id=\"wood\"; did you mean \"Wood\"?");
  EXPECT_EQ(error("<scene version=\"3.0.0\"><shape type=\"cube\"><ref id=\"wood\"/></shape></scene>"),
            "s.xml:1:43: there is no object with id=\"wood\"; nothing in the scene has an id");
  EXPECT_EQ(error("<scene version=\"3.0.0\"><bsdf type=\"a\" id=\"x\"/>\n<bsdf type=\"b\" id=\"x\"/></scene>"),
            "s.xml:2:1: the id \"x\" is taken: s.xml:1:24");
  EXPECT_EQ(error("<scene version=\"3.0.0\"><bsdf type=\"twosided\" id=\"x\">\n<ref id=\"x\"/></bsdf></scene>"),
            "s.xml:2:1: circular reference: bsdf \"x\" contains itself");
}

TEST_F(XmlTest, AliasesNameTheSameObject) {
  const auto tree =
      build(R"(<scene version="3.0.0"><bsdf type="diffuse" id="a"/><alias id="a" as="b"/><ref id="b"/></scene>)");
  EXPECT_EQ(std::get<const Object*>(tree.scene().properties[1].value)->id, "a");
}

TEST_F(XmlTest, UnknownElementsAndAttributes) {
  EXPECT_EQ(error("<scene version=\"3.0.0\"><shap type=\"cube\"/></scene>"),
            "s.xml:1:24: unknown element <shap>; did you mean \"shape\"?");
  EXPECT_EQ(error("<scene version=\"3.0.0\"><shape typ=\"cube\"/></scene>"),
            "s.xml:1:24: <shape> has no attribute \"typ\"; did you mean \"type\"?");
  EXPECT_EQ(error("<scene version=\"3.0.0\"><shape/></scene>"), "s.xml:1:24: <shape> needs the attribute \"type\"");
  EXPECT_EQ(error("<scene version=\"3.0.0\"><rotate y=\"1\" angle=\"3\"/></scene>"),
            "s.xml:1:24: <rotate> can only stand in a <transform>");
  EXPECT_EQ(
      error("<scene version=\"3.0.0\"><float name=\"a\" value=\"1\"><float name=\"b\" value=\"1\"/></float></scene>"),
      "s.xml:1:50: <float> cannot stand in <float>");
}

TEST_F(XmlTest, ValuesThatAreNone) {
  const auto value_error = [&](const std::string& element) {
    return error("<scene version=\"3.0.0\">" + element + "</scene>");
  };
  EXPECT_EQ(value_error(R"(<float name="x" value="1,5 m"/>)"), "s.xml:1:24: \"m\" is not a number");
  EXPECT_EQ(value_error(R"(<float name="x" value="1 2"/>)"), "s.xml:1:24: \"1 2\" is not one number");
  EXPECT_EQ(value_error(R"(<integer name="x" value="1.5"/>)"), "s.xml:1:24: \"1.5\" is not an integer");
  EXPECT_EQ(value_error(R"(<boolean name="x" value="yes"/>)"), "s.xml:1:24: \"yes\" is neither true nor false");
  EXPECT_EQ(value_error(R"(<rgb name="x" value="1 2"/>)"), "s.xml:1:24: <rgb> needs one or three numbers, not 2");
  EXPECT_EQ(value_error(R"(<rgb name="x" value="#12345"/>)"), "s.xml:1:24: \"#12345\" is no colour like #f9aa34");
  EXPECT_EQ(value_error(R"(<spectrum name="x" value="500:1, 400:2"/>)"),
            "s.xml:1:24: the wavelengths of <spectrum> must increase");
  EXPECT_EQ(value_error("<float name=\"x\" value=\"1\"/>\n<float name=\"x\" value=\"1\"/>"),
            "s.xml:2:1: \"x\" is given twice, before that at s.xml:1:24");
}

TEST_F(XmlTest, ColoursInHexadecimal) {
  const auto tree =
      build(R"(<scene version="3.0.0"><rgb name="a" value="#ff8000"/><srgb name="b" value="#ff8000"/></scene>)");
  const Color linear = std::get<RgbValue>(tree.scene().properties[0].value).color;
  EXPECT_FLOAT_EQ(linear.x, 1);
  EXPECT_FLOAT_EQ(linear.y, 128 / 255.0f);
  EXPECT_FLOAT_EQ(linear.z, 0);
  EXPECT_NEAR(std::get<RgbValue>(tree.scene().properties[1].value).color.y, 0.21586, 1e-5);  // IEC 61966-2-1
}

TEST_F(XmlTest, OldFilesAreUpgraded) {
  const auto tree =
      build(R"(<scene version="0.6.0"><shape type="obj"><transform name="toWorld"/><float name="intIOR" value="1"/>
    <bsdf type="diffuse"><rgb name="diffuseReflectance" value="1"/></bsdf></shape>
    <texture type="bitmap"><float name="uscale" value="2"/><float name="voffset" value="3"/></texture></scene>)");
  EXPECT_NE(tree.objects[1]->find("to_world"), nullptr);
  EXPECT_NE(tree.objects[1]->find("int_ior"), nullptr);
  EXPECT_NE(tree.objects[2]->find("reflectance"), nullptr);
  const auto to_uv = tree.objects[3]->get_transform("to_uv")[0].matrix;
  EXPECT_EQ(to_uv[0][0], 2);
  EXPECT_EQ(to_uv[3][1], 3);
  EXPECT_EQ(tree.objects[3]->properties.size(), 1u);
}

TEST_F(XmlTest, UnreadPropertyIsAnErrorWithWhatWasAskedFor) {
  const auto tree = build(
      "<scene version=\"3.0.0\">\n<bsdf type=\"diffuse\">\n  <float name=\"reflectanse\" value=\"1\"/></bsdf></scene>");
  const Object& bsdf = *tree.objects[1];
  bsdf.get_float("reflectance", 0.5f);
  EXPECT_EQ(error_of<SceneError>(m_files, [&] { bsdf.check_all_read(); }),
            "s.xml:3:3: bsdf \"diffuse\" has no property \"reflectanse\"; did you mean \"reflectance\"?");
}

TEST_F(XmlTest, PropertyOfAnotherType) {
  const auto tree = build(
      "<scene version=\"3.0.0\"><bsdf type=\"x\"><string name=\"a\" value=\"1\"/><float name=\"n\" "
      "value=\"nan\"/><integer name=\"i\" value=\"3\"/></bsdf></scene>");
  const Object& bsdf = *tree.objects[1];
  EXPECT_EQ(error_of<SceneError>(m_files, [&] { bsdf.get_float("a", 0); }),
            "s.xml:1:39: \"a\" of bsdf \"x\" must be a <float>, not a <string>");
  EXPECT_EQ(error_of<SceneError>(m_files, [&] { bsdf.get_float("n", 0); }),
            "s.xml:1:67: \"n\" of bsdf \"x\" must be finite, not nan");
  EXPECT_EQ(error_of<SceneError>(m_files, [&] { bsdf.get_integer("i", 0, 0, 2); }),
            "s.xml:1:96: \"i\" of bsdf \"x\" must be from 0 to 2, not 3");
  EXPECT_EQ(bsdf.get_float("i", 0), 3);
}

}  // namespace
}  // namespace warpath
