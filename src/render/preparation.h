#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "core/ordered.h"
#include "render/method.h"
#include "render/passes.h"
#include "tracer/tracer.h"
#include "train/settings.h"
#include "train/training_data.h"

namespace warpath {

/// Told the name of each stage of a render as it begins; what it returns hears how far the stage is, and is dropped
/// when it ends.
using Stages = std::function<Progress(const std::string& stage)>;

/// What a method has before its first pass.
struct Preparation {
  std::shared_ptr<const Proposal> proposal;  ///< of a joint warp; null without
  OnlineWarp warp;                           ///< of the numbers of vertices
  TrainLog log;
  std::shared_ptr<const Candidates> candidates;  ///< the first chunk of them; null if there are none
  std::uint64_t candidate_count = 0;             ///< of all chunks
  double candidate_seconds = 0, candidate_cpu_seconds = 0;
  double seconds() const { return candidate_seconds + log.seconds; }
  double cpu_seconds() const { return candidate_cpu_seconds + log.cpu_seconds; }
};

/// Gathers candidates and trains. Candidates are kept, so that methods over the same dimensions learn from the same
/// ones as long as the seed does not change.
class Preparer {
 public:
  Preparer(std::shared_ptr<const Tracer> tracer, Stages stages)
      : m_tracer(std::move(tracer)), m_stages(std::move(stages)) {}
  Preparation prepare(const Method& method, const TrainSettings& settings);

 private:
  std::shared_ptr<const Candidates> candidates(const Layout& layout, std::uint64_t count,
                                               const TrainSettings& settings);
  /// Gathers preparation.candidate_count candidates and trains; the preparation is told what they cost, and keeps the
  /// first chunk.
  Fit fit_in_chunks(const Method& method, const TrainSettings& settings, const Proposal* init,
                    Preparation& preparation);
  void fit(const Method& method, const TrainSettings& settings, Preparation& preparation);

  std::shared_ptr<const Tracer> m_tracer;
  Stages m_stages;
  std::uint64_t m_seed = 0;                                               // of the candidates
  std::map<std::string, std::shared_ptr<const Candidates>> m_candidates;  // by layout
};

}  // namespace warpath
