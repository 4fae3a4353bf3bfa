#pragma once
#include <cstdint>

// Streams of random numbers. Uses of one seed that must not repeat each other's numbers mix it with one of these,
// whose upper bytes are a name in ASCII.
namespace warpath {

inline constexpr std::uint64_t kLatentStream = 0x6c6174656e740001u;      ///< what a proposal is drawn from
inline constexpr std::uint64_t kEmissionStream = 0x656d697373690002u;    ///< camera rays for directly seen emission
inline constexpr std::uint64_t kCandidateStream = 0x63616e6469640003u;   ///< candidates that train a warp
inline constexpr std::uint64_t kReferenceStream = 0x7265666572000004u;   ///< the image that others are judged by
inline constexpr std::uint64_t kAllocationStream = 0x616c6c6f63610005u;  ///< where fractions of samples go
inline constexpr std::uint64_t kWeightStream = 0x73706c696e650007u;      ///< first weights of networks at vertices

/// Number of a sample's latent stream that picks the component of a mixture; all others stand for the dimensions of a
/// path.
inline constexpr std::uint32_t kComponentDimension = 0xfffffffeu;

}  // namespace warpath
