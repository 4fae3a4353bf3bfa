// Writes reports of synthetic data for the browser's test: report_browser_data FOLDER makes FOLDER/full, FOLDER/plain,
// FOLDER/single.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "report/html.h"

namespace warpath {
namespace {

constexpr int kWidth = 160;
constexpr int kHeight = 90;

/// A room of smooth colours, a lamp much brighter than white, and a dark corner.
Color truth(int x, int y) {
  const float u = (x + 0.5f) / kWidth, v = (y + 0.5f) / kHeight;
  const float lamp = std::exp(-200 * (sqr(u - 0.72f) + 0.3f * sqr(v - 0.25f)));
  const float wall = 0.15f + 0.5f * u * (1 - v);
  const float floor = v > 0.62f ? 0.25f + 0.2f * std::sin(40 * u + 12 * v) * std::sin(30 * v) : 0.0f;
  return Color(wall + floor + 9 * lamp, 0.8f * wall + 0.9f * floor + 7 * lamp, 0.75f * wall + 0.5f * floor + 4 * lamp);
}

ImageRgb reference() {
  ImageRgb image(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) image.at(x, y) = truth(x, y);
  return image;
}

/// The truth with gamma distributed noise, whose tail makes fireflies.
ImageRgb noisy(double relative_variance, unsigned seed) {
  std::mt19937 rng(seed);
  std::gamma_distribution<float> factor(1 / relative_variance, relative_variance);
  ImageRgb image = reference();
  for (Color& pixel : image.pixels) pixel *= factor(rng);
  return image;
}

DensityGrid density(int n, double sharpness, double noise, unsigned seed) {
  std::mt19937 rng(seed);
  std::gamma_distribution<double> factor(1 / noise, noise);
  DensityGrid grid{n, n, {}};
  double sum = 0;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const double x = (i + 0.5) / n, y = (j + 0.5) / n;
      const double value = 0.15 + std::exp(-sharpness * (std::pow(x - 0.7, 2) + std::pow(y - 0.3, 2))) +
                           0.7 * std::exp(-0.5 * sharpness * std::pow(y - 0.9 + 0.5 * x, 2));
      grid.values.push_back(static_cast<float>(value * factor(rng)));
      sum += grid.values.back();
    }
  for (float& value : grid.values) value *= static_cast<float>(n * n / sum);
  return grid;
}

struct Method {
  const char* name;
  double variance;  // relative, of a pixel at 128 spp
  double train_seconds;
  double warp_seconds;
};

MethodRun make_run(const Method& method, const Reference& ref, unsigned seed) {
  const std::string name = method.name;
  MethodRun run;
  run.method = name;
  run.family = name.substr(0, name.find(':'));
  run.dims = name.find(':') == std::string::npos ? "" : name.substr(name.find(':') + 1);
  run.size = fmt::format("{}x{}", kWidth, kHeight);
  run.seed = seed;
  run.spp = 128;
  run.samples = 128ull * kWidth * kHeight;
  run.trace_seconds = 11.7 + 0.1 * (seed % 3);
  run.warp_seconds = method.warp_seconds;
  run.candidate_seconds = method.train_seconds > 0 ? 1.9 : 0;
  run.train_seconds = method.train_seconds;
  run.total_seconds = run.trace_seconds + run.warp_seconds + run.candidate_seconds + run.train_seconds + 0.2;
  const ImageRgb image = noisy(method.variance, seed);
  run.set_errors(image_errors(image, ref));
  run.mean = image_mean(image);
  for (double spp = 1; spp <= 128; spp *= 2) {
    const ImageErrors errors = image_errors(noisy(method.variance * 128 / spp, seed + static_cast<unsigned>(spp)), ref);
    const double start = run.total_seconds - run.trace_seconds - run.warp_seconds;
    run.error_curve.push_back(
        {spp, start + (run.trace_seconds + run.warp_seconds) * spp / 128, errors.mse, errors.relmse});
  }
  if (run.train_seconds > 0) {
    run.train_samples = 4096000;
    run.candidates = 4096000;
    run.candidates_nonzero = 0.837;
    run.training_stopped = "held-out likelihood no longer rises";
    std::mt19937 rng(seed);
    std::normal_distribution<double> noise(0, 0.02);
    const int first = run.family == "kdtree" ? 60 : 0;  // built in one go: a single point
    for (int i = first; i <= 60; ++i) {
      const double t = run.train_seconds * i / 60.0, loss = -1.4 * (1 - std::exp(-t / 3.0));
      run.training_curve.push_back(
          {t, 2000ull * 50 * i, loss + noise(rng), loss + 0.05 * (1 - std::exp(-t / 9)) + 0.3 * noise(rng)});
    }
  }
  return run;
}

Comparison base_comparison() {
  Comparison comparison;
  comparison.scene = "scenes/door ajar/scene.xml";
  comparison.version = "0.1.0";
  comparison.commit = "0123abc";
  comparison.cpu = "Some CPU @ 2.4 GHz";
  comparison.date = "2026-01-02T03:04:05Z";
  comparison.command = "warpath compare \"scenes/door ajar/scene.xml\" --methods none,kdtree:film+bounce1 --spp 128";
  comparison.width = kWidth;
  comparison.height = kHeight;
  comparison.threads = 2;
  comparison.seed = 18446744073709551615ull;
  comparison.settings = {{"max_depth", "8"}, {"sampler", "stratified"}, {"epp", "16"}, {"uniform", "0.1"}};
  return comparison;
}

/// Everything there is: a reference with variance, four methods, three runs, curves, densities.
ReportData full() {
  const Reference ref{"ref.exr", reference(), ImageRgb(kWidth, kHeight, Color(1e-5f))};
  ReportData data{base_comparison(), ref.image, {}, {}};
  data.comparison.reference = "references/ref.exr";
  data.comparison.reference_has_variance = true;
  const Method methods[] = {{"none", 0.10, 0, 0},
                            {"kdtree:film+bounce1", 0.058, 0.8, 0.9},
                            {"realnvp:film+bounce1", 0.049, 14.2, 4.1},
                            {"realnvp:film+bounce1.lobe+bounce1", 0.13, 17.5, 4.9}};
  unsigned seed = 1;
  for (const Method& method : methods) {
    for (int run = 0; run < 3; ++run) data.comparison.results.push_back(make_run(method, ref, 100 * seed + run));
    data.images.push_back({method.name, noisy(method.variance, 100 * seed)});
    if (method.train_seconds > 0)
      for (const auto& [x, y] :
           {std::pair{"film.x", "film.y"}, {"bounce1.dir.u", "bounce1.dir.v"}, {"film.x", "bounce1.dir.u"}})
        data.densities.push_back({method.name, x, y, "", density(64, 30, 0.001, 1), density(64, 40, 0.15, seed)});
    ++seed;
  }
  data.comparison.results[5].non_finite = 12;
  return data;
}

/// No reference, no training, hostile names, and values that are not finite.
ReportData plain() {
  ReportData data{base_comparison(), {}, {}, {}};
  data.comparison.scene = "<script>alert(1)</script>/--></script><img src=x onerror=alert(2)>{{data}}.xml";
  data.comparison.warnings = {"</script><script>document.title='broken'</script>", "bytes \xFF\xFE that are no UTF-8"};
  for (const char* method : {"uniform:<b>film</b>", "grid:film"}) {
    MethodRun run;
    run.method = method;
    run.spp = 8;
    run.total_seconds = run.trace_seconds = 1;
    data.comparison.results.push_back(run);
    data.images.push_back({method, noisy(0.5, 3)});
  }
  Color& odd = data.images[0].image.at(3, 3);
  odd = Color(std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e30f);
  return data;
}

/// One method and a reference without variance.
ReportData single() {
  const Reference ref{"ref.exr", reference(), {}};
  ReportData data{base_comparison(), ref.image, {}, {}};
  data.comparison.reference = "ref.exr";
  data.comparison.results.push_back(make_run({"grid:film", 0.1, 0, 0}, ref, 5));
  data.images.push_back({"grid:film", noisy(0.1, 5)});
  return data;
}

}  // namespace
}  // namespace warpath

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: report_browser_data FOLDER\n"), 2;
  const std::filesystem::path folder = argv[1];
  warpath::write_report(folder / "full", warpath::full());
  warpath::write_report(folder / "plain", warpath::plain());
  warpath::write_report(folder / "single", warpath::single());
}
