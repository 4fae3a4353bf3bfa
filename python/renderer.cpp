// The embedded path tracer as Python sees it. What people call is python/warpath/renderer.py.
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <map>
#include <memory>

#include "arrays.h"
#include "core/log.h"
#include "core/stopwatch.h"
#include "family/training_options.h"
#include "options.h"
#include "render/render_options.h"
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

using Texts = std::map<std::string, std::string>;

/// Sets options by the rows of a table; names as in Python.
void set_all(const std::vector<Option>& table, const Texts& options) {
  for (const auto& [name, text] : options) find_option(table, option_name(name)).set(text, name);
}

std::vector<OptionRow> scene_options() {
  SceneRequest request;
  return option_rows(scene_option_table(request));
}

std::vector<OptionRow> render_options() {
  RenderSettings settings;
  return option_rows(render_option_table(settings));
}

LoadedScene load(const std::filesystem::path& file, std::vector<std::pair<std::string, std::string>> parameters,
                 const Texts& options) {
  const nb::gil_scoped_release release;
  SceneRequest request{.file = file, .parameters = std::move(parameters)};
  set_all(scene_option_table(request), options);
  return {std::make_shared<const Tracer>(load_scene(request))};
}

/// What a render gave.
struct RenderedImage {
  ImageEstimate image;
  double spp = 0, seconds = 0;
  std::uint64_t non_finite = 0;
  std::string choice;
};

RenderedImage render(const LoadedScene& scene, const std::string& warp, const Texts& options,
                     const TrainingOptions& training) {
  const nb::gil_scoped_release release;
  const StopOnInterrupt stop;
  const Stopwatch clock;
  const Method method = parse_method(warp);
  RenderSettings settings;
  set_all(render_option_table(settings), options);
  training.check_used({method.trained_family()});
  Renderer renderer(scene.tracer);
  const Rendered rendered = renderer.render(method, settings, training.settings(settings.seed), "");
  // Python hears of Ctrl-C; half an image by mistake helps nobody there.
  if (g_interrupted) throw Interrupted{};
  const ImageEstimator& estimator = *rendered.estimator;
  return {estimator.develop(), estimator.spp(), clock.wall(), estimator.non_finite(), rendered.choice};
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

  nb::class_<RenderedImage>(m, "Rendered", "See warpath.Image.")
      .def_prop_ro("mean",
                   [](nb::handle self) {
                     const auto& image = nb::cast<const RenderedImage&>(self).image;
                     return colours(self, image, image.mean);
                   })
      .def_prop_ro("variance",
                   [](nb::handle self) {
                     const auto& image = nb::cast<const RenderedImage&>(self).image;
                     return colours(self, image, image.variance);
                   })
      .def_prop_ro("samples",
                   [](nb::handle self) {
                     const auto& image = nb::cast<const RenderedImage&>(self).image;
                     const std::array<std::size_t, 2> shape{static_cast<std::size_t>(image.height),
                                                            static_cast<std::size_t>(image.width)};
                     return nb::ndarray<nb::numpy, const float, nb::ndim<2>>(image.samples.data(), 2, shape.data(),
                                                                             self);
                   })
      .def_ro("spp", &RenderedImage::spp)
      .def_ro("seconds", &RenderedImage::seconds)
      .def_ro("non_finite", &RenderedImage::non_finite)
      .def_ro("choice", &RenderedImage::choice);

  m.def("scene_options", scene_options,
        "(name, group, help, values, default, families) of each; families is empty: all");
  m.def("render_options", render_options, "the same of the options of a render");
  m.def("load", load, "file"_a, "parameters"_a, "options"_a);
  m.def("render", render, "scene"_a, "warp"_a, "options"_a, "training"_a);
}
