#include "tracer/embree_scene.h"

#include <embree3/rtcore.h>

#include <cstring>

#include "tracer/sampling.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr unsigned kWidth = 16;

void on_error(void*, RTCError code, const char* text) {
  throw InternalError(fmt::format("Embree failed with error {}: {}", static_cast<int>(code), text ? text : ""));
}

void bounds_of(const RTCBoundsFunctionArguments* args) {
  const auto& shape = *static_cast<const AnalyticShape*>(args->geometryUserPtr);
  const auto b = shape.bounds(static_cast<float>(args->timeStep));
  *args->bounds_o = {b.lower.x, b.lower.y, b.lower.z, 0, b.upper.x, b.upper.y, b.upper.z, 0};
}

void intersect_analytic(const RTCIntersectFunctionNArguments* args) {
  const auto& shape = *static_cast<const AnalyticShape*>(args->geometryUserPtr);
  const unsigned n = args->N;
  RTCRayN* ray = RTCRayHitN_RayN(args->rayhit, n);
  RTCHitN* hit = RTCRayHitN_HitN(args->rayhit, n);
  for (unsigned i = 0; i < n; ++i) {
    if (args->valid[i] == 0) continue;
    float t;
    if (!shape.intersect({RTCRayN_org_x(ray, n, i), RTCRayN_org_y(ray, n, i), RTCRayN_org_z(ray, n, i)},
                         {RTCRayN_dir_x(ray, n, i), RTCRayN_dir_y(ray, n, i), RTCRayN_dir_z(ray, n, i)},
                         RTCRayN_time(ray, n, i), RTCRayN_tnear(ray, n, i), RTCRayN_tfar(ray, n, i), t))
      continue;
    RTCRayN_tfar(ray, n, i) = t;
    RTCHitN_geomID(hit, n, i) = args->geomID;
    RTCHitN_primID(hit, n, i) = args->primID;
    RTCHitN_instID(hit, n, i, 0) = args->context->instID[0];
  }
}

void occluded_analytic(const RTCOccludedFunctionNArguments* args) {
  const auto& shape = *static_cast<const AnalyticShape*>(args->geometryUserPtr);
  const unsigned n = args->N;
  RTCRayN* ray = args->ray;
  for (unsigned i = 0; i < n; ++i) {
    if (args->valid[i] == 0) continue;
    float t;
    if (shape.intersect({RTCRayN_org_x(ray, n, i), RTCRayN_org_y(ray, n, i), RTCRayN_org_z(ray, n, i)},
                        {RTCRayN_dir_x(ray, n, i), RTCRayN_dir_y(ray, n, i), RTCRayN_dir_z(ray, n, i)},
                        RTCRayN_time(ray, n, i), RTCRayN_tnear(ray, n, i), RTCRayN_tfar(ray, n, i), t))
      RTCRayN_tfar(ray, n, i) = -std::numeric_limits<float>::infinity();
  }
}

// Copies between arrays and a packet; whole packets by a few instructions.
void copy(void* to, const void* from, unsigned n) {
  if (n == kWidth)
    std::memcpy(to, from, kWidth * sizeof(float));
  else
    std::memcpy(to, from, n * sizeof(float));
}

// Copies n <= kWidth rays into a packet; the lanes beyond are switched off.
void load_packet(const RayStream& rays, std::size_t first, unsigned n, int* valid, RTCRay16& packet) {
  copy(packet.org_x, rays.ox + first, n);
  copy(packet.org_y, rays.oy + first, n);
  copy(packet.org_z, rays.oz + first, n);
  copy(packet.dir_x, rays.dx + first, n);
  copy(packet.dir_y, rays.dy + first, n);
  copy(packet.dir_z, rays.dz + first, n);
  copy(packet.tfar, rays.t_max + first, n);
  copy(packet.time, rays.time + first, n);
  for (unsigned i = 0; i < kWidth; ++i) {
    valid[i] = i < n ? -1 : 0;
    packet.tnear[i] = 0;
    packet.mask[i] = ~0u;
    packet.flags[i] = 0;
    packet.id[i] = i;
  }
  // Without AVX-512 Embree takes packets of 16 apart and does not look at `valid` then, but at whether a ray is empty.
  for (unsigned i = n; i < kWidth; ++i) {
    packet.org_x[i] = packet.org_y[i] = packet.org_z[i] = 0;
    packet.dir_x[i] = packet.dir_y[i] = packet.dir_z[i] = 1;
    packet.tfar[i] = -1;
    packet.time[i] = 0;
  }
}

}  // namespace

struct EmbreeScene::Impl {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::vector<std::vector<Vec3>> rectangles;  // corners of both keyframes; 5 entries each, see Mesh::positions
  ~Impl() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }

  void add_triangles(unsigned id, std::span<const Vec3> start, std::span<const Vec3> end, const std::uint32_t* indices,
                     std::size_t triangles) {
    const std::size_t vertices = start.size() - 1;
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryTimeStepCount(geometry, end.empty() ? 1 : 2);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, start.data(), 0, sizeof(Vec3),
                               vertices);
    if (!end.empty())
      rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 1, RTC_FORMAT_FLOAT3, end.data(), 0, sizeof(Vec3),
                                 vertices);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, indices, 0,
                               3 * sizeof(std::uint32_t), triangles);
    attach(geometry, id);
  }

  void add_analytic(unsigned id, const AnalyticShape& shape) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, 1);
    rtcSetGeometryTimeStepCount(geometry, shape.moves() ? 2 : 1);
    rtcSetGeometryUserData(geometry, const_cast<AnalyticShape*>(&shape));
    rtcSetGeometryBoundsFunction(
        geometry, [](const RTCBoundsFunctionArguments* args) { bounds_of(args); }, nullptr);
    rtcSetGeometryIntersectFunction(geometry, intersect_analytic);
    rtcSetGeometryOccludedFunction(geometry, occluded_analytic);
    attach(geometry, id);
  }

  void attach(RTCGeometry geometry, unsigned id) {
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, id);
    rtcReleaseGeometry(geometry);
  }
};

EmbreeScene::EmbreeScene(std::span<const Shape> shapes, std::span<const AnalyticShape* const> analytic)
    : m_impl(std::make_unique<Impl>()) {
  static constexpr std::uint32_t kRectangleIndices[6] = {0, 1, 2, 1, 3, 2};
  Impl& impl = *m_impl;
  impl.device = rtcNewDevice(nullptr);
  if (!impl.device) on_error(nullptr, rtcGetDeviceError(nullptr), "no device");
  rtcSetDeviceErrorFunction(impl.device, on_error, nullptr);
  impl.scene = rtcNewScene(impl.device);
  rtcSetSceneBuildQuality(impl.scene, RTC_BUILD_QUALITY_MEDIUM);
  rtcSetSceneFlags(impl.scene, RTC_SCENE_FLAG_NONE);
  impl.rectangles.reserve(2 * shapes.size());

  for (unsigned id = 0; id < shapes.size(); ++id) {
    if (const auto* mesh = std::get_if<Mesh>(&shapes[id].geometry)) {
      if (mesh->triangle_count() > 0)
        impl.add_triangles(id, mesh->positions, mesh->positions_end, mesh->indices.data(), mesh->triangle_count());
    } else if (const auto* rectangle = std::get_if<Rectangle>(&shapes[id].geometry)) {
      const auto corners = [&](const Matrix4& m) -> const std::vector<Vec3>& {
        return impl.rectangles.emplace_back(
            std::vector<Vec3>{transform_point(m, {-1, -1, 0}), transform_point(m, {1, -1, 0}),
                              transform_point(m, {-1, 1, 0}), transform_point(m, {1, 1, 0}), Vec3(0)});
      };
      const auto& start = corners(rectangle->to_world[0]);
      std::span<const Vec3> end;
      if (rectangle->to_world[0] != rectangle->to_world[1]) end = corners(rectangle->to_world[1]);
      impl.add_triangles(id, start, end, kRectangleIndices, 2);
    } else {
      impl.add_analytic(id, *analytic[id]);
    }
  }
  rtcCommitScene(impl.scene);
}

EmbreeScene::~EmbreeScene() = default;

void EmbreeScene::intersect(const RayStream& rays, std::size_t n, const HitStream& hits, bool coherent) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  alignas(64) int valid[kWidth];
  RTCRayHit16 packet;
  for (std::size_t first = 0; first < n; first += kWidth) {
    const unsigned count = static_cast<unsigned>(std::min<std::size_t>(kWidth, n - first));
    load_packet(rays, first, count, valid, packet.ray);
    std::memset(packet.hit.geomID, 0xff, sizeof(packet.hit.geomID));
    std::memset(packet.hit.instID, 0xff, sizeof(packet.hit.instID));
    rtcIntersect16(valid, m_impl->scene, &context, &packet);
    copy(hits.t + first, packet.ray.tfar, count);
    copy(hits.u + first, packet.hit.u, count);
    copy(hits.v + first, packet.hit.v, count);
    copy(hits.nx + first, packet.hit.Ng_x, count);
    copy(hits.ny + first, packet.hit.Ng_y, count);
    copy(hits.nz + first, packet.hit.Ng_z, count);
    copy(hits.shape + first, packet.hit.geomID, count);
    copy(hits.primitive + first, packet.hit.primID, count);
  }
}

void EmbreeScene::occluded(const RayStream& rays, std::size_t n, std::uint8_t* occluded) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  constexpr std::size_t kStream = 256;
  alignas(64) RTCRay stream[kStream];
  for (std::size_t first = 0; first < n; first += kStream) {
    const std::size_t count = std::min(kStream, n - first);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t k = first + i;
      stream[i] = {rays.ox[k],
                   rays.oy[k],
                   rays.oz[k],
                   0,
                   rays.dx[k],
                   rays.dy[k],
                   rays.dz[k],
                   rays.time[k],
                   rays.t_max[k],
                   ~0u,
                   static_cast<unsigned>(i),
                   0};
    }
    rtcOccluded1M(m_impl->scene, &context, stream, static_cast<unsigned>(count), sizeof(RTCRay));
    for (std::size_t i = 0; i < count; ++i) occluded[first + i] = stream[i].tfar < 0;
  }
}

}  // namespace warpath
