// Shapes, emitters, sensors, films and integrators of scene files.
#include <cmath>
#include <random>

#include "scene/scene_fixture.h"

namespace warpath {
namespace {

// ---- Shapes -------------------------------------------------------------------------------------------------------

TEST_F(SceneTest, MeshFilesOfAllKindsGiveTheSameBox) {
  m_files.write("m.obj", "v 0 0 0\nv 2 0 0\nv 0 3 1\nf 1 2 3\n");
  m_files.write("m.ply",
                "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
                "z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n0 0 0\n2 0 0\n0 3 1\n3 0 1 2\n");
  for (const std::string type : {"obj", "ply"}) {
    const Scene scene =
        load_with_sensor("<shape type=\"" + type + "\" id=\"mesh\"><string name=\"filename\" value=\"m." + type +
                         "\"/><transform name=\"to_world\"><translate x=\"1\"/></transform></shape>");
    const Shape& shape = scene.shapes.at(0);
    EXPECT_EQ(shape.id, "mesh");
    const auto& mesh = std::get<Mesh>(shape.geometry);
    EXPECT_EQ(mesh.triangle_count(), 1u);
    EXPECT_EQ(mesh.positions.at(2), Vec3(1, 3, 1));
    EXPECT_EQ(mesh.normals.size(), 3u);
    EXPECT_TRUE(mesh.positions_end.empty());
    expect_color(std::get<ConstantTexture>(scene.textures.at(0)).value, 0.5f, 0.5f, 0.5f);
  }
}

TEST_F(SceneTest, MeshErrorsNameTheElementAndTheFilesLine) {
  m_files.write("m.obj", "v 0 0 0\nv 1 0 0\nf 1 2 3\n");
  m_files.write("e.obj", "v 0 0 0\n");
  EXPECT_EQ(error("<shape type=\"obj\"><string name=\"filename\" value=\"m.obj\"/></shape>"),
            "s.xml:3:1: m.obj:3: a face refers to vertex 3, but there are only 2 before it");
  EXPECT_EQ(error("<shape type=\"obj\"><string name=\"filename\" value=\"e.obj\"/></shape>"),
            "s.xml:3:1: e.obj: the mesh has no triangles");
  EXPECT_EQ(error("<shape type=\"obj\"><string name=\"filename\" value=\"n.obj\"/></shape>"),
            "s.xml:3:19: there is no file \"n.obj\"; did you mean \"e.obj\"?");
  // Of several, the first in the scene.
  EXPECT_EQ(error("<shape type=\"obj\"><string name=\"filename\" value=\"e.obj\"/></shape>\n<shape "
                  "type=\"obj\"><string name=\"filename\" value=\"m.obj\"/></shape>"),
            "s.xml:3:1: e.obj: the mesh has no triangles");
}

TEST_F(SceneTest, SpheresAndCylindersAsMitsuba) {
  const Scene scene =
      load_with_sensor(R"(<shape type="sphere"><point name="center" value="1 2 3"/><float name="radius" value="2"/>
      <transform name="to_world"><scale value="0.5"/><scale x="-1"/></transform></shape>
    <shape type="cylinder"><point name="p0" value="1 2 3"/><point name="p1" value="2 4 6"/><float name="radius" value="0.5"/>
      <transform name="to_world"><rotate y="1" angle="20"/></transform></shape>)");
  const auto& sphere = std::get<Sphere>(scene.shapes.at(0).geometry);
  EXPECT_EQ(sphere.center[0], Vec3(-0.5f, 1, 1.5f));
  EXPECT_FLOAT_EQ(sphere.radius[1], 1);
  EXPECT_TRUE(sphere.flip_normals);  // mirrored: Mitsuba turns it inside out
  const double rows[3][4] = {
      {0.405516, -0.128661, 1.96575, 1.96575}, {-0.0396433, 0.420713, 2, 2}, {-0.289802, -0.237585, 2.47706, 2.47706}};
  const auto& cylinder = std::get<Cylinder>(scene.shapes.at(1).geometry);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j) EXPECT_NEAR(cylinder.to_world[0][j][i], rows[i][j], 1e-5) << i << j;
  EXPECT_FALSE(cylinder.flip_normals);
  EXPECT_EQ(warnings(), "");
  load_with_sensor("<shape type=\"sphere\"><transform name=\"to_world\"><scale x=\"2\"/></transform></shape>");
  EXPECT_NE(warnings().find("s.xml:3:1: to_world scales the sphere unevenly"), std::string::npos);
}

TEST_F(SceneTest, ShapesThatShineAreBlackByDefault) {
  const Scene scene =
      load_with_sensor(R"(<shape type="rectangle"><emitter type="area"><rgb name="radiance" value="1 2 3"/>
      <float name="sampling_weight" value="2"/></emitter></shape><shape type="disk"><ref id="light"/></shape>
      <emitter type="area" id="light"/>)");
  ASSERT_EQ(scene.emitters.size(), 2u);
  EXPECT_EQ(scene.emitters[0].sampling_weight, 2);
  const auto& area = std::get<AreaEmitter>(scene.emitters[0].model);
  EXPECT_EQ(area.shape, 0);
  EXPECT_EQ(scene.shapes[0].emitter, 0);
  EXPECT_EQ(scene.shapes[1].emitter, 1);
  expect_color(std::get<ConstantTexture>(scene.textures.at(static_cast<std::size_t>(area.radiance))).value, 1, 2, 3);
  const auto& black = std::get<Diffuse>(scene.bsdfs.at(static_cast<std::size_t>(scene.shapes[0].bsdf)).model);
  expect_color(std::get<ConstantTexture>(scene.textures.at(static_cast<std::size_t>(black.reflectance))).value, 0, 0,
               0);
}

TEST_F(SceneTest, MotionIsTakenAtTheShuttersTimes) {
  const std::string animation =
      R"(<animation name="to_world"><transform time="0"/><transform time="2"><translate x="4"/></transform></animation>)";
  const Scene scene = load(
      "<sensor type=\"perspective\"><float name=\"shutter_open\" value=\"0.5\"/><float name=\"shutter_close\" "
      "value=\"1\"/>" +
      animation + "</sensor><shape type=\"cube\">" + animation + "</shape><shape type=\"sphere\">" + animation +
      "</shape>");
  EXPECT_FLOAT_EQ(scene.sensor.to_world[0][3][0], 1);
  EXPECT_FLOAT_EQ(scene.sensor.to_world[1][3][0], 2);
  const auto& cube = std::get<Mesh>(scene.shapes[0].geometry);
  EXPECT_FLOAT_EQ(cube.positions_end.at(0).x - cube.positions.at(0).x, 1);
  EXPECT_FLOAT_EQ(std::get<Sphere>(scene.shapes[1].geometry).center[1].x, 2);
  EXPECT_EQ(error("<emitter type=\"point\">" + animation + "</emitter>"),
            "s.xml:3:23: emitter \"point\" cannot be animated: only shapes and sensors can");
}

// ---- Emitters, sensors, films -------------------------------------------------------------------------------------

TEST_F(SceneTest, Emitters) {
  const auto sun = emitter<DirectionalEmitter>(
      R"(<emitter type="directional"><vector name="direction" x="0" y="0" z="-2"/></emitter>)");
  EXPECT_EQ(sun.direction, Vec3(0, 0, -1));
  const auto turned = emitter<DirectionalEmitter>(
      R"(<emitter type="directional"><transform name="to_world"><rotate x="1" angle="90"/></transform></emitter>)");
  EXPECT_NEAR((turned.direction - Vec3(0, -1, 0)).length(), 0, 1e-6);
  EXPECT_EQ(emitter<PointEmitter>(
                R"(<emitter type="point"><transform name="to_world"><translate y="3"/></transform></emitter>)")
                .position,
            Vec3(0, 3, 0));
  EXPECT_FLOAT_EQ(
      emitter<SpotEmitter>(R"(<emitter type="spot"><float name="cutoff_angle" value="40"/></emitter>)").beam_width, 30);
  EXPECT_EQ(
      error(
          "<emitter type=\"point\"><point name=\"position\" value=\"1 2 3\"/><transform name=\"to_world\"/></emitter>"),
      "s.xml:3:61: give either \"position\" or \"to_world\", not both");
  EXPECT_EQ(error("<emitter type=\"constant\"/>\n<emitter type=\"constant\"/>"),
            "s.xml:4:1: a scene has one \"envmap\" or \"constant\" emitter at most");
}

TEST_F(SceneTest, AreaEmitterWithoutAShapeIsNamed) {
  EXPECT_TRUE(load_with_sensor("<emitter type=\"area\" id=\"light\"/>").emitters.empty());
  EXPECT_EQ(warnings(), "s.xml:3:1: the area emitter belongs to no shape, so it does not shine\n");
}

TEST_F(SceneTest, FieldOfViewAsMitsuba) {
  const auto x_fov = [&](const std::string& properties) {
    return load(
               "<sensor type=\"perspective\">" + properties +
               R"(<film type="hdrfilm"><integer name="width" value="320"/><integer name="height" value="180"/></film></sensor>)")
        .sensor.x_fov;
  };
  EXPECT_NEAR(load(std::string(kSensor)).sensor.x_fov, 38.18484, 1e-4);  // Mitsuba 3.9.1, 50 mm on 768 x 576
  EXPECT_NEAR(x_fov(R"(<float name="fov" value="40"/>)"), 40, 1e-5);
  EXPECT_NEAR(x_fov(R"(<float name="fov" value="40"/><string name="fov_axis" value="y"/>)"), 65.81043,
              1e-4);  // Mitsuba 3.9.1
  EXPECT_NEAR(x_fov(R"(<float name="fov" value="40"/><string name="fov_axis" value="smaller"/>)"), 65.81043, 1e-4);
  EXPECT_NEAR(x_fov(R"(<float name="fov" value="40"/><string name="fov_axis" value="larger"/>)"), 40, 1e-5);
  const double half = std::atan(std::tan(M_PI / 9) / std::hypot(1.0, 180.0 / 320));
  EXPECT_NEAR(x_fov(R"(<float name="fov" value="40"/><string name="fov_axis" value="diagonal"/>)"),
              2 * half * 180 / M_PI, 1e-4);
  EXPECT_EQ(error_of<SceneError>(m_files, [&] { x_fov(R"(<float name="fov" value="180"/>)"); }),
            "s.xml:2:28: the field of view must be between 0 and 180 degrees, not 180");
}

TEST_F(SceneTest, SizeOverrideTakesTheCropAlongAndSetsTheFieldOfView) {
  const std::string body =
      R"(<sensor type="perspective"><float name="fov" value="40"/><string name="fov_axis" value="y"/><film type="hdrfilm">
    <integer name="width" value="400"/><integer name="height" value="200"/><integer name="crop_offset_x" value="100"/>
    <integer name="crop_width" value="200"/><integer name="crop_height" value="100"/></film></sensor>)";
  const Scene own = load(body);
  EXPECT_EQ(own.film.crop_x, 100);
  EXPECT_EQ(own.film.crop_height, 100);
  SceneOptions options;
  options.width = options.height = 100;
  const Scene scene = load(body, options);
  EXPECT_EQ(scene.film.width, 100);
  EXPECT_EQ(scene.film.height, 100);
  EXPECT_EQ(scene.film.crop_x, 25);
  EXPECT_EQ(scene.film.crop_width, 50);
  EXPECT_EQ(scene.film.crop_y, 0);
  EXPECT_EQ(scene.film.crop_height, 50);
  EXPECT_NEAR(scene.sensor.x_fov, 40, 1e-4);
  EXPECT_EQ(error_of<SceneError>(m_files,
                                 [&] {
                                   load(
                                       "<sensor type=\"perspective\"><film type=\"hdrfilm\"><integer "
                                       "name=\"crop_width\" value=\"800\"/></film></sensor>");
                                 }),
            "s.xml:2:49: the crop window ends at x = 800, beyond the film's 768");
}

TEST_F(SceneTest, Filters) {
  const auto filter = [&](const std::string& text) {
    return load("<sensor type=\"perspective\"><film type=\"hdrfilm\">" + text + "</film></sensor>").film.filter;
  };
  using Type = ReconstructionFilter::Type;
  EXPECT_EQ(filter("").type, Type::gaussian);
  EXPECT_FLOAT_EQ(filter("").radius, 2);
  EXPECT_FLOAT_EQ(filter("<rfilter type=\"gaussian\"><float name=\"stddev\" value=\"0.25\"/></rfilter>").radius, 1);
  EXPECT_FLOAT_EQ(filter("<rfilter type=\"box\"/>").radius, 0.5f);
  EXPECT_FLOAT_EQ(filter("<rfilter type=\"tent\"/>").radius, 1);
  EXPECT_FLOAT_EQ(filter("<rfilter type=\"mitchell\"><float name=\"B\" value=\"0\"/></rfilter>").b, 0);
  EXPECT_EQ(error_of<SceneError>(m_files, [&] { filter("<rfilter type=\"lanczos\"/>"); }),
            "s.xml:2:49: the rfilter \"lanczos\" is not supported; \"mitchell\" is as sharp, with less ringing");
}

TEST_F(SceneTest, IntegratorsAndSamplers) {
  const Scene scene = load_with_sensor(
      "<integrator type=\"path\"><integer name=\"max_depth\" value=\"9\"/><boolean name=\"hide_emitters\" "
      "value=\"true\"/></integrator>");
  EXPECT_EQ(scene.integrator.max_depth, 9);
  EXPECT_EQ(scene.integrator.rr_depth, 5);
  EXPECT_TRUE(scene.integrator.hide_emitters);
  EXPECT_EQ(scene.sample_count, 4);
  EXPECT_EQ(load(std::string(kSensor)).integrator.max_depth, -1);
  SceneOptions options;
  options.max_depth = 3;
  EXPECT_EQ(load(std::string(kSensor), options).integrator.max_depth, 3);
  EXPECT_EQ(load("<sensor type=\"perspective\"><sampler type=\"stratified\"><integer name=\"sample_count\" "
                 "value=\"64\"/></sampler></sensor>")
                .sample_count,
            64);
  EXPECT_EQ(warnings(), "");
  EXPECT_EQ(load_with_sensor("<integrator type=\"direct\"><integer name=\"emitter_samples\" value=\"4\"/></integrator>")
                .integrator.max_depth,
            2);
  EXPECT_EQ(
      warnings(),
      "s.xml:3:27: \"emitter_samples\" is ignored: one sample of the emitters and one of the BSDF are combined\n");
  EXPECT_EQ(error("<integrator type=\"ptracer\"/>"),
            "s.xml:3:1: the integrator \"ptracer\" is not supported; known: path, direct, volpath");
  EXPECT_EQ(error_of<SceneError>(m_files, [&] { load("<shape type=\"cube\"/>"); }),
            "s.xml:1:1: the scene has no <sensor>");
}

TEST_F(SceneTest, SensorsMayBeScaledEvenly) {
  const Scene scene = load(
      R"(<sensor type="thinlens"><float name="aperture_radius" value="0.1"/><transform name="to_world"><scale value="3"/></transform></sensor>)");
  EXPECT_FLOAT_EQ(scene.sensor.to_world[0][0][0], 1);
  EXPECT_NE(warnings().find("the sensor's to_world scales by 3, which is ignored"), std::string::npos);
  EXPECT_EQ(
      error_of<SceneError>(
          m_files,
          [&] {
            load("<sensor type=\"perspective\"><transform name=\"to_world\"><scale x=\"3\"/></transform></sensor>");
          }),
      "s.xml:2:28: the sensor's to_world shears or scales unevenly; it may turn, move and mirror");
  EXPECT_EQ(error_of<SceneError>(m_files, [&] { load("<sensor type=\"thinlens\"/>"); }),
            "s.xml:2:1: sensor \"thinlens\" needs a <float name=\"aperture_radius\">");
}

TEST_F(SceneTest, BrokenScenesGiveASceneOrAnError) {
  const std::string good =
      R"(<scene version="3.0.0"><default name="n" value="3"/><sensor type="perspective"><float name="fov" value="30"/>
<film type="hdrfilm"><integer name="width" value="$n"/><rfilter type="tent"/></film></sensor><shape type="cube" id="a">
<transform name="to_world"><rotate x="1" angle="20"/><lookat origin="1 2 3" target="0 0 0" up="0 1 0"/></transform>
<bsdf type="twosided" id="b"><bsdf type="diffuse"><rgb name="reflectance" value="#102030"/></bsdf></bsdf></shape>
<shape type="sphere"><ref id="b"/><emitter type="area"><spectrum name="radiance" value="400:1, 700:2"/></emitter></shape></scene>)";
  EXPECT_EQ(load_scene(m_files.write("s.xml", good)).shapes.size(), 2u);
  std::mt19937 random(11);  // fixed seed: the same copies each time
  int errors = 0;
  for (int i = 0; i < 1000; ++i) {
    std::string bytes = good;
    for (int k = i % 3; k >= 0; --k) {
      constexpr std::string_view kLikely = "<>\"=/$ 0-9.e#,:abt\n";
      bytes[random() % bytes.size()] = kLikely[random() % kLikely.size()];
    }
    const auto path = m_files.write("s.xml", bytes);
    try {
      load_scene(path);
    } catch (const SceneError& error) {
      ++errors;
      EXPECT_NE(std::string_view(error.what()).find("s.xml:"), std::string_view::npos) << error.what();
    }
  }
  EXPECT_GT(errors, 500);
}

TEST_F(SceneTest, LoadsTheSameForAnyOrderOfThreads) {
  for (int i = 0; i < 20; ++i)
    m_files.write("m" + std::to_string(i) + ".obj", "v 0 0 " + std::to_string(i) + "\nv 1 0 0\nv 0 1 0\nf 1 2 3\n" +
                                                        std::string(static_cast<std::size_t>(i) * 1000, '#'));
  std::string body;
  for (int i = 0; i < 20; ++i)
    body += "<shape type=\"obj\"><string name=\"filename\" value=\"m" + std::to_string(i) + ".obj\"/></shape>";
  const Scene scene = load_with_sensor(body);
  for (std::size_t i = 0; i < 20; ++i)
    EXPECT_EQ(std::get<Mesh>(scene.shapes.at(i).geometry).positions.at(0).z, static_cast<float>(i));
}

}  // namespace
}  // namespace warpath
