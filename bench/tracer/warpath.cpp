// Renders a scene and tells how long each run took: paths, rays for directly seen emission, the film and its
// development, as `warpath render` does it. Plain path tracing, or a flow in front of the first bounce that costs what
// a trained one costs.
//   bench_tracer SCENE WxH SPP THREADS RUNS [FLOW]      one line of JSON; FLOW: a name of bench/flow/sizes.h
#include <fmt/ranges.h>
#include <tbb/global_control.h>

#include <chrono>
#include <cstdlib>
#include <ctime>

#include "bench/flow/sizes.h"
#include "estimate/image_estimator.h"
#include "scene/scene.h"
#include "tracer/tracer.h"
#include "warp/mixture.h"
#include "warp/realnvp.h"
#include "warp/spline.h"
#include "warp/uniform.h"
#include "warpath/error.h"

namespace {
using namespace warpath;

/// The flow of that name, untrained, mixed with the uniform proposal; null for none.
std::shared_ptr<const Proposal> find_flow(const std::string& name) {
  std::shared_ptr<const Proposal> warp;
  for (const auto& size : bench::spline_sizes())
    if (size.name == name) warp = Spline::untrained(size.dims, size.settings, 1);
  for (const auto& size : bench::realnvp_sizes())
    if (size.name == name) warp = RealNvp::untrained(size.dims, size.settings, 1);
  if (!warp) throw ConfigError(fmt::format("{}: no flow of bench/flow/sizes.h", name));
  return std::make_shared<Mixture>(
      std::vector<Mixture::Component>{{std::make_shared<Uniform>(warp->dims()), 0.1}, {warp, 0.9}});
}

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
double process_seconds() {
  timespec time;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

int run(int count, char** arguments) {
  SceneOptions options;
  if (count < 6 || count > 7 || std::sscanf(arguments[2], "%dx%d", &options.width, &options.height) != 2) {
    fmt::print(stderr, "usage: bench_tracer SCENE WxH SPP THREADS RUNS [FLOW]\n");
    return 2;
  }
  const int spp = std::atoi(arguments[3]), threads = std::atoi(arguments[4]), runs = std::atoi(arguments[5]);
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));

  const Tracer tracer(load_scene(arguments[1], options));
  const auto proposal = count == 7 ? find_flow(arguments[6]) : nullptr;
  const Layout layout =
      !proposal ? Layout{} : Layout::parse(proposal->dims() == 4 ? "film+bounce1" : "film+bounce1+bounce2+bounce3");
  std::vector<double> seconds, cpu_seconds, emission_seconds, warp_share;
  std::uint64_t paths = 0;
  for (int i = 0; i < runs; ++i) {
    const double wall = wall_seconds(), cpu = process_seconds();
    ImageEstimator estimator(tracer, layout, proposal, static_cast<std::uint64_t>(i));
    estimator.add_pass(spp);
    const ImageEstimate image = estimator.develop();
    seconds.push_back(wall_seconds() - wall);
    cpu_seconds.push_back(process_seconds() - cpu);
    emission_seconds.push_back(estimator.cost().emission_seconds);
    warp_share.push_back(estimator.cost().warp_seconds / estimator.cost().total());
    paths = estimator.cost().samples;
  }
  fmt::print("{{\"paths\": {}, \"seconds\": {}, \"cpu_seconds\": {}, \"emission_seconds\": {}, \"warp_share\": {}}}\n",
             paths, seconds, cpu_seconds, emission_seconds, warp_share);
  return 0;
}

}  // namespace

int main(int count, char** arguments) {
  try {
    return run(count, arguments);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
