#include "tracer/material_compile.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <tuple>

#include "tracer/fresnel.h"
#include "tracer/scatter.h"
#include "warpath/error.h"

namespace warpath {

namespace {

using Type = MaterialNode::Type;

class Compiler {
 public:
  explicit Compiler(const Scene& scene) : m_scene(scene), m_state(scene.bsdfs.size(), State::open) {
    // An extra texture stands for reflectances that the scene leaves out.
    std::vector<Texture> textures = scene.textures;
    m_white = static_cast<TextureId>(textures.size());
    textures.emplace_back(ConstantTexture{Color(1.0f)});
    m_result.textures = TextureLookup(textures);
    m_result.nodes.resize(scene.bsdfs.size());
    m_result.models.emplace_back();  // the null lobe of masks
  }

  CompiledMaterials compile() {
    for (std::size_t i = 0; i < m_scene.bsdfs.size(); ++i) node(static_cast<BsdfId>(i));
    return std::move(m_result);
  }

 private:
  enum class State : std::uint8_t { open, busy, done };

  const MaterialNode& node(BsdfId id) {
    WARPATH_CHECK(id >= 0 && static_cast<std::size_t>(id) < m_state.size());
    MaterialNode& n = m_result.nodes[id];
    if (m_state[id] == State::done) return n;
    if (m_state[id] == State::busy) throw SceneError(prefix(id) + "nests itself");
    m_state[id] = State::busy;
    std::visit([&](const auto& model) { set(n, model); }, m_scene.bsdfs[id].model);
    if (n.lobes > Scatter::kMaxLobes || n.value_count > Scatter::kMaxValues || n.perturbed > Scatter::kMaxPerturbed)
      throw SceneError(fmt::format(
          "{}nests too much: {} lobes with {} parameters under {} bump or normal maps, where at most {}, {} and {} are "
          "supported; take a blend or a map away",
          prefix(id), n.lobes, n.value_count, n.perturbed, Scatter::kMaxLobes, Scatter::kMaxValues,
          Scatter::kMaxPerturbed));
    m_state[id] = State::done;
    return n;
  }

  std::string prefix(BsdfId id) const {
    return fmt::format("{}: bsdf \"{}\" ", m_scene.file.string(), m_scene.bsdfs[id].id);
  }

  TextureId or_white(TextureId id) const { return id < 0 ? m_white : id; }

  /// Makes n a lobe with these textures, three numbers each for the first `colors` and one each for the rest.
  LobeModel& lobe(MaterialNode& n, LobeType type, std::initializer_list<TextureId> textures, int colors) {
    WARPATH_CHECK(m_result.models.size() < 65536);
    n.type = Type::lobe;
    n.model = static_cast<std::uint16_t>(m_result.models.size());
    n.value_count = 3 * colors + static_cast<int>(textures.size()) - colors;
    std::copy(textures.begin(), textures.end(), n.values.begin());
    for (const TextureId t : textures) uses(n, t);
    LobeModel& m = m_result.models.emplace_back();
    m.type = type;
    return m;
  }

  void uses(MaterialNode& n, TextureId t) const {
    WARPATH_CHECK(t >= 0 && static_cast<std::size_t>(t) < m_result.textures.size());
    if (m_result.textures.is_constant(t)) return;
    n.needs_uv = true;
    add_image(n, t);
  }

  static void add_image(MaterialNode& n, TextureId t) {
    for (TextureId& image : n.images) {
      if (image < 0) image = t;
      if (image == t) return;
    }
  }

  void set(MaterialNode& n, const Diffuse& d) { lobe(n, LobeType::diffuse, {d.reflectance}, 1); }

  void set(MaterialNode& n, const Conductor& d) {
    LobeModel& m = lobe(n, LobeType::conductor, {or_white(d.specular_reflectance)}, 1);
    m.eta_conductor = d.eta;
    m.k = d.k;
  }

  void set(MaterialNode& n, const RoughConductor& d) {
    LobeModel& m = lobe(n, LobeType::rough_conductor, {or_white(d.specular_reflectance), d.alpha_u, d.alpha_v}, 1);
    m.eta_conductor = d.eta;
    m.k = d.k;
    m.distribution = d.distribution;
    m.sample_visible = d.sample_visible;
    n.needs_tangents = n.anisotropic = n.tangent_frame = d.alpha_u != d.alpha_v;
  }

  void set(MaterialNode& n, const Dielectric& d) {
    lobe(n, LobeType::dielectric, {or_white(d.specular_reflectance), or_white(d.specular_transmittance)}, 2).eta =
        d.eta;
  }

  void set(MaterialNode& n, const ThinDielectric& d) {
    lobe(n, LobeType::thin_dielectric, {or_white(d.specular_reflectance), or_white(d.specular_transmittance)}, 2).eta =
        d.eta;
  }

  void set(MaterialNode& n, const RoughDielectric& d) {
    LobeModel& m =
        lobe(n, LobeType::rough_dielectric,
             {or_white(d.specular_reflectance), or_white(d.specular_transmittance), d.alpha_u, d.alpha_v}, 2);
    m.eta = d.eta;
    m.distribution = d.distribution;
    m.sample_visible = d.sample_visible;
    n.needs_tangents = n.anisotropic = n.tangent_frame = d.alpha_u != d.alpha_v;
  }

  template <class P>
  LobeModel& plastic(MaterialNode& n, LobeType type, const P& d) {
    const TextureId specular = or_white(d.specular_reflectance);
    LobeModel& m = lobe(n, type, {d.diffuse_reflectance, specular}, 2);
    m.eta = d.eta;
    m.nonlinear = d.nonlinear;
    const float s = m_result.textures.mean(specular), sum = s + m_result.textures.mean(d.diffuse_reflectance);
    m.specular_sampling_weight = sum > 0 ? s / sum : 0.5f;
    return m;
  }

  void set(MaterialNode& n, const Plastic& d) {
    plastic(n, LobeType::plastic, d).internal_reflectance = fresnel_diffuse_reflectance(1 / d.eta);
  }

  void set(MaterialNode& n, const RoughPlastic& d) {
    LobeModel& m = plastic(n, LobeType::rough_plastic, d);
    m.distribution = d.distribution;
    m.sample_visible = d.sample_visible;
    m.alpha = std::max(d.alpha, 1e-4f);
    const auto key = std::tuple(d.distribution, m.alpha, d.eta);
    auto found = m_interfaces.find(key);
    if (found == m_interfaces.end())
      found = m_interfaces.emplace(key, make_rough_interface(d.distribution, m.alpha, d.eta)).first;
    m.transmittance = found->second.external_transmittance;
    m.internal_reflectance = found->second.internal_reflectance;
  }

  void set(MaterialNode& n, const Principled& d) {
    const auto& b = d;
    const TextureId black = b.roughness;  // any: a lobe that is left out is not looked up
    LobeModel& m = lobe(
        n, LobeType::principled,
        {b.base_color, b.roughness, b.has_anisotropic ? b.anisotropic : black, b.has_metallic ? b.metallic : black,
         b.has_spec_trans ? b.spec_trans : black, b.has_spec_tint ? b.spec_tint : black, b.has_sheen ? b.sheen : black,
         b.has_sheen_tint ? b.sheen_tint : black, b.has_flatness ? b.flatness : black,
         b.has_clearcoat ? b.clearcoat : black, b.has_clearcoat ? b.clearcoat_gloss : black},
        1);
    m.eta = d.eta;
    m.has_anisotropic = d.has_anisotropic;
    m.has_metallic = d.has_metallic;
    m.has_spec_trans = d.has_spec_trans;
    m.has_spec_tint = d.has_spec_tint;
    m.has_sheen = d.has_sheen;
    m.has_sheen_tint = d.has_sheen_tint;
    m.has_flatness = d.has_flatness;
    m.has_clearcoat = d.has_clearcoat;
    m.diffuse_rate = d.diffuse_reflectance_sampling_rate;
    m.specular_rate = d.main_specular_sampling_rate;
    m.clearcoat_rate = d.clearcoat_sampling_rate;
    n.needs_tangents = n.anisotropic = n.tangent_frame = d.has_anisotropic;
  }

  void set(MaterialNode& n, const Null&) {
    lobe(n, LobeType::null, {}, 0);
    n.turns_to_wi = true;
  }

  /// Takes over what a node has in common with those it nests; `both` if their lobes are there at the same time.
  void nest(MaterialNode& n, Type type, BsdfId first, BsdfId second, bool both) {
    const MaterialNode &a = node(first), &b = node(second);
    n.type = type;
    n.children[0] = first;
    n.children[1] = second;
    n.needs_tangents = a.needs_tangents || b.needs_tangents;
    n.needs_uv = a.needs_uv || b.needs_uv;
    for (const MaterialNode* child : {&a, &b})
      for (const TextureId t : child->images)
        if (t >= 0) add_image(n, t);
    n.anisotropic = a.anisotropic || b.anisotropic;
    n.tangent_frame = a.tangent_frame || b.tangent_frame;
    n.turns_to_wi = a.turns_to_wi && b.turns_to_wi;
    const auto join = [both](int x, int y) { return both ? x + y : std::max(x, y); };
    n.lobes = join(a.lobes, b.lobes);
    n.value_count = join(a.value_count, b.value_count);
    n.perturbed = join(a.perturbed, b.perturbed);
  }

  void set(MaterialNode& n, const TwoSided& d) {
    nest(n, Type::two_sided, d.front, d.back < 0 ? d.front : d.back, false);
    n.turns_to_wi = true;
  }
  void set(MaterialNode& n, const Mask& d) {
    nest(n, Type::mask, d.nested, d.nested, false);
    ++n.lobes;
    n.texture = d.opacity;
    uses(n, d.opacity);
  }
  void set(MaterialNode& n, const BlendBsdf& d) {
    nest(n, Type::blend, d.first, d.second, true);
    n.texture = d.weight;
    uses(n, d.weight);
  }
  template <class Map>
  void map(MaterialNode& n, Type type, const Map& d, TextureId texture) {
    nest(n, type, d.nested, d.nested, false);
    n.texture = texture;
    uses(n, texture);
    n.flip_invalid_normals = d.flip_invalid_normals;
    n.shadowed = d.use_shadowing_function;
    n.needs_tangents = true;
    n.tangent_frame = false;
    n.turns_to_wi = true;  // its lobes have a frame of their own
    n.follows_tangent = n.anisotropic;
    n.anisotropic = true;
    n.value_count += n.follows_tangent ? 6 : 3;
    ++n.perturbed;
  }
  void set(MaterialNode& n, const BumpMap& d) {
    map(n, Type::bump_map, d, d.displacement);
    n.scale = d.scale;
  }
  void set(MaterialNode& n, const NormalMap& d) { map(n, Type::normal_map, d, d.normalmap); }

  const Scene& m_scene;
  CompiledMaterials m_result;
  std::vector<State> m_state;
  TextureId m_white;
  std::map<std::tuple<MicrofacetType, float, float>, RoughInterface> m_interfaces;
};

}  // namespace

CompiledMaterials compile_materials(const Scene& scene) { return Compiler(scene).compile(); }

}  // namespace warpath
