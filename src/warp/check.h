#pragma once
#include <cstdint>
#include <string>

#include "warp/proposal.h"

namespace warpath {

struct CheckOptions {
  std::uint64_t seed = 1;
  std::size_t samples = std::size_t{1} << 16;
  double false_alarm = 1e-6;        ///< chance that one statistical test fails a correct proposal
  double log_q_tolerance = 1e-9;    ///< between sample and log_density, forward and inverse, batches of different sizes
  double y_tolerance = 1e-5;        ///< of forward(inverse(y)); also of inverse(forward(z)), where z is not stretched
  double difference_step = 1e-6;    ///< in z, of the central differences that log_det is compared with
  double log_det_tolerance = 1e-4;  ///< against those differences
  double kink = 1e-2;       ///< change of slope, relative, above which a point is not compared: a kink or a jump
  double border = 0x1p-53;  ///< how near to 1 the numbers come that a bijection must bring back
};

/// What every proposal promises. Returns what is broken, with seeds and figures; empty if all holds, so that a test
/// reads EXPECT_EQ(check_proposal(p), ""). It looks for:
/// - y in [0,1) and finite log_q, also for latents at the border; in place, strided and in batches of any size alike;
/// - log_q from sample equal to log_density(y);
/// - density: draws from uniform and p, half and half; which of both drew a y is a coin of probability q / (1 + q). A
///   chi^2 test of the coins, pooled over the cells of a kd-tree of the draws, over intervals of each coordinate, and
///   over intervals of log q. Exact in any dimension and sensitive to what is drawn, to q, and to its normalisation;
/// - normalised: mean of 2 q / (1 + q) over the same draws is 1, and, for D <= 4, that of q over uniform y;
/// - unbiased: f / q over draws from p, for three f of known integral.
std::string check_proposal(const Proposal& proposal, const CheckOptions& options = {});

/// What every bijection promises besides (call check_proposal as well): both orders invert each other, also near 0 and
/// 1; log_det of inverse is that of forward, negated; for D <= 6 log_det is that of central differences, wherever those
/// from below and above agree, so that kinks and jumps do not count.
std::string check_warp(const Warp& warp, const CheckOptions& options = {});

}  // namespace warpath
