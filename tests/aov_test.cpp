// The layers that --aov adds, against what a pinhole camera sees of two planes.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "cli/commands.h"
#include "report/image.h"
#include "scene/temporary_files.h"

namespace warpath {
namespace {

constexpr int kSize = 16;

// A camera at z = 4 looks along -z with a field of view of 90 degrees. The wall fills the right half of what it sees of
// z = 0; the panel stands to the left, nearer, and is turned by 45 degrees. Between and above them there is nothing.
constexpr const char* kScene = R"(<scene version="3.0.0">
  <integrator type="path"/>
  <sensor type="perspective">
    <float name="fov" value="90"/>
    <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm">
      <integer name="width" value="16"/> <integer name="height" value="16"/> <rfilter type="box"/>
    </film>
  </sensor>
  <emitter type="constant"/>
  <shape type="rectangle">
    <transform name="to_world"><scale x="2" y="4"/><translate x="2"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.2, 0.4, 0.6"/></bsdf>
  </shape>
  <shape type="rectangle">
    <transform name="to_world"><rotate y="1" angle="45"/><translate x="-2" z="1"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.5, 0.1"/></bsdf>
  </shape>
</scene>)";

struct Plane {
  Vec3 point, normal;
  Color albedo;
};
const Plane kWall{{0, 0, 0}, {0, 0, 1}, {0.2f, 0.4f, 0.6f}};
const Plane kPanel{{-2, 0, 1}, {std::sqrt(0.5f), 0, std::sqrt(0.5f)}, {0.7f, 0.5f, 0.1f}};

/// Distance to the plane along the ray through a position on the film, in pixels from the top left.
double distance(const Plane& plane, double x, double y) {
  const Vec3 origin(0, 0, 4), d(static_cast<float>(2 * x / kSize - 1), static_cast<float>(1 - 2 * y / kSize), -1);
  return (plane.point - origin).dot(plane.normal) / d.dot(plane.normal) * std::sqrt(d.dot(d));
}

class Aovs : public testing::Test {
 protected:
  ImageFile render(const std::string& aov) {
    RenderCommand command;
    command.scene.file = m_files.write("scene.xml", kScene);
    command.process.quiet = true;
    command.render.spp = 1;
    command.aov = aov;
    command.output = m_files.folder() / "image.exr";
    run(command);
    return read_image(command.output);
  }

  /// Every layer in the pixel is that of the plane, which fills it.
  void expect_plane(const ImageFile& file, const Plane& plane, int x, int y) {
    const Color albedo = file.layer("albedo")->at(x, y), normal = file.layer("normal", "XYZ")->at(x, y);
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(albedo[c], plane.albedo[c], 1e-5) << "albedo at " << x << ", " << y;
      EXPECT_NEAR(normal[c], plane.normal[c], 1e-5) << "normal at " << x << ", " << y;
    }
    // The pixel holds the mean over its rays, none of them farther from the middle than a corner.
    const double middle = distance(plane, x + 0.5, y + 0.5);
    double reach = 0;
    for (const auto [dx, dy] : {std::array{0, 0}, {0, 1}, {1, 0}, {1, 1}})
      reach = std::max(reach, std::abs(distance(plane, x + dx, y + dy) - middle));
    EXPECT_NEAR(depth(file, x, y), middle, reach) << "depth at " << x << ", " << y;
    EXPECT_LT(reach, 0.1 * middle);
  }

  static float depth(const ImageFile& file, int x, int y) {
    for (const ImageChannel& channel : file.channels)
      if (channel.name == "depth.Y") return channel.values[static_cast<std::size_t>(y * kSize + x)];
    ADD_FAILURE() << "no channel depth.Y";
    return NAN;
  }

 private:
  TemporaryFiles m_files;
};

TEST_F(Aovs, AreWhatTheCameraSeesFirst) {
  const ImageFile file = render("albedo,normal,depth");
  ASSERT_TRUE(file.layer("albedo"));
  ASSERT_TRUE(file.layer("normal", "XYZ"));
  for (const auto [x, y] : {std::array{8, 0}, {12, 3}, {15, 15}, {9, 8}}) expect_plane(file, kWall, x, y);
  for (const auto [x, y] : {std::array{0, 6}, {2, 7}, {4, 9}}) expect_plane(file, kPanel, x, y);
  for (const auto [x, y] : {std::array{0, 0}, {7, 8}, {3, 15}}) {
    EXPECT_EQ(file.layer("albedo")->at(x, y), Color(0.0f));
    EXPECT_EQ(file.layer("normal", "XYZ")->at(x, y), Color(0.0f));
    EXPECT_EQ(depth(file, x, y), 0);
  }
}

TEST_F(Aovs, AreInTheFileOnlyIfAskedFor) {
  const ImageFile file = render("normal");
  std::vector<std::string> names;
  for (const ImageChannel& channel : file.channels) names.push_back(channel.name);
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"normal.X", "normal.Y", "normal.Z", "samples.Y", "variance.B",
                                             "variance.G", "variance.R"}));
}

}  // namespace
}  // namespace warpath
