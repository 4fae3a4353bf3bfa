#pragma once
#include <array>
#include <vector>

#include "scene/scene.h"
#include "tracer/lobe_model.h"
#include "tracer/texture_lookup.h"

namespace warpath {

/// A BSDF of the scene, ready to be resolved at a point. A lobe, or a node that nests others.
struct MaterialNode {
  enum class Type : std::uint8_t { lobe, two_sided, mask, blend, bump_map, normal_map };
  Type type = Type::lobe;
  bool flip_invalid_normals = true, shadowed = true;  ///< maps
  bool needs_tangents = false, needs_uv = false;      ///< of all below
  bool anisotropic = false;                           ///< a lobe or map below follows the tangent
  bool follows_tangent = false;                       ///< maps: what they nest is anisotropic
  bool tangent_frame = false;                         ///< a lobe below, not under a map, follows the tangent
  bool turns_to_wi = false;                           ///< every lobe below, not under a map, is twosided or null
  bool smooth = false;                                ///< lobe: light sampling can make its directions
  std::uint8_t colors = 0;                            ///< lobe: how many of its textures are looked up as colours
  std::uint16_t model = 0;                            ///< lobe: index into CompiledMaterials::models
  std::int32_t children[2]{-1, -1};
  TextureId texture = -1;                   ///< opacity, weight, displacement or normalmap
  float scale = 1;                          ///< bump_map
  std::array<TextureId, 11> values{};       ///< lobe: its textures, those of colours first; -1 for 0
  std::array<TextureId, 2> images{-1, -1};  ///< bitmaps below, the first that at() looks up; worth prefetching
  // What the worst path through it needs of a Scatter.
  int lobes = 1, value_count = 0, perturbed = 0;
};

struct CompiledMaterials {
  TextureLookup textures;
  std::vector<LobeModel> models;    ///< [0] is the null lobe
  std::vector<MaterialNode> nodes;  ///< one per BSDF of the scene, same index
};

/// Throws SceneError if a BSDF nests itself or more than a Scatter can hold.
CompiledMaterials compile_materials(const Scene& scene);

}  // namespace warpath
