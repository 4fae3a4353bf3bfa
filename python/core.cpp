// The Integrator of the C++ library as Python sees it. What people call is python/warpath/integrator.py.
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "arrays.h"
#include "training.h"
#include "warpath/integrator.h"

using namespace nanobind::literals;
using namespace warpath;
using namespace warpath::python;

namespace {

Iteration end(Integrator& integrator, bool adapt) {
  const nb::gil_scoped_release release;
  const StopOnInterrupt stop;
  return integrator.end(adapt);
}

void bind_results(nb::module_& m) {
  nb::class_<Iteration>(m, "Iteration", "What one iteration says of each integral.")
      .def_ro("mean", &Iteration::mean)
      .def_ro("covariance", &Iteration::covariance, "C x C, row by row, of the means")
      .def_ro("neval", &Iteration::neval)
      .def_ro("non_finite", &Iteration::non_finite, "points where f was not finite; they count as zero")
      .def_ro("effective_samples", &Iteration::effective_samples,
              "of the first integral: (sum |w|)^2 / sum w^2, w = f / q")
      .def_ro("unweighting_efficiency", &Iteration::unweighting_efficiency, "of the first integral: mean |w| / max |w|")
      .def_ro("adapted", &Iteration::adapted, "whether the warp learned from it")
      .def_ro("trained", &Iteration::trained,
              "examples that flows were trained on after it, each as often as it was used")
      .def_ro("warp", &Iteration::warp, "that drew it")
      .def("sdev", &Iteration::sdev, "integral"_a = 0);

  nb::class_<Integral>(m, "Integral", "Several iterations together.")
      .def(nb::init<std::vector<Iteration>>(), "iterations"_a)
      .def_prop_ro("count", &Integral::count)
      .def("mean", &Integral::mean, "integral"_a = 0)
      .def("sdev", &Integral::sdev, "integral"_a = 0)
      .def("chi2", &Integral::chi2, "integral"_a = 0)
      .def("Q", &Integral::Q, "integral"_a = 0)
      .def_prop_ro("dof", &Integral::dof)
      .def_prop_ro("neval", &Integral::neval)
      .def_prop_ro("non_finite", &Integral::non_finite)
      .def_prop_ro("covariance", &Integral::covariance)
      .def("converged", &Integral::converged, "rtol"_a, "atol"_a)
      .def("summary", &Integral::summary);

  m.def("with_error", &with_error, "mean"_a, "sdev"_a, "`1.0057(64)`: a value with its standard error.");
}

void bind_integrator(nb::module_& m) {
  nb::class_<Integrator>(m, "Integrator", "Asked for points and told values, see warpath.Integrator.")
      .def(
          "__init__",
          [](Integrator* self, const std::vector<std::pair<double, double>>& bounds, std::string warp,
             std::uint64_t seed, std::string sampler, std::size_t memory) {
            std::vector<Interval> intervals;
            for (const auto& [low, high] : bounds) intervals.push_back({low, high});
            new (self) Integrator(std::move(intervals), {std::move(warp), seed, std::move(sampler), memory});
          },
          "bounds"_a, "warp"_a, "seed"_a, "sampler"_a, "memory"_a)
      .def_prop_ro("dims", &Integrator::dims)
      .def_prop_ro("warp", &Integrator::warp)
      .def_prop_ro("bounds",
                   [](const Integrator& self) {
                     std::vector<std::pair<double, double>> bounds;
                     for (const Interval& i : self.bounds()) bounds.emplace_back(i.low, i.high);
                     return bounds;
                   })
      .def("begin", &Integrator::begin, "neval"_a)
      .def(
          "draw",
          [](const Integrator& self, std::size_t first, Rows<double> x, Numbers<double> weight) {
            const nb::gil_scoped_release release;
            self.draw(first, batch(x), span(weight));
          },
          "first"_a, "x"_a, "weight"_a)
      .def(
          "add",
          [](Integrator& self, Rows<const double> x, Numbers<const double> weight, Rows<const double> f) {
            check(f.shape(0) == x.shape(0) && weight.shape(0) == x.shape(0), "x, weight and f have different lengths");
            self.add(batch(x), span(weight), batch(f));
          },
          "x"_a, "weight"_a, "f"_a)
      .def("end", end, "adapt"_a)
      .def(
          "sample",
          [](Integrator& self, Rows<double> x, Numbers<double> weight) {
            const nb::gil_scoped_release release;
            self.sample(batch(x), span(weight));
          },
          "x"_a, "weight"_a)
      .def(
          "weights",
          [](const Integrator& self, Rows<const double> x, Numbers<double> weight) {
            check(x.shape(1) == static_cast<std::size_t>(self.dims()),
                  "x has another number of columns than dimensions");
            check(weight.shape(0) == x.shape(0), "x and weight have different lengths");
            self.weights(batch(x), span(weight));
          },
          "x"_a, "weight"_a)
      .def("save", &Integrator::save, "path"_a)
      .def_static(
          "load",
          [](const std::filesystem::path& path, std::string warp, std::uint64_t seed, std::string sampler,
             std::size_t memory) {
            return Integrator::load(path, {std::move(warp), seed, std::move(sampler), memory});
          },
          "path"_a, "warp"_a, "seed"_a, "sampler"_a, "memory"_a);
}

}  // namespace

NB_MODULE(_core, m) {
  m.doc() = "Compiled parts of warpath.";
  register_errors();
  bind_results(m);
  bind_integrator(m);
  bind_training(m);
}
