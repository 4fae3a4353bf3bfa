#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "path/pass_record.h"
#include "report/metrics.h"

namespace warpath {

/// The error after so many samples per pixel and so much time; seconds count everything, training included.
struct ErrorPoint {
  double spp = 0;
  double seconds = 0;
  double mse = kUnknown;
  double relmse = kUnknown;
  double cpu_seconds = kUnknown;  ///< the same of processors, summed over threads
};

/// One evaluation of the held-out likelihood during training.
struct TrainingPoint {
  double seconds = 0;          ///< since training began
  std::uint64_t samples = 0;   ///< examples seen, with repetition
  double loss = kUnknown;      ///< mean -ln q over the last training batches
  double held_out = kUnknown;  ///< mean -ln q over the examples held out
  double cpu_seconds = kUnknown;
};

/// One method's run. NaN means "not known" (an error without a reference) and is null in JSON.
struct MethodRun {
  std::string method;  ///< as typed: `realnvp:film+bounce1`
  std::string family;  ///< `none`, `uniform`, `grid`, `kdtree`, `realnvp`, ...
  std::string dims;    ///< what is warped: `film+bounce1`; empty for none
  std::string size;    ///< of the film: `320x180`
  std::uint64_t seed = 0;
  double spp = 0;                   ///< samples per pixel of the image, mean over pixels
  std::uint64_t samples = 0;        ///< paths traced for the image
  std::uint64_t train_samples = 0;  ///< paths traced for training
  double candidate_seconds = 0;     ///< gathering and resampling candidates
  double train_seconds = 0;         ///< fitting
  double warp_seconds = 0;          ///< drawing warped numbers while rendering; wall time, as all of these
  double trace_seconds = 0;         ///< the rest of rendering
  double total_seconds = 0;
  // The same of processors, summed over threads: what other programs make this one wait for does not count.
  double candidate_cpu_seconds = kUnknown;
  double train_cpu_seconds = kUnknown;
  double warp_cpu_seconds = kUnknown;
  double trace_cpu_seconds = kUnknown;
  double total_cpu_seconds = kUnknown;
  double mse = kUnknown;
  double relmse = kUnknown;
  double relmse_trimmed = kUnknown;
  double mape = kUnknown;
  double mse_raw = kUnknown;
  double relmse_raw = kUnknown;
  double mse_predicted = kUnknown;  ///< by the image's own variance, without a reference but for what relMSE divides by
  double relmse_predicted = kUnknown;
  double mse_rest = kUnknown;  ///< `rest`: without directly seen emission
  double relmse_rest = kUnknown;
  std::array<double, 3> mean{kUnknown, kUnknown, kUnknown};
  std::array<double, 3> mean_rest{kUnknown, kUnknown, kUnknown};
  std::uint64_t non_finite = 0;          ///< samples whose contribution was not finite, counted as zero
  std::uint64_t candidates = 0;          ///< |T|
  double candidates_nonzero = kUnknown;  ///< share of the candidates with g > 0
  std::string training_stopped;          ///< why training ended
  std::vector<ErrorPoint> error_curve;
  std::vector<TrainingPoint> training_curve;
  std::vector<PassRecord> passes;  ///< under --time

  void set_errors(const ImageErrors& errors);
};

/// Everything that `results.json` holds.
struct Comparison {
  std::string scene;      ///< as typed
  std::string reference;  ///< path; empty without one
  std::string version;    ///< of warpath
  std::string commit;
  std::string cpu;
  std::string date;     ///< ISO 8601, UTC
  std::string command;  ///< the command line that repeats it
  int width = 0;
  int height = 0;
  int threads = 0;
  std::uint64_t seed = 0;
  bool reference_has_variance = false;
  std::map<std::string, std::string> settings;  ///< whatever else shaped the result: max_depth, sampler, epp, ...
  std::vector<std::string> warnings;
  std::vector<MethodRun> results;  ///< in the order in which they ran
};

/// The text of `results.json`; bytes of names that are not UTF-8 become U+FFFD.
std::string results_json(const Comparison& comparison);
/// Writes it, whole or not at all. Throws FileError.
void write_results(const std::filesystem::path& path, const Comparison& comparison);
/// Reads it back; unknown fields are passed over, missing ones keep their defaults. Throws FileError with line and
/// column.
Comparison read_results(const std::filesystem::path& path);

}  // namespace warpath
