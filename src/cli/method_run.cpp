#include "cli/method_run.h"

#include <algorithm>
#include <tuple>

#include "cli/output.h"

namespace warpath {
namespace {

/// MSE and relMSE that the image's own variance promises.
std::pair<double, double> predicted_errors(const ImageEstimate& image, const ImageRgb& reference) {
  double mse = 0, relmse = 0;
  for (std::size_t p = 0; p < image.mean.size(); ++p)
    for (int c = 0; c < 3; ++c) {
      mse += image.variance[p][c];
      relmse += image.variance[p][c] / (sqr(reference.pixels[p][c]) + 0.01);
    }
  const double count = 3 * static_cast<double>(image.mean.size());
  return {mse / count, relmse / count};
}

/// All but the errors.
MethodRun summarise(const Method& method, const RenderSettings& settings, const Rendered& rendered) {
  const Preparation& prepared = rendered.preparation;
  const RenderCost& cost = rendered.estimator->cost();
  MethodRun run;
  run.method = method.name;
  run.family = method.family_name();
  run.dims = method.layout.name();
  run.seed = settings.seed;
  run.spp = rendered.estimator->spp();
  run.samples = cost.samples;
  run.candidate_seconds = prepared.candidate_seconds;
  run.train_seconds = prepared.log.seconds + prepared.warp.fit_seconds;
  run.warp_seconds = cost.warp_seconds;
  run.trace_seconds = cost.trace_seconds + cost.emission_seconds;
  run.total_seconds = rendered.seconds();
  run.candidate_cpu_seconds = prepared.candidate_cpu_seconds;
  run.train_cpu_seconds = prepared.log.cpu_seconds + prepared.warp.fit_cpu_seconds;
  run.warp_cpu_seconds = cost.warp_cpu_seconds;
  run.trace_cpu_seconds = cost.trace_cpu_seconds;
  run.total_cpu_seconds = rendered.cpu_seconds();
  run.non_finite = rendered.estimator->non_finite();
  run.training_stopped = rendered.choice.empty() ? prepared.log.stopped : rendered.choice;
  for (const auto& p : prepared.log.points)
    run.training_curve.push_back({p.seconds, p.samples, p.loss, p.held_out, p.cpu_seconds});
  run.train_samples = prepared.warp.taught;
  if (prepared.candidates) {
    const auto& target = prepared.candidates->target;
    run.candidates = prepared.candidate_count;
    run.train_samples += prepared.candidate_count;
    run.candidates_nonzero =
        static_cast<double>(std::count_if(target.begin(), target.end(), [](float g) { return g > 0; })) /
        static_cast<double>(target.size());
  }
  if (settings.by_clock()) run.passes = rendered.passes;
  return run;
}

}  // namespace

MethodRun measure(const Method& method, const RenderSettings& settings, const Rendered& rendered,
                  const References& references) {
  MethodRun run = summarise(method, settings, rendered);
  const ImageEstimate estimate = rendered.estimator->develop();
  const ImageRgb image = image_rgb(estimate), rest = image_rgb(rendered.estimator->develop_rest());
  run.set_errors(image_errors(image, references.image));
  std::tie(run.mse_predicted, run.relmse_predicted) = predicted_errors(estimate, references.image.image);
  const ImageErrors rest_errors = image_errors(rest, references.rest);
  run.mse_rest = rest_errors.mse;
  run.relmse_rest = rest_errors.relmse;
  run.mean = image_mean(image);
  run.mean_rest = image_mean(rest);
  return run;
}

ErrorPoint error_point(const Rendered& rendered, const Reference& reference) {
  const ImageErrors errors = image_errors(image_rgb(rendered.estimator->develop()), reference);
  return {rendered.estimator->spp(), rendered.seconds(), errors.mse, errors.relmse, rendered.cpu_seconds()};
}

}  // namespace warpath
