#pragma once
#include <cstdint>

#include "warp/proposal.h"

namespace warpath {

/// VEGAS's separable map (Lepage 1978): in each dimension a piecewise linear, increasing map of [0,1) onto itself whose
/// intervals all have the same share of z. q is the product of one histogram per dimension.
class Grid : public Warp {
 public:
  /// edges: D x (bins + 1), each row strictly increasing from 0 to 1.
  explicit Grid(Matrix<double> edges);
  /// The identity.
  Grid(int dims, int bins);

  int dims() const override { return static_cast<int>(m_edges.rows()); }
  int bins() const { return static_cast<int>(m_edges.cols()) - 1; }
  const Matrix<double>& edges() const { return m_edges; }
  std::string family() const override { return "grid"; }
  void forward(Batch<const double> z, Batch<double> y, std::span<double> log_det) const override;
  void inverse(Batch<const double> y, Batch<double> z, std::span<double> log_det) const override;
  void save(TensorFile& file, const std::string& prefix) const override;
  static std::shared_ptr<const Grid> load(const TensorFile& file, const std::string& prefix);

 private:
  /// The interval of dimension d in which y falls.
  std::size_t bin_of(std::size_t d, double y) const;

  Matrix<double> m_edges;
  /// D x (cells + 1), cells a power of two: the interval in which each of so many equal cells of [0,1) begins. What
  /// falls into a cell lies between it and the next, mostly in the same: no search.
  Matrix<std::uint32_t> m_guide;
  Matrix<double> m_log_slope;  ///< D x bins, ln dy/dz
};

}  // namespace warpath
