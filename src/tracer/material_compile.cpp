#include "tracer/material_compile.h"

#include <fmt/format.h>

#include <algorithm>
#include <type_traits>

#include "tracer/scatter.h"
#include "warpath/error.h"

namespace warpath {

namespace {

using Type = MaterialNode::Type;

class Compiler {
 public:
  explicit Compiler(const Scene& scene)
      : m_scene(scene), m_result{TextureLookup(scene.textures), {}, {}}, m_state(scene.bsdfs.size(), State::open) {
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

  /// Makes n a lobe.
  template <class Bsdf>
  void set(MaterialNode& n, const Bsdf& bsdf) {
    WARPATH_CHECK(m_result.models.size() < 65536);
    using L = Lobe<Bsdf>;
    const L lobe(bsdf, m_context);
    const LobeInputs inputs = lobe.inputs();
    n.type = Type::lobe;
    n.smooth = !std::is_base_of_v<DeltaLobe, L>;
    n.model = static_cast<std::uint16_t>(m_result.models.size());
    n.colors = static_cast<std::uint8_t>(inputs.colors.size());
    n.value_count = kValueCount<L>;
    const std::size_t textures = inputs.colors.size() + inputs.numbers.size();
    WARPATH_CHECK(2 * inputs.colors.size() + textures == kValueCount<L> && textures <= n.values.size());
    std::copy(inputs.numbers.begin(), inputs.numbers.end(),
              std::copy(inputs.colors.begin(), inputs.colors.end(), n.values.begin()));
    for (std::size_t i = 0; i < textures; ++i)
      if (n.values[i] >= 0) uses(n, n.values[i]);
    n.needs_tangents = n.anisotropic = n.tangent_frame = inputs.tangent;
    n.turns_to_wi = std::is_same_v<Bsdf, Null>;
    m_result.models.push_back({lobe});
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
  LobeContext m_context{m_result.textures, {}};
};

}  // namespace

CompiledMaterials compile_materials(const Scene& scene) { return Compiler(scene).compile(); }

}  // namespace warpath
