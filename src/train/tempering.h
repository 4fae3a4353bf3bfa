#pragma once
#include <span>

#include "train/training_data.h"

namespace warpath {

/// (sum w)^2 / sum w^2: how many equal weights would be worth as much; 0 if all of them are 0.
double effective_samples(std::span<const float> weight);

/// The examples with weights w^b, b in (0, 1] as large as leaves `effective` effective samples: examples of the density
/// q^(1 - b) g^b, on the way from the q that drew them to g (annealing, as in [Neal01]). Few examples
/// that matter teach a density little; on the way there are enough.
Examples tempered(const Examples& examples, double effective);

}  // namespace warpath
