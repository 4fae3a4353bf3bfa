// The embedded path tracer as Python sees it. What people call is python/warpath/renderer.py.
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <chrono>
#include <memory>

#include "arrays.h"
#include "core/log.h"
#include "family/training_options.h"
#include "render/method.h"
#include "render/render_loop.h"
#include "scene/scene.h"
#include "tracer/tracer.h"

namespace warpath::python {
namespace {

using namespace nb::literals;

using TracerPointer = std::shared_ptr<const Tracer>;

/// A scene that is ready to be rendered.
struct LoadedScene {
  TracerPointer tracer;
  const FilmSettings& film() const { return tracer->scene().film; }
};

LoadedScene load(const std::filesystem::path& file, std::vector<std::pair<std::string, std::string>> defines,
                 std::pair<int, int> size, int max_depth, std::optional<std::array<int, 4>> crop) {
  const nb::gil_scoped_release release;
  check(max_depth >= 0, "max_depth is negative; 0 takes the scene's");
  check(size.first >= 0 && size.second >= 0, "size is negative; (0, 0) takes the scene's");
  SceneOptions options;
  options.defines = std::move(defines);
  options.width = size.first;
  options.height = size.second;
  options.max_depth = max_depth;
  Scene scene = load_scene(file, options);
  if (crop) {
    const auto [x, y, width, height] = *crop;
    FilmSettings& film = scene.film;
    if (x < 0 || y < 0 || width < 1 || height < 1 || x + width > film.width || y + height > film.height)
      throw ConfigError(fmt::format("crop: {}, {}, {}, {} is not inside the film of {}x{}", x, y, width, height,
                                    film.width, film.height));
    film.crop_x = x;
    film.crop_y = y;
    film.crop_width = width;
    film.crop_height = height;
  }
  return {std::make_shared<const Tracer>(std::move(scene))};
}

/// What a render gave.
struct Rendered {
  ImageEstimate image;
  double spp = 0, seconds = 0;
  std::uint64_t non_finite = 0;
  std::string choice;
};

Rendered render(const LoadedScene& scene, const std::string& warp, int spp, std::optional<double> time,
                const std::string& objective, const std::string& sampler, std::uint64_t seed,
                const TrainingOptions& options) {
  const nb::gil_scoped_release release;
  const StopOnInterrupt stop;
  const auto start = std::chrono::steady_clock::now();
  const Method method = parse_method(warp);
  const Sampler chosen = parse_sampler(sampler, method.layout);
  Budget budget;
  budget.spp = spp > 0 ? spp : scene.tracer->scene().sample_count;
  if (time)
    budget.deadline =
        start + std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(*time));
  MethodTrainer trainer(scene.tracer, options.train_settings(seed), options.init, options.use_samples(),
                        parse_objective(objective));
  PreparedMethod prepared = trainer.prepare(method);
  ImageEstimator estimator(*scene.tracer, method.layout, prepared.proposal, seed, chosen);
  prepared.add_candidates(estimator);
  render_passes(estimator, budget, prepared.guide, {}, [] {});
  // Python hears of Ctrl-C; half an image by mistake helps nobody there.
  if (g_interrupted) throw Interrupted{};
  return {estimator.develop(), estimator.spp(),
          std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), estimator.non_finite(),
          prepared.guide.choice};
}

/// A view that keeps its image alive.
nb::ndarray<nb::numpy, const float, nb::ndim<3>> colours(nb::handle owner, const ImageEstimate& image,
                                                         const std::vector<Color>& pixels) {
  const std::array<std::size_t, 3> shape{static_cast<std::size_t>(image.height), static_cast<std::size_t>(image.width),
                                         3};
  static_assert(sizeof(Color) == 3 * sizeof(float));
  return {&pixels.data()->x, 3, shape.data(), owner};
}

}  // namespace
}  // namespace warpath::python

NB_MODULE(_renderer, m) {
  using namespace warpath;
  using namespace warpath::python;
  m.doc() = "The embedded path tracer.";
  register_errors();
  spdlog::set_level(spdlog::level::warn);
  nb::module_::import_("warpath._core");  // has TrainingOptions

  nb::class_<LoadedScene>(m, "Scene", "See warpath.load_scene.")
      .def_prop_ro("width", [](const LoadedScene& self) { return self.film().crop_width; })
      .def_prop_ro("height", [](const LoadedScene& self) { return self.film().crop_height; })
      .def_prop_ro("spp", [](const LoadedScene& self) { return self.tracer->scene().sample_count; })
      .def_prop_ro("max_depth", [](const LoadedScene& self) { return self.tracer->scene().integrator.max_depth; })
      .def_prop_ro("emitters", [](const LoadedScene& self) { return self.tracer->emitters(); });

  nb::class_<Rendered>(m, "Rendered", "See warpath.Image.")
      .def_prop_ro("mean",
                   [](nb::handle self) {
                     const auto& image = nb::cast<const Rendered&>(self).image;
                     return colours(self, image, image.mean);
                   })
      .def_prop_ro("variance",
                   [](nb::handle self) {
                     const auto& image = nb::cast<const Rendered&>(self).image;
                     return colours(self, image, image.variance);
                   })
      .def_prop_ro("samples",
                   [](nb::handle self) {
                     const auto& image = nb::cast<const Rendered&>(self).image;
                     const std::array<std::size_t, 2> shape{static_cast<std::size_t>(image.height),
                                                            static_cast<std::size_t>(image.width)};
                     return nb::ndarray<nb::numpy, const float, nb::ndim<2>>(image.samples.data(), 2, shape.data(),
                                                                             self);
                   })
      .def_ro("spp", &Rendered::spp)
      .def_ro("seconds", &Rendered::seconds)
      .def_ro("non_finite", &Rendered::non_finite)
      .def_ro("choice", &Rendered::choice);

  m.def("load", load, "file"_a, "defines"_a, "size"_a, "max_depth"_a, "crop"_a.none());
  m.def("render", render, "scene"_a, "warp"_a, "spp"_a, "time"_a.none(), "objective"_a, "sampler"_a, "seed"_a,
        "options"_a);
}
