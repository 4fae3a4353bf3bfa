#include "scene/transform.h"

#include <gtest/gtest.h>

#include "scene/temporary_files.h"

namespace warpath {
namespace {

class TransformTest : public testing::Test {
 protected:
  XmlElement read(const std::string& text) {
    return read_scene_xml(m_files.write("s.xml", "<scene version=\"3.0.0\">" + text + "</scene>"), {})
        .root.children.at(0);
  }
  Imath::M44d matrix(const std::string& operations) {
    return parse_transform(read("<transform name=\"to_world\">" + operations + "</transform>")).at(0).matrix;
  }
  std::string error(const std::string& operations) {
    return error_of<SceneError>(m_files, [&] { matrix(operations); });
  }
  /// Rows as files and Mitsuba print them: column vectors.
  static void expect_rows(const Imath::M44d& m, const double (&rows)[3][4]) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 4; ++j) EXPECT_NEAR(m[j][i], rows[i][j], 2e-6) << i << ' ' << j;
  }
  TemporaryFiles m_files;
};

TEST_F(TransformTest, OperationsApplyInOrder) {
  Imath::V3d p;
  matrix(R"(<translate x="1"/><scale value="2"/><rotate z="1" angle="90"/>)").multVecMatrix({0, 0, 0}, p);
  EXPECT_NEAR((p - Imath::V3d(0, 2, 0)).length(), 0, 1e-15);
}

TEST_F(TransformTest, MatricesAreRowMajorAndMayBe3x3) {
  const double rows[3][4] = {{1, 2, 3, 4}, {5, 6, 7, 8}, {9, 10, 11, 12}};
  expect_rows(matrix(R"(<matrix value="1 2 3 4, 5 6 7 8  9 10 11 12 0 0 0 1"/>)"), rows);
  const double small[3][4] = {{1, 2, 3, 0}, {4, 5, 6, 0}, {7, 8, 9, 0}};
  expect_rows(matrix(R"(<matrix value="1 2 3 4 5 6 7 8 9"/>)"), small);
}

TEST_F(TransformTest, LookAtAfterRotationAsMitsuba) {
  // Printed by Mitsuba 3.9.1 for the same transform.
  const double rows[3][4] = {
      {-0.945076, 0.184254, -0.269967, 1}, {0.326851, 0.534133, -0.779661, 2}, {0.000542435, -0.825077, -0.56502, 3}};
  expect_rows(matrix(R"(<rotate x="0.6" z="0.8" angle="33"/><lookat origin="1,2,3" target="0 0 0" up="0,1,0"/>)"),
              rows);
}

TEST_F(TransformTest, LookAtChoosesUpIfThereIsNone) {
  // A directional light's frame in Mitsuba 3.9.1, which is built the same way.
  const double rows[3][4] = {
      {-0.0792865, 0.960357, 0.267261, 0}, {0.841427, -0.0792865, 0.534523, 0}, {0.534522, 0.267261, -0.801784, 0}};
  expect_rows(matrix(R"(<lookat origin="0 0 0" target="1 2 -3"/>)"), rows);
}

TEST_F(TransformTest, BadOperationsAreNamed) {
  EXPECT_EQ(error("<spin/>").substr(0, 50), "s.xml:1:51: unexpected <spin> in a transform; know");
  EXPECT_EQ(error("<rotate angle=\"3\"/>"), "s.xml:1:51: <rotate> needs an axis; write y=\"1\" for the y axis");
  EXPECT_EQ(error("<rotate y=\"1\"/>"), "s.xml:1:51: <rotate> needs the attribute \"angle\"");
  EXPECT_EQ(error("<matrix value=\"1 2\"/>"), "s.xml:1:51: <matrix> needs 16 or 9 numbers, not 2");
  EXPECT_EQ(error("<matrix value=\"1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1\"/>"),
            "s.xml:1:51: <matrix> is not affine: its last row must be 0 0 0 1");
  EXPECT_EQ(error("<lookat origin=\"0 0 0\" target=\"0 1 0\" up=\"0 1 0\"/>"),
            "s.xml:1:51: <lookat> has no sideways direction: up is parallel to the line of sight");
  EXPECT_EQ(error("<scale value=\"1 2\"/>"), "s.xml:1:51: <scale> needs one or three numbers, not 2");
  EXPECT_EQ(error("<scale value=\"1\" x=\"2\"/>"), "s.xml:1:51: <scale> has both \"value\" and \"x\", \"y\" or \"z\"");
}

TEST_F(TransformTest, KeyframesAreInterpolatedAndHeld) {
  const auto animation =
      parse_animation(read(R"(<animation name="to_world"><transform time="1"><translate x="2"/></transform>
      <transform time="3"><translate x="6"/></transform></animation>)"));
  EXPECT_EQ(matrix_at(animation, 0)[3][0], 2);
  EXPECT_EQ(matrix_at(animation, 1.5)[3][0], 3);
  EXPECT_EQ(matrix_at(animation, 9)[3][0], 6);
}

TEST_F(TransformTest, AnimationNeedsTwoKeyframes) {
  const auto animation_error = [&](const std::string& keyframes) {
    return error_of<SceneError>(
        m_files, [&] { parse_animation(read("<animation name=\"to_world\">" + keyframes + "</animation>")); });
  };
  EXPECT_EQ(animation_error("<transform time=\"0\"/>"),
            "s.xml:1:24: <animation> needs two <transform time=\"...\">, not 1; more keyframes are not supported yet");
  EXPECT_EQ(animation_error("<transform time=\"1\"/><transform time=\"1\"/>"),
            "s.xml:1:24: the times in <animation> must increase");
}

TEST_F(TransformTest, NumbersOfAllKinds) {
  const Location where;
  EXPECT_EQ(parse_numbers(" +1,-2.5e1\t3\n5.4e-400 ", where), (std::vector<double>{1, -25, 3, 0}));
  EXPECT_THROW(parse_numbers("1e400", where), SceneError);
  EXPECT_THROW(parse_numbers("0x10", where), SceneError);
}

}  // namespace
}  // namespace warpath
