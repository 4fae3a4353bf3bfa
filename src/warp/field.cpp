#include "warp/field.h"

#include <algorithm>
#include <bit>
#include <cmath>

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

Field::Field(FieldTree tree, FieldGrids grids, std::vector<SurfaceKind> kinds, std::vector<CumulativeProbability> light,
             std::vector<CumulativeProbability> scatter, std::vector<Returns> returns, Layout numbers)
    : m_tree(std::move(tree)),
      m_grids(std::move(grids)),
      m_kinds(std::move(kinds)),
      m_light(std::move(light)),
      m_scatter(std::move(scatter)),
      m_returns(std::move(returns)),
      m_numbers(std::move(numbers)) {
  WARPATH_CHECK_EQ(m_kinds.size(), m_tree.cells());
  WARPATH_CHECK_EQ(m_returns.size(), m_tree.cells());
  WARPATH_CHECK_EQ(m_light.size(), m_tree.cells() * m_grids.light.stored());
  WARPATH_CHECK_EQ(m_scatter.size(), m_tree.cells() * m_grids.diffuse.stored());
}

const CumulativeProbability* Field::density(VertexDecision which, std::uint32_t cell) const {
  if (cell == FieldTree::kNoCell) return nullptr;
  return which == VertexDecision::light_sampling ? m_light.data() + cell * m_grids.light.stored()
                                                 : m_scatter.data() + cell * m_grids.diffuse.stored();
}

void Field::locate(const VertexContext& context, std::size_t n, std::uint32_t* places) const {
  m_tree.find_cells(context, n, places);
}

void Field::sample(VertexDecision which, const VertexContext&, const std::uint32_t* places, std::size_t n,
                   const std::array<const double*, 3>& z, const std::array<float*, 3>& y, float* inv_q) const {
  constexpr std::size_t kBlock = 32;
  std::array<HalvingGrid::Walk, kBlock> walks;
  std::array<std::size_t, kBlock> vertex;
  for (std::size_t first = 0; first < n; first += kBlock) {
    const std::size_t end = std::min(n, first + kBlock);
    std::size_t count = 0;
    for (std::size_t i = first; i < end; ++i) {
      const std::uint32_t cell = places[i];
      if (cell == FieldTree::kNoCell) {
        for (std::size_t a = 0; a < 3; ++a) y[a][i] = to_primary(z[a][i]);
        inv_q[i] = 1;
        continue;
      }
      walks[count].start(m_grids.grid(which, m_kinds[cell]), density(which, cell), {z[0][i], z[1][i], z[2][i]});
      vertex[count++] = i;
    }
    // All grids of `which` are equally deep.
    for (bool more = count > 0; more;) {
      for (std::size_t k = 0; k < count; ++k) more = walks[k].step();
    }
    std::array<float, 3> drawn;
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = vertex[k];
      inv_q[i] = walks[k].finish(drawn);
      for (std::size_t a = 0; a < 3; ++a) y[a][i] = drawn[a];
    }
  }
}

void Field::inverse_density(VertexDecision which, const VertexContext&, const std::uint32_t* places, std::size_t n,
                            const std::array<const float*, 3>& y, float* inv_q) const {
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t cell = places[i];
    inv_q[i] = 1;
    if (cell == FieldTree::kNoCell) continue;
    const HalvingGrid& grid = m_grids.grid(which, m_kinds[cell]);
    inv_q[i] = grid.inverse_density(density(which, cell), grid.bin(y[0][i], y[1][i], y[2][i]));
  }
}

bool Field::expect_return(const std::uint32_t* places, std::size_t n, const float* inv_q, float* expected) const {
  for (std::size_t i = 0; i < n; ++i) {
    expected[i] = HUGE_VALF;
    if (places[i] == FieldTree::kNoCell) continue;
    const Return& cell = m_returns[places[i]].scatter;
    // The mean is of f, and f lies like the learned p, of which q = 1 + learned (p - 1): so f / q = mean p / q.
    const float p_over_q = cell.learned > 0 ? inv_q[i] + (1 - inv_q[i]) / cell.learned : inv_q[i];
    expected[i] = cell.mean * std::max(p_over_q, 0.0f);
  }
  return true;
}

void Field::save(TensorFile& file, const std::string& prefix) const {
  file.metadata()[prefix + "family"] = family();
  file.metadata()[prefix + "numbers"] = m_numbers.name();
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
  // As 32-bit numbers: the file format has no others that would do.
  const auto put = [&](const char* name, const std::vector<CumulativeProbability>& densities, std::size_t stored) {
    const std::vector<std::int32_t> values(densities.begin(), densities.end());
    file.put<std::int32_t>(prefix + name, {cells, static_cast<std::int64_t>(stored)}, values);
  };
  put("light", m_light, m_grids.light.stored());
  put("scatter", m_scatter, m_grids.diffuse.stored());
  std::vector<float> returns;
  for (const auto& [light, scatter] : m_returns)
    returns.insert(returns.end(), {light.mean, light.learned, scatter.mean, scatter.learned});
  file.put<float>(prefix + "returns", {cells, 4}, returns);
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
  const auto densities = [&](const char* name, std::size_t stored) {
    const auto values = file.get<std::int32_t>(prefix + name).values;
    if (kinds.size() != tree.cells() || values.size() != kinds.size() * stored)
      fail_load(file, prefix, "its cells and their densities do not fit each other");
    for (const std::int32_t p : values)
      if (p < 0 || p > kWholeProbability) fail_load(file, prefix, "a probability is not in [0,1]");
    return std::vector<CumulativeProbability>(values.begin(), values.end());
  };
  auto light = densities("light", grids.light.stored()), scatter = densities("scatter", grids.diffuse.stored());
  for (std::size_t c = 0; c < kinds.size(); ++c) {
    const auto is_density = [&](const HalvingGrid& grid, const std::vector<CumulativeProbability>& all) {
      return grid.is_density(std::span(all).subspan(c * grid.stored(), grid.stored()));
    };
    if (!is_density(grids.light, light) || !is_density(grids.grid(VertexDecision::scattering, kinds[c]), scatter))
      fail_load(file, prefix, "the probabilities of a cell do not add up");
  }
  const std::vector<float> stored = file.get<float>(prefix + "returns").values;
  if (stored.size() != 4 * kinds.size())
    fail_load(file, prefix, "its cells and what returns to them do not fit each other");
  std::vector<Returns> returns;
  for (std::size_t c = 0; c < kinds.size(); ++c) {
    const float* r = &stored[4 * c];
    returns.push_back({{r[0], r[1]}, {r[2], r[3]}});
    for (const Return& of : {returns.back().light, returns.back().scatter})
      if (!(std::isfinite(of.mean) && of.mean >= 0 && of.learned >= 0 && of.learned <= 1))
        fail_load(file, prefix, "what returns to a cell is not a sensible number");
  }
  return std::make_shared<Field>(std::move(tree), std::move(grids), std::move(kinds), std::move(light),
                                 std::move(scatter), std::move(returns), load_decisions(file, prefix));
}

}  // namespace warpath
