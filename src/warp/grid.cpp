#include "warp/grid.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "warp/load.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr std::size_t kGuideCells = 4;  // for each interval

/// x, or the largest double below a positive `edge`: what falls into an interval stays below its upper edge.
double below(double x, double edge) { return x < edge ? x : std::nextafter(edge, 0.0); }

Matrix<double> identity_edges(int dims, int bins) {
  WARPATH_CHECK(dims >= 1 && bins >= 1);
  Matrix<double> edges(static_cast<std::size_t>(dims), static_cast<std::size_t>(bins) + 1);
  for (std::size_t d = 0; d < edges.rows(); ++d)
    for (std::size_t k = 0; k < edges.cols(); ++k) edges(d, k) = static_cast<double>(k) / bins;
  return edges;
}

bool well_formed(const Matrix<double>& edges) {
  for (std::size_t d = 0; d < edges.rows(); ++d) {
    const auto row = edges.batch().row(d);
    if (row.front() != 0.0 || row.back() != 1.0) return false;
    for (std::size_t k = 1; k < row.size(); ++k)
      if (!(row[k - 1] < row[k])) return false;  // NaN too
  }
  return true;
}

}  // namespace

Grid::Grid(int dims, int bins) : Grid(identity_edges(dims, bins)) {}

Grid::Grid(Matrix<double> edges) : m_edges(std::move(edges)) {
  WARPATH_CHECK(m_edges.rows() >= 1 && m_edges.rows() <= kMaxDims && m_edges.cols() >= 2);
  WARPATH_CHECK(well_formed(m_edges));
  m_log_slope = Matrix<double>(m_edges.rows(), m_edges.cols() - 1);
  for (std::size_t d = 0; d < m_log_slope.rows(); ++d)
    for (std::size_t k = 0; k < m_log_slope.cols(); ++k)
      m_log_slope(d, k) = std::log((m_edges(d, k + 1) - m_edges(d, k)) * bins());
  const std::size_t cells = kGuideCells * std::bit_ceil(m_log_slope.cols());
  m_guide = Matrix<std::uint32_t>(m_edges.rows(), cells + 1);
  for (std::size_t d = 0; d < m_guide.rows(); ++d) {
    std::size_t bin = 0;
    for (std::size_t cell = 0; cell <= cells; ++cell) {
      const double begin = static_cast<double>(cell) / static_cast<double>(cells);
      while (bin + 1 < m_log_slope.cols() && m_edges(d, bin + 1) <= begin) ++bin;
      m_guide(d, cell) = static_cast<std::uint32_t>(bin);
    }
  }
}

std::size_t Grid::bin_of(std::size_t d, double y) const {
  const std::size_t cells = m_guide.cols() - 1;
  const double scaled = y * static_cast<double>(cells);
  const std::size_t cell = scaled < static_cast<double>(cells) ? static_cast<std::size_t>(scaled) : cells - 1;
  const std::size_t low = m_guide(d, cell), high = m_guide(d, cell + 1);
  const double* const upper = &m_edges(d, low + 1);  // of the first interval that it may be
  return low + static_cast<std::size_t>(std::upper_bound(upper, upper + (high - low), y) - upper);
}

void Grid::forward(Batch<const double> z, Batch<double> y, std::span<double> log_det) const {
  const std::size_t dims = m_edges.rows(), bins = m_log_slope.cols();
  for (std::size_t i = 0; i < z.rows(); ++i) {
    double log_slopes = 0;
    for (std::size_t d = 0; d < dims; ++d) {
      const double scaled = z(i, d) * static_cast<double>(bins);
      const std::size_t bin = std::min(static_cast<std::size_t>(scaled), bins - 1);
      const double low = m_edges(d, bin), high = m_edges(d, bin + 1);
      y(i, d) = below(std::max(low + (scaled - static_cast<double>(bin)) * (high - low), low), high);
      log_slopes += m_log_slope(d, bin);
    }
    log_det[i] = log_slopes;
  }
}

void Grid::inverse(Batch<const double> y, Batch<double> z, std::span<double> log_det) const {
  const std::size_t dims = m_edges.rows();
  const double bins = this->bins();
  for (std::size_t i = 0; i < y.rows(); ++i) {
    double log_slopes = 0;
    for (std::size_t d = 0; d < dims; ++d) {
      const std::size_t bin = bin_of(d, y(i, d));
      const double low = m_edges(d, bin), high = m_edges(d, bin + 1);
      const double scaled = static_cast<double>(bin) + (y(i, d) - low) / (high - low);
      z(i, d) = below(scaled / bins, static_cast<double>(bin + 1) / bins);
      log_slopes += m_log_slope(d, bin);
    }
    log_det[i] = -log_slopes;
  }
}

void Grid::save(TensorFile& file, const std::string& prefix) const {
  save_header(file, prefix, *this);
  file.put<double>(prefix + "edges",
                   {static_cast<std::int64_t>(m_edges.rows()), static_cast<std::int64_t>(m_edges.cols())},
                   m_edges.values());
}

std::shared_ptr<const Grid> Grid::load(const TensorFile& file, const std::string& prefix) {
  const int dims = load_dims(file, prefix);
  auto stored = file.get<double>(prefix + "edges");
  if (stored.shape.size() != 2 || stored.shape[0] != dims || stored.shape[1] < 2)
    fail_load(file, prefix, fmt::format("its edges are {}, not {} x (bins + 1)", fmt::join(stored.shape, " x "), dims));
  Matrix<double> edges(static_cast<std::size_t>(stored.shape[0]), static_cast<std::size_t>(stored.shape[1]));
  edges.values() = std::move(stored.values);
  if (!well_formed(edges)) fail_load(file, prefix, "its edges do not increase from 0 to 1");
  return std::make_shared<Grid>(std::move(edges));
}

}  // namespace warpath
