#include "scene/mesh_file.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <random>

#include "scene/temporary_files.h"

namespace warpath {
namespace {

float parse(const std::string& text) {
  std::string padded = text + std::string(64, '\n');
  float value = -1;
  const char* end = parse_float(padded.c_str(), value);
  EXPECT_NE(end, nullptr) << text;
  EXPECT_EQ(end ? static_cast<std::size_t>(end - padded.c_str()) : 0, text.size()) << text;
  return value;
}

TEST(ParseFloat, RoundsAsTheCLibrary) {
  std::mt19937 random(20260101);  // fixed seed: the same million digits each time
  for (int i = 0; i < 100000; ++i) {
    char text[64];
    const auto bits = static_cast<std::uint32_t>(random());
    const float wanted = std::bit_cast<float>(bits);
    if (!std::isfinite(wanted)) continue;
    std::snprintf(text, sizeof text, i % 2 ? "%.9g" : "%.6f",
                  static_cast<double>(i % 2 ? wanted : std::fmod(wanted, 1e4f)));
    ASSERT_EQ(std::bit_cast<std::uint32_t>(parse(text)), std::bit_cast<std::uint32_t>(std::strtof(text, nullptr)))
        << text;
  }
}

TEST(ParseFloat, HardCases) {
  // Halfway between two floats, just above, just below; too long for 64 bits; exponents; no digits on one side.
  for (const char* text :
       {"16777217", "16777217.0000001", "16777216.9999999", "0.1234567890123456789012345", "1e-30", "-1E+5", ".5", "5.",
        "-0", "1e-46", "3.4028235e38", "9007199254740993", "1.17549435e-38", "1e-40", "+2.5"})
    EXPECT_EQ(std::bit_cast<std::uint32_t>(parse(text)), std::bit_cast<std::uint32_t>(std::strtof(text, nullptr)))
        << text;
  float value;
  for (const char* text : {"", "-", ".", "x", "\n1"})
    EXPECT_EQ(parse_float((text + std::string(64, '\n')).c_str(), value), nullptr) << text;
}

class MeshFileTest : public testing::Test {
 protected:
  IndexedMesh obj(std::string_view text, bool flip_v = true) { return read_obj(m_files.write("m.obj", text), flip_v); }
  IndexedMesh ply(std::string_view text) { return read_ply(m_files.write("m.ply", text), false); }
  std::string obj_error(std::string_view text) {
    return error_of<MeshError>(m_files, [&] { obj(text); });
  }
  std::string ply_error(std::string_view text) {
    return error_of<MeshError>(m_files, [&] { ply(text); });
  }
  TemporaryFiles m_files;
};

TEST_F(MeshFileTest, ObjPolygonsAreFans) {
  const auto mesh = obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4 # a quad\nf 1 2\n");
  EXPECT_EQ(mesh.positions.size(), 4u);
  EXPECT_EQ(mesh.corner_position, (std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3}));
  EXPECT_TRUE(mesh.corner_uv.empty() && mesh.corner_normal.empty() && mesh.uvs.empty() && mesh.normals.empty());
}

TEST_F(MeshFileTest, ObjIndexForms) {
  const auto mesh = obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0.25 0.25\nvn 0 0 1\r\nf 1/1/1 2//1 3\r\nf -3/-1 -2 -1//-1\n");
  EXPECT_EQ(mesh.corner_position, (std::vector<std::uint32_t>{0, 1, 2, 0, 1, 2}));
  EXPECT_EQ(mesh.corner_uv, (std::vector<std::uint32_t>{0, kNoIndex, kNoIndex, 0, kNoIndex, kNoIndex}));
  EXPECT_EQ(mesh.corner_normal, (std::vector<std::uint32_t>{0, 0, kNoIndex, kNoIndex, kNoIndex, 0}));
  EXPECT_FLOAT_EQ(mesh.uvs.at(0).y, 0.75f);
  EXPECT_FLOAT_EQ(obj("v 0 0 0\nvt 0 0.25\nf 1/1 1/1 1/1", false).uvs.at(0).y, 0.25f);  // no line feed at the end
}

TEST_F(MeshFileTest, ObjNumberedAlikeNeedsNoCornerIndices) {
  const auto mesh = obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\n");
  EXPECT_TRUE(mesh.corner_uv.empty());
  EXPECT_EQ(mesh.uvs.size(), 3u);
}

TEST_F(MeshFileTest, ObjErrorsNameTheLine) {
  EXPECT_EQ(obj_error("v 0 0 0\nf 1 2 1\n"), "m.obj:2: a face refers to vertex 2, but there are only 1 before it");
  EXPECT_EQ(obj_error("v 0 0 0\nf 1 -2 1\n"), "m.obj:2: a face refers to vertex -2, but there are only 1 before it");
  EXPECT_EQ(obj_error("v 0 0 0\nf 0 1 1\n"), "m.obj:2: a face refers to vertex 0, but there are only 1 before it");
  EXPECT_EQ(obj_error("v 0 0 0\nf 1/1 1/1 1/1\n"),
            "m.obj:2: a face refers to texture coordinate 1, but there are only 0 before it");
  EXPECT_EQ(obj_error("v 0 0 0\n\nv 1 nan 0\n"), "m.obj:3: a vertex has a number that is not finite");
  EXPECT_EQ(obj_error("v 0 0\nv 1 0 0\n"), "m.obj:1: a vertex needs 3 numbers");
  EXPECT_EQ(obj_error("v 0 0 0\nf 1 1 x\n"), "m.obj:2: a face needs indices like 1, 1/2, 1//3 or 1/2/3");
  EXPECT_EQ(obj_error("v 0 0 0\nf 1 1 1;\n"), "m.obj:2: unexpected \";\" in a face");
  EXPECT_NE(error_of<MeshError>(m_files, [&] { read_obj(m_files.folder() / "no.obj", true); }).find("No such file"),
            std::string::npos);
}

constexpr std::string_view kAsciiPly =
    "ply\nformat ascii 1.0\ncomment x\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "property double s\nproperty double t\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0.5 0 0.25\n4 0 1 2 3\n";

template <class T>
void put(std::string& bytes, T value, bool big) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  if (big) std::reverse(raw, raw + sizeof(T));
  bytes.append(raw, sizeof(T));
}

std::string binary_ply(bool big) {
  std::string bytes(kAsciiPly.substr(0, kAsciiPly.find("end_header\n") + 11));
  bytes.replace(bytes.find("ascii"), 5, big ? "binary_big_endian" : "binary_little_endian");
  const double vertices[4][5] = {{0, 0, 0, 0, 0}, {1, 0, 0, 1, 0}, {1, 1, 0, 1, 1}, {0, 1, 0.5, 0, 0.25}};
  for (const auto& v : vertices)
    for (int i = 0; i < 5; ++i) i < 3 ? put(bytes, static_cast<float>(v[i]), big) : put(bytes, v[i], big);
  put(bytes, std::uint8_t{4}, big);
  for (const int i : {0, 1, 2, 3}) put(bytes, i, big);
  return bytes;
}

TEST_F(MeshFileTest, PlyIsTheSameInAllFormats) {
  const auto ascii = ply(kAsciiPly);
  EXPECT_EQ(ascii.corner_position, (std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3}));
  EXPECT_EQ(ascii.positions.at(3), Vec3(0, 1, 0.5f));
  EXPECT_EQ(ascii.uvs.at(3), Vec2(0, 0.25f));
  for (const bool big : {false, true}) {
    const auto binary = ply(binary_ply(big));
    EXPECT_EQ(binary.positions, ascii.positions);
    EXPECT_EQ(binary.uvs, ascii.uvs);
    EXPECT_EQ(binary.corner_position, ascii.corner_position);
  }
}

TEST_F(MeshFileTest, PlyErrors) {
  const auto replaced = [](std::string text, std::string_view what, std::string_view by) {
    return text.replace(text.find(what), what.size(), by);
  };
  const std::string good(kAsciiPly);
  EXPECT_EQ(ply_error("solid x\n"), "m.ply:1: is no PLY file: it does not start with \"ply\"");
  EXPECT_EQ(ply_error(replaced(good, "4 0 1 2 3", "3 0 1 9")), "m.ply:17: face 0 refers to vertex 9, but there are 4");
  EXPECT_EQ(ply_error(replaced(good, "0 1 0.5", "0 inf 0.5")), "m.ply:16: vertex 3 is not finite");
  EXPECT_EQ(ply_error(replaced(good, "1 1 0 1 1", "1 1 zero 1 1")), "m.ply:15: expected a number");
  EXPECT_EQ(ply_error(replaced(good, "property float x", "property flat x")), "m.ply:5: unknown type \"flat\"");
  EXPECT_EQ(ply_error(replaced(good, "property float z\n", "")), "m.ply:12: the vertices lack x, y or z");
  EXPECT_EQ(ply_error(good.substr(0, good.size() - 8)), "m.ply:17: the file ends too early");
  EXPECT_EQ(ply_error(replaced(good, "vertex 4", "vertex 4000000000")),
            "m.ply:13: the file ends too early: it announces 4000000000 of \"vertex\"");
  const std::string binary = binary_ply(false);
  EXPECT_EQ(ply_error(std::string_view(binary).substr(0, binary.size() - 1)), "m.ply: the file ends too early");
}

/// A .serialized file of version 4: a triangle with normals and, in the second mesh, double precision.
std::string serialized_file(std::uint32_t last_index = 2) {
  std::string file;
  std::vector<std::uint64_t> offsets;
  for (const bool wide : {false, true}) {
    offsets.push_back(file.size());
    std::string body;
    put(body, std::uint32_t{wide ? 0x2000u | 2u : 0x1000u | 1u | 0x10u}, false);
    body += std::string("name\0", 5);
    put(body, std::uint64_t{3}, false);
    put(body, std::uint64_t{1}, false);
    const auto number = [&](double x) { wide ? put(body, x, false) : put(body, static_cast<float>(x), false); };
    for (const double x : {0, 0, 0, 1, 0, 0, 0, 1, wide ? 2 : 0}) number(x);
    if (wide)
      for (const double x : {0.0, 0.0, 1.0, 0.0, 0.0, 0.5}) number(x);
    else
      for (int i = 0; i < 3; ++i) number(0), number(0), number(1);
    for (const std::uint32_t i : {0u, 1u, last_index}) put(body, i, false);
    put(file, std::uint16_t{0x041c}, false);
    put(file, std::uint16_t{4}, false);
    uLongf size = compressBound(body.size());
    std::string packed(size, '\0');
    compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(body.data()), body.size());
    file += packed.substr(0, size);
  }
  for (const auto offset : offsets) put(file, offset, false);
  put(file, std::uint32_t{2}, false);
  return file;
}

TEST_F(MeshFileTest, SerializedMeshesByIndex) {
  const auto path = m_files.write("m.serialized", serialized_file());
  const auto first = read_serialized(path, 0), second = read_serialized(path, 1);
  EXPECT_TRUE(first.face_normals);
  EXPECT_EQ(first.mesh.normals, std::vector<Vec3>(3, Vec3(0, 0, 1)));
  EXPECT_FALSE(second.face_normals);
  EXPECT_EQ(second.mesh.positions.at(2), Vec3(0, 1, 2));
  EXPECT_EQ(second.mesh.uvs.at(2), Vec2(0, 0.5f));
  EXPECT_EQ(second.mesh.corner_position, (std::vector<std::uint32_t>{0, 1, 2}));
}

TEST_F(MeshFileTest, SerializedErrors) {
  const auto error = [&](std::string_view bytes, int index) {
    const auto path = m_files.write("m.serialized", bytes);
    return error_of<MeshError>(m_files, [&] { read_serialized(path, index); });
  };
  EXPECT_EQ(error("not serialized", 0), "m.serialized: is no Mitsuba .serialized file");
  EXPECT_EQ(error(serialized_file(), 2), "m.serialized: shape_index is 2, but the file has 2 meshes, from 0");
  EXPECT_EQ(error(serialized_file(7), 0), "m.serialized: triangle 0 refers to vertex 7, but there are 3");
  EXPECT_EQ(error(serialized_file().substr(0, 24), 0), "m.serialized: the file ends too early");
  std::string broken = serialized_file();
  broken[4] = 0x11;
  EXPECT_EQ(error(broken, 0), "m.serialized: the compressed data are broken");
}

/// Broken copies of a file: cut short, or with some bytes changed. Fixed seed: the same copies each time.
template <class Read>
void expect_mesh_or_error(const TemporaryFiles& files, const std::string& good, Read&& read) {
  std::mt19937 random(7);
  for (int i = 0; i < 1000; ++i) {
    std::string bytes = good;
    if (i % 3 == 0) bytes.resize(random() % (good.size() + 1));
    for (int k = i % 4; k > 0 && !bytes.empty(); --k) {
      constexpr std::string_view kLikely = "0123456789-./ \n\xff";
      bytes[random() % bytes.size()] = random() % 2 ? kLikely[random() % kLikely.size()] : static_cast<char>(random());
    }
    const auto path = files.write("broken", bytes);
    try {
      const IndexedMesh mesh = read(path);
      for (const std::uint32_t index : mesh.corner_position) ASSERT_LT(index, mesh.positions.size());
      for (const std::uint32_t index : mesh.corner_uv) ASSERT_TRUE(index == kNoIndex || index < mesh.uvs.size());
      for (const Vec3& p : mesh.positions) ASSERT_TRUE(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
    } catch (const MeshError&) {
    }
  }
}

TEST_F(MeshFileTest, BrokenFilesGiveAMeshOrAnError) {
  expect_mesh_or_error(m_files, "v 0 0 0\nv 1 0 0.5e1\nv -1 1 0\nvt 0 1\nvn 0 0 1\nf 1/1/1 2//1 3\nf -1 -2 -3 1\n",
                       [](const auto& path) { return read_obj(path, true); });
  for (const std::string& good : {std::string(kAsciiPly), binary_ply(false), binary_ply(true)})
    expect_mesh_or_error(m_files, good, [](const auto& path) { return read_ply(path, false); });
  for (const int index : {0, 1})
    expect_mesh_or_error(m_files, serialized_file(),
                         [&](const auto& path) { return read_serialized(path, index).mesh; });
}

}  // namespace
}  // namespace warpath
