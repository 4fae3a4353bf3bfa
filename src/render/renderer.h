#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "estimate/image_estimator.h"
#include "path/pass_record.h"
#include "render/method.h"
#include "render/preparation.h"

namespace warpath {

/// What is asked of a render, beside its scene and method.
struct RenderSettings {
  std::uint64_t seed = 0;
  std::optional<int> spp;          ///< samples per pixel; none: the scene's
  std::optional<double> time;      ///< seconds for everything, training included, in place of spp
  std::vector<PassRecord> replay;  ///< if there are any: these passes, whatever the time
  std::optional<Objective> objective = Objective::relmse;  ///< where samples of a stratified film go; none: everywhere
  Sampler sampler = Sampler::independent;
  bool learns_from_last = false;  ///< the warp is wanted, not the image: the last pass teaches it, too
  /// Whether the clock decides, or has decided: such a render can only be repeated by the record of its passes.
  bool by_clock() const { return time || !replay.empty(); }
};

/// What a render gave.
struct Rendered {
  Preparation preparation;                    ///< with the warp as it is after the last pass
  std::unique_ptr<ImageEstimator> estimator;  ///< the image
  std::vector<PassRecord> passes;
  std::string choice;  ///< what `auto` chose, and why

  /// Everything after loading; thread time shared out over the wall time of passes.
  double seconds() const;
  double cpu_seconds() const;
};

/// Renders a scene: trains what the method asks for, renders passes, keeps count of what they cost. Methods over the
/// same dimensions share their candidates as long as the seed does not change; what those cost counts for each.
class Renderer {
 public:
  explicit Renderer(std::shared_ptr<const Tracer> tracer, Stages stages = {});
  const Tracer& tracer() const { return *m_tracer; }

  /// checkpoint: called after each pass. `stage` names the passes among the stages. Ends early on Ctrl-C with what
  /// there is; throws Interrupted if that is nothing. Throws ConfigError for what does not go together.
  Rendered render(const Method& method, const RenderSettings& settings, const TrainSettings& training,
                  const std::string& stage, const std::function<void(const Rendered&)>& checkpoint = {});
  /// Trains without rendering: a joint family.
  Preparation prepare(const Method& method, const TrainSettings& training) {
    return m_preparer.prepare(method, training);
  }

 private:
  std::shared_ptr<const Tracer> m_tracer;
  Stages m_stages;
  Preparer m_preparer;
};

/// Throws ConfigError if the sampler does not go with a method.
void check_sampler(Sampler sampler, const Method& method);

}  // namespace warpath
