#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "train/settings.h"

namespace warpath {

/// Training as people ask for it, on the command line and in Python: sizes, and choices by their names.
struct TrainingOptions {
  double epp = 16;
  std::uint64_t examples = 0;  ///< 0: epp x 200 x 160
  std::filesystem::path init;
  std::string training_samples = "discard";  ///< or use: candidates count in the image
  TrainSettings settings;
  // Choices by name, as they are typed; train_settings puts them into the settings.
  std::string bn = "actnorm", masks = "binary", architecture = "default";
  std::string loss = "variance", networks = "shared";
  std::string kdtree_target = "rms", kdtree_split = "best";
  // Of both flows, and of spline and grid; what is not given is the family's own default.
  std::optional<int> couplings, width, blocks, encoding_bins, batch, max_steps, bins;
  std::optional<double> rate, jitter;

  /// Throws ConfigError for a choice that has no such name.
  TrainSettings train_settings(std::uint64_t seed) const;
  /// Throws ConfigError for what is neither discard nor use.
  bool use_samples() const;
};

}  // namespace warpath
