#pragma once
#include <array>
#include <memory>

#include "warp/spline_flow.h"
#include "warp/vertex_decision.h"
#include "warp/vertex_encoding.h"

namespace warpath {

/// Spline flows over the numbers of a vertex [MMRGN19], given where on the film the path began and what it knows there
/// (encode_vertices): one for the numbers of light sampling, one for those of scattering. Of the first vertex alone it
/// is a warp conditioned on what the film shows. A share of uniform numbers keeps weights bounded.
class ConditionalSpline final : public VertexProposal {
 public:
  /// What the networks see and how they bend numbers.
  struct Shape {
    Shape(const SplineSettings& settings, int position_bins, int film_bins);
    spline::Flow flow;
    int position_bins, film_bins;  ///< of one-blob encodings
    /// Encodes some vertices, at most nn::kBlock; x: flow.context_rows() x kBlock, aligned to nn::kAlignment.
    void encode(const VertexBox& box, const VertexContext& context, std::span<const std::uint32_t> vertices,
                float* x) const;
  };
  /// parameters: of the flow, for the numbers of light sampling and of scattering. uniform: in [0,1). numbers: those
  /// that it draws, see check_decisions.
  ConditionalSpline(std::shared_ptr<const Shape> shape, const VertexBox& box,
                    std::array<nn::AlignedVector<float>, 2> parameters, double uniform, Layout numbers);

  std::string family() const override { return "conditional-spline"; }
  bool warps(VertexDecision which, std::uint16_t bounce) const override {
    return holds_decision(m_numbers, which, bounce);
  }
  const Layout& numbers() const override { return m_numbers; }
  /// There is nothing to find out beforehand.
  std::size_t place_size() const override { return 0; }
  void locate(const VertexContext&, std::size_t, std::uint32_t*) const override {}
  void sample(VertexDecision which, const VertexContext& context, const std::uint32_t* places, std::size_t n,
              const std::array<const double*, 3>& z, const std::array<float*, 3>& y, float* inv_q) const override;
  void inverse_density(VertexDecision which, const VertexContext& context, const std::uint32_t* places, std::size_t n,
                       const std::array<const float*, 3>& y, float* inv_q) const override;
  void save(TensorFile& file, const std::string& prefix) const override;
  /// Throws FileError.
  static std::shared_ptr<const ConditionalSpline> load(const TensorFile& file, const std::string& prefix);

 private:
  class Block;
  float inverse_of(double log_q) const;

  std::shared_ptr<const Shape> m_shape;
  VertexBox m_box;
  std::array<nn::AlignedVector<float>, 2> m_parameters;
  std::array<PackedParameters, 2> m_packed;
  double m_uniform;
  Layout m_numbers;
};

}  // namespace warpath
