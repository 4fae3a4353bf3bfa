#include "tracer/material.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "tracer/material_compile.h"
#include "tracer/plain_bsdf.h"
#include "tracer/scatter.h"

namespace warpath {

struct Materials::Impl {
  explicit Impl(const Scene& scene) : compiled(compile_materials(scene)) {
    for (const MaterialNode& node : compiled.nodes) plain.push_back(find_plain(node));
  }
  std::optional<PlainBsdf> find_plain(const MaterialNode& node) const;

  const CompiledMaterials compiled;
  std::vector<std::optional<PlainBsdf>> plain;  // one per BSDF of the scene
};

std::optional<PlainBsdf> Materials::Impl::find_plain(const MaterialNode& node) const {
  const bool two_sided = node.type == MaterialNode::Type::two_sided;
  if (two_sided && node.children[0] != node.children[1]) return {};
  const MaterialNode& n = two_sided ? compiled.nodes[node.children[0]] : node;
  if (n.type != MaterialNode::Type::lobe) return {};
  const auto& lobe = compiled.models[n.model].lobe;
  if (std::holds_alternative<Lobe<Diffuse>>(lobe)) return PlainBsdf{nullptr, n.values[0], Color(0.0f), two_sided};
  const auto* plastic = std::get_if<Lobe<RoughPlastic>>(&lobe);
  if (!plastic || !plastic->bsdf.sample_visible || !compiled.textures.is_constant(n.values[1])) return {};
  return PlainBsdf{plastic, n.values[0], compiled.textures.color(n.values[1], Vec2(0)), two_sided};
}

namespace {

using Type = MaterialNode::Type;

/// Fills a Scatter: walks down from a BSDF, with the share, frame and side that its lobes will have.
class Resolver {
 public:
  Resolver(const CompiledMaterials& materials, const SurfacePoint& point, Scatter& scatter)
      : m_materials(materials), m_point(point), m_scatter(scatter) {}

  void resolve(const MaterialNode& root) {
    const Vec3& n = m_point.ns;
    m_cos_theta_i = m_point.wi.dot(n);
    // Where every lobe turns towards wi the frame does, so that it does not depend on which way a triangle is wound.
    const bool behind = root.turns_to_wi && m_cos_theta_i < 0;
    if (root.tangent_frame) {
      m_scatter.frame = frame_of_tangent(n, m_point.dp_du, m_point.left_handed);
      if (behind) m_scatter.frame.n = -n;
    } else {
      m_scatter.frame = frame_of_normal(behind ? -n : n);
    }
    m_scatter.models = m_materials.models.data();
    m_scatter.wi = m_point.wi;
    m_scatter.lobe_count = m_scatter.value_count = m_scatter.perturbed_count = 0;
    m_scatter.smooth = false;
    m_base_turned = behind;
    walk(root, {1, 0, false});
  }

 private:
  struct Place {
    float weight;
    std::uint8_t frame;  ///< as ScatterLobe::frame
    bool behind;         ///< a twosided BSDF above looks at the frame's surface from behind
  };

  const MaterialNode& child(const MaterialNode& n, int i) const { return m_materials.nodes[n.children[i]]; }

  /// Whether what is at the place sees the surface from behind the frame as it is stored.
  bool mirrored(const Place& place) const { return place.behind != (place.frame == 0 && m_base_turned); }

  void walk(const MaterialNode& n, Place place) {
    switch (n.type) {
      case Type::lobe:
        add_lobe(n, place);
        break;
      case Type::two_sided: {
        const bool back = cos_theta_i(place) < 0;
        place.behind ^= back;
        walk(child(n, back), place);
        break;
      }
      case Type::blend: {
        // The second comes first: the lobe number chooses it below the weight, as in Mitsuba.
        const float w = clamp01(m_materials.textures.scalar(n.texture, m_point.uv));
        if (w > 0) walk(child(n, 1), {place.weight * w, place.frame, place.behind});
        if (w < 1) walk(child(n, 0), {place.weight * (1 - w), place.frame, place.behind});
        break;
      }
      case Type::mask: {
        const float opacity = clamp01(m_materials.textures.scalar(n.texture, m_point.uv));
        if (opacity > 0) walk(child(n, 0), {place.weight * opacity, place.frame, place.behind});
        if (opacity < 1) add_null({place.weight * (1 - opacity), place.frame, place.behind});
        break;
      }
      case Type::bump_map:
      case Type::normal_map:
        walk(child(n, 0), perturb(n, place));
        break;
    }
  }
  // walk() is never deeper than the scene nests, and no lobe is lost: compile_materials has checked the worst case.

  float cos_theta_i(const Place& place) const {
    const float c = place.frame == 0 ? m_cos_theta_i : m_point.wi.dot(scatter_normal(m_scatter, place.frame));
    return place.behind ? -c : c;
  }

  ScatterLobe& new_lobe(const Place& place) {
    ScatterLobe& l = m_scatter.lobes[m_scatter.lobe_count++];
    l.weight = place.weight;
    l.first_value = m_scatter.value_count;
    l.frame = place.frame;
    l.mirrored = mirrored(place);
    return l;
  }

  void add_null(const Place& place) { new_lobe(place).model = 0; }  // models[0] is the null lobe

  void add_lobe(const MaterialNode& n, const Place& place) {
    new_lobe(place).model = n.model;
    m_scatter.smooth |= n.smooth;
    const TextureId* texture = n.values.data();
    for (const TextureId* end = texture + n.colors; texture != end; ++texture) put_color(*texture);
    for (const TextureId* end = texture + n.value_count - 3 * n.colors; texture != end; ++texture) put_scalar(*texture);
  }

  void put(float x) { m_scatter.values[m_scatter.value_count++] = x; }
  void put(const Vec3& v) {
    for (int i = 0; i < 3; ++i) put(v[i]);
  }
  void put_color(TextureId t) {
    const Color c = m_materials.textures.color(t, m_point.uv);
    put(c.x);
    put(c.y);
    put(c.z);
  }
  void put_scalar(TextureId t) { put(t < 0 ? 0 : m_materials.textures.scalar(t, m_point.uv)); }

  /// The frame that a map starts from: along the tangents, not mirrored.
  Frame outer_frame(const Place& place) const {
    if (place.frame != 0) return scatter_frame(m_scatter, place.frame);
    return frame_of_tangent(m_point.ns, m_point.dp_du, m_point.left_handed);
  }

  /// Local normal of a map, relative to the outer frame as it is before any twosided BSDF mirrors it.
  Vec3 map_normal(const MaterialNode& n, const Frame& outer) const {
    if (n.type == Type::normal_map) {
      const Color c = m_materials.textures.color(n.texture, m_point.uv);
      return {2 * c.x - 1, 2 * c.y - 1, 2 * c.z - 1};
    }
    const Vec2 gradient = m_materials.textures.gradient(n.texture, m_point.uv) * n.scale;
    const Vec3 du = m_point.dp_du + outer.n * (gradient.x - outer.n.dot(m_point.dp_du));
    const Vec3 dv = m_point.dp_dv + outer.n * (gradient.y - outer.n.dot(m_point.dp_dv));
    Vec3 normal = du.cross(dv);
    if (normal.dot(m_point.ng) < 0) normal = -normal;
    return outer.to_local(normal);
  }

  Place perturb(const MaterialNode& n, const Place& place) {
    const Frame outer = outer_frame(place);
    Vec3 local = map_normal(n, outer);
    const float length2 = local.dot(local);
    if (!(length2 > 0) || !std::isfinite(length2)) local = {0, 0, 1};
    Frame frame = outer;
    if (place.behind) frame.n = -frame.n;
    if (n.flip_invalid_normals) {
      // The turned normal must face wi where the outer one does.
      const Vec3 wi = frame.to_local(m_point.wi);
      if (wi.z * wi.dot(local) <= 0) local = {-local.x, -local.y, local.z};
    }
    const Vec3 normal = frame.to_world(local).normalized();
    PerturbedFrame& p = m_scatter.perturbed[m_scatter.perturbed_count++];
    p.first_value = m_scatter.value_count;
    p.outer = place.frame;
    p.follows_tangent = n.follows_tangent;
    p.left_handed = frame.s.cross(frame.t).dot(frame.n) < 0;
    p.mirrored = mirrored(place);
    p.shadowed = n.shadowed;
    put(normal);
    if (n.follows_tangent) put(n.type == Type::bump_map ? m_point.dp_du : frame.s);
    return {place.weight, m_scatter.perturbed_count, false};
  }

  const CompiledMaterials& m_materials;
  const SurfacePoint& m_point;
  Scatter& m_scatter;
  float m_cos_theta_i = 0;
  bool m_base_turned = false;
};

}  // namespace

Materials::Materials(const Scene& scene) : m_impl(std::make_unique<const Impl>(scene)) {}
Materials::~Materials() = default;

bool Materials::needs_tangents(BsdfId bsdf) const { return m_impl->compiled.nodes[bsdf].needs_tangents; }
bool Materials::needs_uv(BsdfId bsdf) const { return m_impl->compiled.nodes[bsdf].needs_uv; }

void Materials::at(BsdfId bsdf, const SurfacePoint& point, Scatter& scatter) const {
  Resolver(m_impl->compiled, point, scatter).resolve(m_impl->compiled.nodes[bsdf]);
}

void Materials::prefetch(BsdfId bsdf, const Vec2& uv) const {
  for (const TextureId image : m_impl->compiled.nodes[bsdf].images)
    if (image >= 0) m_impl->compiled.textures.prefetch(image, uv);
}

const PlainBsdf* Materials::plain(BsdfId bsdf) const {
  const auto& plain = m_impl->plain[static_cast<std::size_t>(bsdf)];
  return plain ? &*plain : nullptr;
}
bool Materials::is_constant(TextureId id) const { return m_impl->compiled.textures.is_constant(id); }

Color Materials::texture(TextureId id, Vec2 uv) const { return m_impl->compiled.textures.color(id, uv); }

}  // namespace warpath
