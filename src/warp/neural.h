#pragma once
#include <memory>

#include "warp/vertex_network.h"
#include "warp/vertex_numbers.h"

namespace warpath {

/// A field of densities in world space that a small network corrects by what the path knows at each vertex: see
/// VertexNetwork. The field tells places apart, the network carries over what many of them have in common, and what
/// varies within a cell.
class Neural final : public VertexWarp {
 public:
  /// field: its grids are those of the network. parameters: network->parameter_count(). numbers: those that it draws,
  /// see check_vertex_numbers; empty for those of every vertex.
  Neural(std::shared_ptr<const Field> field, std::shared_ptr<const VertexNetwork> network, const VertexBox& box,
         nn::AlignedVector<float> parameters, Layout numbers = {});

  std::string family() const override { return "neural"; }
  bool warps(VertexNumbers which, std::uint16_t bounce) const override {
    return holds_vertex_numbers(m_numbers, which, bounce);
  }
  const Layout& numbers() const { return m_numbers; }
  /// A place is the cell and the features of a vertex.
  std::size_t place_size() const override { return 1 + kNodeFeatures; }
  void locate(const VertexContext& context, std::size_t n, std::uint32_t* places) const override;
  void sample(VertexNumbers which, const VertexContext& context, const std::uint32_t* places, std::size_t n,
              const std::array<const double*, 3>& z, const std::array<float*, 3>& y, float* inv_q) const override;
  void inverse_density(VertexNumbers which, const VertexContext& context, const std::uint32_t* places, std::size_t n,
                       const std::array<const float*, 3>& y, float* inv_q) const override;
  bool expect_return(const std::uint32_t* places, std::size_t n, const float* inv_q, float* expected) const override;
  void save(TensorFile& file, const std::string& prefix) const override;
  /// Throws FileError.
  static std::shared_ptr<const Neural> load(const TensorFile& file, const std::string& prefix);

 private:
  std::shared_ptr<const Field> m_field;
  std::shared_ptr<const VertexNetwork> m_network;
  VertexBox m_box;
  nn::AlignedVector<float> m_parameters, m_packed;
  Layout m_numbers;
};

}  // namespace warpath
