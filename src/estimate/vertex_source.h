#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "path/primary_source.h"
#include "path/vertex.h"
#include "warp/vertex_proposal.h"

namespace warpath {

/// Memory of a VertexSource, kept from batch to batch.
struct VertexSourceScratch {
  std::array<std::vector<double>, 3> z;
  std::array<std::vector<float>, 3> y;
  std::vector<std::uint32_t> places, place_of_lane;  // words of places, as many for each as the warp wants
  std::vector<std::uint16_t> located;                // lane -> bounce at which it was located last
  std::vector<float> scattered;                      // lane -> inv_q of what was scattered last
  std::vector<float> expected;
  VertexBuffer unknown;  // those that are to be located one by one
};

/// From a warp that lives at vertices to the numbers of a path: film positions as they are given, the numbers of each
/// vertex from the warp, the rest uniform. What is drawn jointly is drawn with the first group of the
/// three numbers, which brings the whole 1 / q; the second group hands out the rest. Where the warp can tell what comes
/// back, and the brightness of pixels is known, roulette's numbers are drawn so that paths end which are to bring
/// little.
class VertexSource final : public UniformSource {
 public:
  /// Views: film positions in [0,1), one per lane. brightness: the luminance that each path's pixel is thought to have,
  /// one per lane; empty: not known yet.
  VertexSource(const Latents& latents, const VertexProposal& warp, std::span<const float> film_x,
               std::span<const float> film_y, std::span<const float> brightness, VertexSourceScratch& scratch)
      : UniformSource(latents),
        m_warp(warp),
        m_film_x(film_x),
        m_film_y(film_y),
        m_brightness(brightness),
        m_scratch(scratch) {
    scratch.scattered.resize(latents.size());
    scratch.place_of_lane.resize(latents.size() * warp.place_size());
    scratch.located.assign(latents.size(), 0);
  }

  bool draw(Group group, std::span<const std::uint32_t> lanes, const VertexContext* context, float* u0, float* u1,
            float* inv_q) override;
  bool wants_context() const override { return true; }

 private:
  /// The places of vertices, into m_scratch.places; those that were located at this bounce before are known.
  void locate(std::uint16_t bounce, std::span<const std::uint32_t> lanes, const VertexContext& context);
  /// Draws three numbers for each lane into m_scratch.y; `first` is the first of the two groups that hold them.
  void draw_jointly(VertexDecision which, Group first, std::span<const std::uint32_t> lanes,
                    const VertexContext& context, float* inv_q);
  /// Draws the numbers of roulette; false if they are to be uniform.
  bool draw_roulette(Group group, std::span<const std::uint32_t> lanes, const VertexContext& context, float* u,
                     float* inv_q);

  const VertexProposal& m_warp;
  std::span<const float> m_film_x, m_film_y, m_brightness;
  VertexSourceScratch& m_scratch;
  Group m_drawn{GroupKind::film};  // the group that was drawn last together with its second one
};

}  // namespace warpath
