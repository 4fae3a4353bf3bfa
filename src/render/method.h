#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "estimate/image_estimator.h"
#include "path/layout.h"
#include "render/render_loop.h"
#include "tracer/tracer.h"
#include "train/settings.h"
#include "train/training_data.h"

namespace warpath {

/// A way to draw the numbers of paths, as it is named on the command line: `none`, FAMILY[:DIMS], or a warp file.
struct Method {
  std::string name;            ///< as typed
  std::string family;          ///< `none`, `uniform`, `grid`, ...
  Layout layout;               ///< empty for `none`, and where the numbers of every vertex are warped
  std::filesystem::path file;  ///< of a trained warp; empty if it is trained now
};
/// Throws ConfigError that lists the families, or FileError if a warp file cannot be read.
Method parse_method(const std::string& text);

/// The error that samples are placed to lessen: `mse` or `relmse`; none for `even`. Throws ConfigError.
std::optional<Objective> parse_objective(const std::string& name);
/// `independent`, `stratified` or `sobol`. Throws ConfigError, also if it does not go with a method of this layout.
Sampler parse_sampler(const std::string& name, const Layout& layout);

/// A method that is ready to render.
struct PreparedMethod {
  std::shared_ptr<const Proposal> proposal;  ///< null for `none`
  TrainLog log;
  std::shared_ptr<const Candidates> candidates;  ///< the first chunk of them; null if it was not trained now
  std::uint64_t candidate_count = 0;             ///< of all chunks
  double candidate_seconds = 0, candidate_cpu_seconds = 0;
  Guide guide;  ///< for the passes of the render

  /// Adds the candidates to an image that is to have them (--training-samples use).
  void add_candidates(ImageEstimator& estimator) const;
};

/// Told the name of each stage of training as it begins; what it returns hears how far the stage is, and is dropped
/// when it ends.
using Stages = std::function<Progress(const std::string& stage)>;

/// Gathers candidates and trains. Candidates are kept, so that methods over the same dimensions learn from the same
/// ones.
class MethodTrainer {
 public:
  /// objective: where the samples of methods with a stratified film go, all but those of `none`.
  MethodTrainer(std::shared_ptr<const Tracer> tracer, const TrainSettings& settings, std::filesystem::path init,
                bool use_samples, std::optional<Objective> objective, Stages stages = {})
      : m_tracer(std::move(tracer)),
        m_settings(settings),
        m_init(std::move(init)),
        m_use_samples(use_samples),
        m_objective(objective),
        m_stages(stages ? std::move(stages) : [](const std::string&) -> Progress { return [](double) {}; }) {}
  PreparedMethod prepare(const Method& method);

 private:
  std::shared_ptr<const Candidates> candidates(const Layout& layout, std::uint64_t count);
  std::shared_ptr<const Candidates> gather(const Layout& layout, std::uint64_t first, std::uint64_t end,
                                           const std::function<void(std::uint64_t)>& progress) const;
  /// Gathers prepared.candidate_count candidates and trains; prepared is told what they cost, and keeps the first
  /// chunk.
  Fit train_in_chunks(const Layout& layout, const TrainSettings& settings, const Proposal* init,
                      PreparedMethod& prepared);
  /// What `auto` chooses from: the field at every vertex, which may know something already, and warps of the first hit,
  /// which cost less.
  std::vector<Contender> contenders(std::unique_ptr<VertexLearner> field,
                                    std::shared_ptr<const VertexProposal> warp) const;
  std::unique_ptr<VertexLearner> conditional_trainer(const Method& method) const;

  std::shared_ptr<const Tracer> m_tracer;
  TrainSettings m_settings;
  std::filesystem::path m_init;
  bool m_use_samples;
  std::optional<Objective> m_objective;
  Stages m_stages;
  std::map<std::string, std::shared_ptr<const Candidates>> m_candidates;  // by layout
};

}  // namespace warpath
