#pragma once
#include <string>
#include <vector>

#include "train/settings.h"

namespace warpath::bench {

/// A flow of the sizes that docs/performance.md compares, by the name of its benchmark.
struct SplineSize {
  std::string name;
  int dims;
  SplineSettings settings;
};
struct RealNvpSize {
  std::string name;
  int dims;
  RealNvpSettings settings;
};

/// One residual block, and a first layer as wide as the others: the encoding of half of the dimensions fills it.
inline SplineSize spline_size(int dims, int width, int bins, int couplings) {
  SplineSize size{"spline/d" + std::to_string(dims) + "/w" + std::to_string(width) + "/K" + std::to_string(bins) +
                      "/c" + std::to_string(couplings),
                  dims,
                  {}};
  size.settings.width = width;
  size.settings.bins = bins;
  size.settings.couplings = couplings;
  size.settings.encoding_bins = width / (dims / 2);
  return size;
}
/// Two residual blocks, which see the numbers alone, without normalisation.
inline RealNvpSize realnvp_size(int dims, int width, int couplings, bool shared) {
  RealNvpSize size{"realnvp/d" + std::to_string(dims) + "/w" + std::to_string(width) + "/c" +
                       std::to_string(couplings) + (shared ? "/shared" : "/separate"),
                   dims,
                   {}};
  size.settings.width = width;
  size.settings.couplings = couplings;
  size.settings.blocks = 2;
  size.settings.encoding_bins = 0;
  size.settings.shared = shared;
  size.settings.norm = RealNvpSettings::Norm::none;
  return size;
}

inline std::vector<SplineSize> spline_sizes() {
  return {spline_size(4, 32, 8, 2), spline_size(4, 32, 8, 4),  spline_size(4, 64, 16, 2), spline_size(4, 64, 16, 4),
          spline_size(8, 32, 8, 4), spline_size(8, 32, 16, 4), spline_size(8, 64, 16, 4)};
}
inline std::vector<RealNvpSize> realnvp_sizes() {
  return {realnvp_size(8, 64, 6, true), realnvp_size(8, 64, 6, false)};
}

}  // namespace warpath::bench
