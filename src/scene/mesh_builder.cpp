#include "scene/mesh_builder.h"

#include <algorithm>
#include <cmath>

#include "warpath/error.h"

namespace warpath {
namespace {

/// Vertices made from corners: which of the file's values each one has.
struct Welded {
  std::vector<std::uint32_t> indices;               // 3 per triangle
  std::vector<std::uint32_t> position, normal, uv;  // per vertex
};

/// One vertex for each combination of indices, in the order of first use. The vertices of a position form a chain,
/// which is as short as the number of seams that meet there.
Welded weld(const IndexedMesh& source) {
  Welded result;
  const std::size_t corners = source.corner_position.size();
  result.indices.resize(corners);
  std::vector<std::uint32_t> head(source.positions.size(), kNoIndex), next;
  const auto index_at = [&](const std::vector<std::uint32_t>& indices, const auto& values, std::size_t corner) {
    if (values.empty()) return kNoIndex;
    return indices.empty() ? source.corner_position[corner] : indices[corner];
  };
  for (std::size_t corner = 0; corner < corners; ++corner) {
    const std::uint32_t position = source.corner_position[corner];
    const std::uint32_t normal = index_at(source.corner_normal, source.normals, corner);
    const std::uint32_t uv = index_at(source.corner_uv, source.uvs, corner);
    std::uint32_t vertex = head[position];
    while (vertex != kNoIndex && (result.normal[vertex] != normal || result.uv[vertex] != uv)) vertex = next[vertex];
    if (vertex == kNoIndex) {
      vertex = static_cast<std::uint32_t>(result.position.size());
      result.position.push_back(position);
      result.normal.push_back(normal);
      result.uv.push_back(uv);
      next.push_back(head[position]);
      head[position] = vertex;
    }
    result.indices[corner] = vertex;
  }
  return result;
}

bool all_used(const IndexedMesh& source) {
  std::vector<bool> used(source.positions.size());
  for (const std::uint32_t index : source.corner_position) used[index] = true;
  return std::find(used.begin(), used.end(), false) == used.end();
}

float determinant3(const Matrix4& m) {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

/// The positions at one end of the motion, with the one more that Embree wants to read.
std::vector<Vec3> transformed(std::vector<Vec3> points, const Matrix4& m) {
  if (m != Matrix4())
    for (Vec3& p : points)
      p = Vec3(p.x * m[0][0] + p.y * m[1][0] + p.z * m[2][0] + m[3][0],
               p.x * m[0][1] + p.y * m[1][1] + p.z * m[2][1] + m[3][1],
               p.x * m[0][2] + p.y * m[1][2] + p.z * m[2][2] + m[3][2]);
  points.reserve(points.size() + 1);
  points.push_back(points.empty() ? Vec3(0.0f) : points.back());
  points.shrink_to_fit();
  return points;
}

/// Unit normals by the inverse transpose; those that are zero stay so.
std::vector<Vec3> transformed_normals(std::vector<Vec3> normals, const Matrix4& m, bool negate) {
  const Matrix4 inverse = m.inverse();
  const float sign = negate ? -1.0f : 1.0f;
  const bool identity = m == Matrix4();
  for (Vec3& n : normals) {
    if (!identity)
      n = Vec3(n.x * inverse[0][0] + n.y * inverse[0][1] + n.z * inverse[0][2],
               n.x * inverse[1][0] + n.y * inverse[1][1] + n.z * inverse[1][2],
               n.x * inverse[2][0] + n.y * inverse[2][1] + n.z * inverse[2][2]);
    const float length = std::sqrt(n.dot(n));
    n = length > 0 && std::isfinite(length) ? n * (sign / length) : Vec3(0.0f);
  }
  return normals;
}

/// Vertex normals from the triangles around each vertex.
std::vector<Vec3> smooth_normals(const std::vector<Vec3>& positions, const std::vector<std::uint32_t>& indices,
                                 std::size_t vertices) {
  std::vector<Vec3> sums(vertices, Vec3(0.0f));
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
    const std::uint32_t* corner = &indices[i];
    const Vec3 p[3] = {positions[corner[0]], positions[corner[1]], positions[corner[2]]};
    Vec3 n = (p[1] - p[0]).cross(p[2] - p[0]);
    const float length = std::sqrt(n.dot(n));
    if (!(length > 0) || !std::isfinite(length)) continue;
    n /= length;
    for (int k = 0; k < 3; ++k) {
      const Vec3 a = p[(k + 1) % 3] - p[k], b = p[(k + 2) % 3] - p[k];
      const Vec3 cross = a.cross(b);
      sums[corner[k]] += n * std::atan2(std::sqrt(cross.dot(cross)), a.dot(b));
    }
  }
  for (Vec3& n : sums) {
    const float length = std::sqrt(n.dot(n));
    n = length > 0 ? n / length : Vec3(1, 0, 0);  // nothing to go by: Mitsuba's choice
  }
  return sums;
}

/// Computes the normals that the file lacks, all of them or some.
void complete_normals(std::vector<Vec3>& normals, const std::vector<Vec3>& positions,
                      const std::vector<std::uint32_t>& indices) {
  const std::size_t vertices = positions.size() - 1;
  if (!normals.empty() && std::find(normals.begin(), normals.end(), Vec3(0.0f)) == normals.end()) return;
  auto smooth = smooth_normals(positions, indices, vertices);
  if (normals.empty()) {
    normals = std::move(smooth);
    return;
  }
  for (std::size_t v = 0; v < vertices; ++v)
    if (normals[v] == Vec3(0.0f)) normals[v] = smooth[v];
}

template <class T>
std::vector<T> gather(const std::vector<T>& values, const std::vector<std::uint32_t>& indices) {
  std::vector<T> result(indices.size(), T(0.0f));
  for (std::size_t i = 0; i < indices.size(); ++i)
    if (indices[i] != kNoIndex) result[i] = values[indices[i]];
  return result;
}

}  // namespace

Mesh build_mesh(IndexedMesh&& source, const MeshPlacement& placement) {
  if (placement.face_normals) {
    source.normals = {};
    source.corner_normal = {};
  }
  Mesh mesh;
  std::vector<Vec3> positions, normals;
  if (source.corner_normal.empty() && source.corner_uv.empty() && all_used(source)) {
    positions = std::move(source.positions);
    normals = std::move(source.normals);
    mesh.uvs = std::move(source.uvs);
    mesh.indices = std::move(source.corner_position);
  } else {
    Welded welded = weld(source);
    positions = gather(source.positions, welded.position);
    if (!source.normals.empty()) normals = gather(source.normals, welded.normal);
    if (!source.uvs.empty()) mesh.uvs = gather(source.uvs, welded.uv);
    mesh.indices = std::move(welded.indices);
  }
  for (Vec2& uv : mesh.uvs)
    if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) uv = Vec2(0.0f);  // nothing to look up there
  mesh.indices.shrink_to_fit();
  mesh.uvs.shrink_to_fit();

  const bool mirrored = determinant3(placement.to_world[0]) < 0;
  if ((mirrored && !normals.empty()) != placement.flip_normals)
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) std::swap(mesh.indices[i], mesh.indices[i + 2]);

  const auto place = [&](int end, std::vector<Vec3> local, std::vector<Vec3> local_normals, std::vector<Vec3>& world,
                         std::vector<Vec3>& world_normals) {
    world = transformed(std::move(local), placement.to_world[end]);
    if (placement.face_normals) return;
    world_normals = transformed_normals(std::move(local_normals), placement.to_world[end], placement.flip_normals);
    complete_normals(world_normals, world, mesh.indices);
    world_normals.shrink_to_fit();
  };
  if (placement.moving) place(1, positions, normals, mesh.positions_end, mesh.normals_end);
  place(0, std::move(positions), std::move(normals), mesh.positions, mesh.normals);
  return mesh;
}

IndexedMesh unit_cube() {
  // Of each side: the normal and four corners, counter-clockwise from outside. Bit k of a corner is the sign of axis k.
  struct Side {
    Vec3 normal;
    int corners[4];
  };
  const Side sides[6] = {{{0, -1, 0}, {1, 5, 4, 0}}, {{0, 1, 0}, {3, 2, 6, 7}},  {{1, 0, 0}, {1, 3, 7, 5}},
                         {{0, 0, 1}, {5, 7, 6, 4}},  {{-1, 0, 0}, {4, 6, 2, 0}}, {{0, 0, -1}, {3, 1, 0, 2}}};
  const Vec2 uvs[4] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  IndexedMesh mesh;
  for (std::uint32_t s = 0; s < 6; ++s) {
    for (int k = 0; k < 4; ++k) {
      const int c = sides[s].corners[k];
      mesh.positions.emplace_back(c & 1 ? 1.0f : -1.0f, c & 2 ? 1.0f : -1.0f, c & 4 ? 1.0f : -1.0f);
      mesh.normals.push_back(sides[s].normal);
      mesh.uvs.push_back(uvs[k]);
    }
    for (const std::uint32_t k : {0u, 1u, 2u, 3u, 0u, 2u}) mesh.corner_position.push_back(4 * s + k);
  }
  return mesh;
}

}  // namespace warpath
