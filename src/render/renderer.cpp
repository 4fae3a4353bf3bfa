#include "render/renderer.h"

#include <chrono>

#include "core/interrupt.h"
#include "core/rng.h"
#include "render/automatic.h"
#include "train/candidates.h"
#include "warpath/error.h"

namespace warpath {
namespace {

/// The candidates become a part of the image, if their contributions were kept.
void add_candidates(const Preparation& preparation, ImageEstimator& estimator) {
  const auto& candidates = preparation.candidates;
  if (!candidates || candidates->contribution.empty()) return;
  const std::uint32_t d = Group{GroupKind::film}.first_dimension();
  for (std::uint64_t id = 0; id < candidates->size(); ++id) {
    const std::uint64_t key = sample_key(candidates->seed, kFirstCandidate + id);
    const float* f = candidates->contribution.data() + 3 * id;
    estimator.add_uniform_sample(sample_float(key, d), sample_float(key, d + 1), Color(f[0], f[1], f[2]));
  }
}

std::unique_ptr<PassPolicy> make_policy(const Method& method, const RenderSettings& settings, Schedule schedule) {
  if (!settings.replay.empty()) return std::make_unique<Replayed>(settings.replay);
  if (method.automatic) return std::make_unique<Automatic>(schedule, method.family->name, settings.by_clock());
  return std::make_unique<Fixed>(schedule, method.family_name(), settings.learns_from_last);
}

}  // namespace

double Rendered::seconds() const {
  return preparation.seconds() + preparation.warp.fit_seconds + estimator->cost().total();
}

double Rendered::cpu_seconds() const {
  return preparation.cpu_seconds() + preparation.warp.fit_cpu_seconds + estimator->cost().cpu_total();
}

Renderer::Renderer(std::shared_ptr<const Tracer> tracer, Stages stages)
    : m_tracer(std::move(tracer)),
      m_stages(stages ? std::move(stages) : [](const std::string&) -> Progress { return [](double) {}; }),
      m_preparer(m_tracer, m_stages) {}

void check_sampler(Sampler sampler, const Method& method) {
  if (sampler != Sampler::independent && method.warps_film())
    throw ConfigError(fmt::format("sampler {}: {} warps the film, and its samples are independent",
                                  sampler_name(sampler), method.layout.name()));
}

Rendered Renderer::render(const Method& method, const RenderSettings& settings, const TrainSettings& training,
                          const std::string& stage, const std::function<void(const Rendered&)>& checkpoint) {
  check_sampler(settings.sampler, method);
  // Time runs from here: training counts.
  const Schedule schedule = settings.time ? Schedule(std::chrono::duration<double>(*settings.time))
                                          : Schedule(settings.spp.value_or(m_tracer->scene().sample_count));
  Rendered rendered;
  rendered.preparation = m_preparer.prepare(method, training);
  OnlineWarp& warp = rendered.preparation.warp;
  rendered.estimator = std::make_unique<ImageEstimator>(*m_tracer, method.layout, rendered.preparation.proposal,
                                                        settings.seed, settings.sampler);
  add_candidates(rendered.preparation, *rendered.estimator);
  // `none` stays as even as it is without any of this.
  PassSettings passes;
  if (method.family && !method.warps_film()) passes.objective = settings.objective;
  passes.guided = passes.objective || warp.proposal || warp.learner;
  const auto policy = make_policy(method, settings, schedule);
  {
    const Progress progress = m_stages(stage);
    rendered.passes = render_passes(*rendered.estimator, *policy, passes, warp, progress, [&] {
      if (checkpoint) checkpoint(rendered);
    });
  }
  if (rendered.estimator->cost().samples == 0) throw Interrupted{};
  rendered.choice = policy->choice();
  return rendered;
}

}  // namespace warpath
