#pragma once
#include <span>

#include "train/training_data.h"

namespace warpath {

/// With w = weight^b, (sum w)^2 / sum w^2: how many equal weights would be worth as much; 0 if all of them are 0.
double effective_samples(std::span<const float> weight, double b = 1);

/// b in (0, 1], as large as leaves `effective` effective samples of the weights to the power of b.
double tempering(std::span<const float> weight, double effective);

/// The examples with weights w^b, with that b: examples of the density q^(1 - b) g^b, on the way from the q that drew
/// them to g (annealing, as in [Neal01]). Few examples that matter teach a density little; on the way there are enough.
Examples tempered(const Examples& examples, double effective);

}  // namespace warpath
