#include "warp/field.h"

#include <algorithm>
#include <bit>

#include "core/rng.h"
#include "core/tensor_file.h"
#include "warp/load.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr int kLightLevels = 8, kMinUvBits = 1;

/// Bits for the choice of a light and for the point on it: as fine a grid of points as the choice leaves room for.
std::array<int, 3> light_bits(int parts) {
  const int choice = std::bit_width(static_cast<unsigned>(parts - 1));
  const int uv = std::max(kMinUvBits, (kLightLevels - choice) / 2);
  return {choice, uv, uv};
}

/// More lights than this are chosen in groups.
constexpr int kMaxLightParts = 256;

int usable_parts(int light_parts) { return light_parts <= kMaxLightParts ? light_parts : kMaxLightParts; }

}  // namespace

FieldGrids::FieldGrids(int parts)
    : light_parts(usable_parts(parts)),
      light(light_bits(light_parts), light_parts),
      diffuse({0, 4, 4}),
      mixed({2, 3, 3}),
      delta({4, 2, 2}) {}

Field::Field(FieldTree tree, FieldGrids grids, std::vector<SurfaceKind> kinds, std::vector<float> light_left,
             std::vector<float> scatter_left)
    : m_tree(std::move(tree)),
      m_grids(std::move(grids)),
      m_kinds(std::move(kinds)),
      m_light_left(std::move(light_left)),
      m_scatter_left(std::move(scatter_left)) {
  WARPATH_CHECK_EQ(m_kinds.size(), m_tree.cells());
  WARPATH_CHECK_EQ(m_light_left.size(), std::size_t{m_tree.cells()} * m_grids.light.bins());
  WARPATH_CHECK_EQ(m_scatter_left.size(), std::size_t{m_tree.cells()} * m_grids.diffuse.bins());
}

const float* Field::density(VertexNumbers which, std::uint32_t cell) const {
  return which == VertexNumbers::light ? m_light_left.data() + std::size_t{cell} * m_grids.light.bins()
                                       : m_scatter_left.data() + std::size_t{cell} * m_grids.diffuse.bins();
}

void Field::sample(VertexNumbers which, const VertexContext& context, std::size_t n,
                   const std::array<const double*, 3>& z, const std::array<float*, 3>& y, float* inv_q) const {
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t cell = m_tree.cell(FieldTree::root_key(context, i), FieldTree::features(context, i));
    const std::array<double, 3> latent{z[0][i], z[1][i], z[2][i]};
    std::array<float, 3> drawn{to_primary(latent[0]), to_primary(latent[1]), to_primary(latent[2])};
    inv_q[i] = 1;
    if (cell != FieldTree::kNoCell)
      inv_q[i] = m_grids.grid(which, m_kinds[cell]).sample(density(which, cell), latent, drawn);
    for (std::size_t a = 0; a < 3; ++a) y[a][i] = drawn[a];
  }
}

void Field::inverse_density(VertexNumbers which, const VertexContext& context, std::size_t n,
                            const std::array<const float*, 3>& y, float* inv_q) const {
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t cell = m_tree.cell(FieldTree::root_key(context, i), FieldTree::features(context, i));
    inv_q[i] = 1;
    if (cell == FieldTree::kNoCell) continue;
    const HalvingGrid& grid = m_grids.grid(which, m_kinds[cell]);
    inv_q[i] = grid.inverse_density(density(which, cell), grid.bin(y[0][i], y[1][i], y[2][i]));
  }
}

void Field::save(TensorFile& file, const std::string& prefix) const {
  file.metadata()[prefix + "family"] = family();
  file.metadata()[prefix + "light_parts"] = std::to_string(m_grids.light_parts);
  const FieldTree::Flat flat = m_tree.flat();
  const auto size = [](const auto& values) { return static_cast<std::int64_t>(values.size()); };
  const std::int64_t cells = m_tree.cells();
  file.put<std::int32_t>(prefix + "roots", {size(flat.roots)}, flat.roots);
  file.put<std::int32_t>(prefix + "nodes", {size(flat.splits), 2}, flat.nodes);
  file.put<float>(prefix + "splits", {size(flat.splits)}, flat.splits);
  std::vector<std::uint8_t> kinds;
  for (const SurfaceKind kind : m_kinds) kinds.push_back(static_cast<std::uint8_t>(kind));
  file.put<std::uint8_t>(prefix + "kinds", {cells}, kinds);
  file.put<float>(prefix + "light", {cells, m_grids.light.bins()}, m_light_left);
  file.put<float>(prefix + "scatter", {cells, m_grids.diffuse.bins()}, m_scatter_left);
}

std::shared_ptr<const Field> Field::load(const TensorFile& file, const std::string& prefix) {
  int parts = 0;
  try {
    parts = std::stoi(file.meta(prefix + "light_parts"));
  } catch (const std::logic_error&) {
  }
  if (parts < 1 || parts > kMaxLightParts) fail_load(file, prefix, "light_parts is not a sensible number");
  FieldTree tree;
  const FieldTree::Flat flat{file.get<std::int32_t>(prefix + "roots").values,
                             file.get<std::int32_t>(prefix + "nodes").values,
                             file.get<float>(prefix + "splits").values};
  if (!FieldTree::from_flat(flat, tree)) fail_load(file, prefix, "its nodes are not a tree");
  FieldGrids grids(parts);
  std::vector<SurfaceKind> kinds;
  for (const std::uint8_t kind : file.get<std::uint8_t>(prefix + "kinds").values)
    kinds.push_back(static_cast<SurfaceKind>(kind));
  auto light = file.get<float>(prefix + "light").values, scatter = file.get<float>(prefix + "scatter").values;
  if (kinds.size() != tree.cells() || light.size() != kinds.size() * grids.light.bins() ||
      scatter.size() != kinds.size() * grids.diffuse.bins())
    fail_load(file, prefix, "its cells and their densities do not fit each other");
  for (const auto* values : {&light, &scatter})
    for (const float p : *values)
      if (!(p >= 0 && p <= 1)) fail_load(file, prefix, "a probability is not in [0,1]");
  return std::make_shared<Field>(std::move(tree), std::move(grids), std::move(kinds), std::move(light),
                                 std::move(scatter));
}

}  // namespace warpath
