// Training on candidates that Python evaluates, and the proposals that come of it. What people call is
// python/warpath/training.py.
#include "training.h"

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <tuple>

#include "arrays.h"
#include "core/parallel.h"
#include "core/rng.h"
#include "core/streams.h"
#include "family/fit.h"
#include "family/training_options.h"
#include "family/warp_file.h"
#include "options.h"
#include "warp/scratch.h"

namespace warpath::python {
namespace {

using namespace nb::literals;

constexpr std::size_t kBatch = 2048;

void for_batches(std::size_t count, const auto& body) {
  parallel((count + kBatch - 1) / kBatch,
           [&](std::size_t b) { body(b * kBatch, std::min(kBatch, count - b * kBatch)); });
}

Candidates make_candidates(const std::string& layout, std::uint64_t count, std::uint64_t seed) {
  Candidates candidates;
  candidates.layout = Layout::parse(layout);
  candidates.seed = mix64(seed ^ kCandidateStream);
  candidates.target.resize(count);
  return candidates;
}

void primary_samples(const Candidates& candidates, std::uint64_t first, const Rows<float>& y) {
  check(y.shape(0) == static_cast<std::size_t>(candidates.layout.dims()),
        "y has another number of rows than dimensions");
  check(first + y.shape(1) <= candidates.size(), "there are not so many candidates");
  const nb::gil_scoped_release release;
  const Batch<float> columns = batch(y);
  for_batches(columns.cols(), [&](std::size_t begin, std::size_t rows) {
    const Scratch<float> one(columns.rows());
    for (std::size_t i = begin; i < begin + rows; ++i) {
      candidates.primary_sample(first + i, one.data());
      for (std::size_t d = 0; d < columns.rows(); ++d) columns(d, i) = one[d];
    }
  });
}

void tell(Candidates& candidates, std::uint64_t first, const Numbers<const float>& target) {
  check(first + target.shape(0) <= candidates.size(), "there are not so many candidates");
  for (std::size_t i = 0; i < target.shape(0); ++i) {
    const float g = target(i);
    const bool usable = std::isfinite(g) && g >= 0;
    candidates.target[first + i] = usable ? g : 0.0f;
    candidates.non_finite += !usable;
  }
}

/// A proposal with the names of what it warps, and how its training went.
struct Trained {
  WarpFile file;
  TrainLog log;

  const Proposal& proposal() const { return *file.proposal; }
};

Trained train_on(const Candidates& candidates, const std::string& family, const TrainingOptions& options,
                 std::uint64_t seed, const Trained* init) {
  const nb::gil_scoped_release release;
  const StopOnInterrupt stop;
  const JointFamily& joint = joint_family(family);
  options.check_used({family});
  const TrainSettings settings = options.settings(seed);
  Fit fit = warpath::fit(joint, candidates, settings, init ? &init->proposal() : nullptr);
  Trained trained;
  trained.log = std::move(fit.log);
  trained.file.proposal = std::move(fit.proposal);
  trained.file.layout = candidates.layout;
  trained.file.settings = {{"method", fmt::format("{}:{}", family, candidates.layout.name())},
                           {"candidates", std::to_string(candidates.size())},
                           {"uniform_share", fmt::format("{}", settings.uniform_share)},
                           {"seed", std::to_string(seed)},
                           {"train_seconds", fmt::format("{:.3f}", trained.log.seconds)},
                           {"stopped", trained.log.stopped}};
  return trained;
}

Trained load(const std::filesystem::path& path) {
  Trained trained;
  trained.file = load_warp(path);
  if (!trained.file.proposal)
    throw ConfigError(
        fmt::format("{}: a {} needs a renderer that tells it of each vertex; it cannot draw numbers by itself",
                    path.string(), family_of(trained.file)));
  return trained;
}

/// Samples first ... first + N - 1 of a seed: y, D x N, and 1 / q. The component of a mixture is stratified over each
/// batch if `stratified`; then every sample must stand for the whole integral.
void draw(const Trained& trained, std::uint64_t seed, std::uint64_t first, const Rows<float>& y,
          const Numbers<float>& inv_q, bool stratified) {
  const auto dims = static_cast<std::size_t>(trained.proposal().dims());
  check(y.shape(0) == dims, "y has another number of rows than dimensions");
  check(y.shape(1) == inv_q.shape(0), "y and inv_q have different lengths");
  const nb::gil_scoped_release release;
  const Batch<float> columns = batch(y);
  const std::uint64_t latent_seed = mix64(seed ^ kLatentStream);
  for_batches(columns.cols(), [&](std::size_t begin, std::size_t rows) {
    const Scratch<double> numbers(rows * (dims + 2));
    const Batch<double> points(numbers.data(), rows, dims);
    const std::span<double> u(numbers.data() + rows * dims, rows), log_q(numbers.data() + rows * (dims + 1), rows);
    for (std::size_t i = 0; i < rows; ++i) {
      const std::uint64_t key = sample_key(latent_seed, first + begin + i);
      for (std::size_t d = 0; d < dims; ++d)
        points(i, d) = sample_double(key, trained.file.layout.dimension(static_cast<int>(d)));
      u[i] = sample_double(key, kComponentDimension);
      if (stratified) u[i] = (static_cast<double>(i) + u[i]) / static_cast<double>(rows);
    }
    trained.proposal().sample(points, u, points, log_q);
    for (std::size_t i = 0; i < rows; ++i) {
      for (std::size_t d = 0; d < dims; ++d) columns(d, begin + i) = to_primary(points(i, d));
      inv_q(begin + i) = static_cast<float>(std::exp(-log_q[i]));
    }
  });
}

void log_density(const Trained& trained, const Rows<const double>& y, const Numbers<double>& log_q) {
  check(y.shape(1) == static_cast<std::size_t>(trained.proposal().dims()),
        "y has another number of columns than dimensions");
  check(y.shape(0) == log_q.shape(0), "y and log_q have different lengths");
  const nb::gil_scoped_release release;
  const Batch<const double> points = batch(y);
  for_batches(points.rows(), [&](std::size_t begin, std::size_t rows) {
    trained.proposal().log_density(points.rows_from(begin, rows), span(log_q).subspan(begin, rows));
  });
}

std::vector<OptionRow> training_options() {
  TrainSettings settings;
  return option_rows(training_option_table(settings), [](const Option& option) { return users_of(option); });
}

/// Name, kind, bounce and size of each group.
std::vector<std::tuple<std::string, std::string, int, int>> groups(const Layout& layout) {
  std::vector<std::tuple<std::string, std::string, int, int>> all;
  for (const Group group : layout.groups()) {
    const std::string name = group.name();
    all.emplace_back(name, name.substr(name.find('.') + 1), group.bounce, group.size());
  }
  return all;
}

}  // namespace

void bind_training(nb::module_& m) {
  nb::class_<Layout>(m, "Layout",
                     "The chosen dimensions: which numbers of a path are warped, in the order of their use.")
      .def(
          "__init__", [](Layout* self, const std::string& names) { new (self) Layout(Layout::parse(names)); },
          "names"_a)
      .def_prop_ro("name", &Layout::name)
      .def_prop_ro("dims", &Layout::dims)
      .def_prop_ro("groups", groups, "(name, kind, bounce, size) of each group");

  nb::class_<Candidates>(m, "Candidates", "Asked for primary samples and told their targets, see warpath.Candidates.")
      .def(
          "__init__",
          [](Candidates* self, const std::string& layout, std::uint64_t count, std::uint64_t seed) {
            new (self) Candidates(make_candidates(layout, count, seed));
          },
          "layout"_a, "count"_a, "seed"_a)
      .def_ro("layout", &Candidates::layout)
      .def_prop_ro("count", &Candidates::size)
      .def_ro("non_finite", &Candidates::non_finite)
      .def("primary_samples", primary_samples, "first"_a, "y"_a, "y: D x N, which is written")
      .def("tell", tell, "first"_a, "target"_a);

  nb::class_<TrainingOptions>(m, "TrainingOptions", "Options of training, named as those of the command line.")
      .def(nb::init<>())
      .def("set", &TrainingOptions::set, "name"_a, "value"_a, "value: as text")
      .def(
          "check_used", [](const TrainingOptions& o, const std::string& family) { o.check_used({family}); }, "family"_a)
      .def("candidate_count", [](const TrainingOptions& o) { return candidate_count(o.settings(0)); });
  m.def("training_options", training_options, "(name, group, help, values, default, families) of each option");
  m.def(
      "families",
      [](bool joint) {
        return family_names([joint](const Family& f) { return joint ? f.joint() != nullptr : !f.is_container(); });
      },
      "joint"_a, "Names of the families; joint: of those that draw chosen numbers of the whole path");

  nb::class_<Trained>(m, "Warp", "A trained proposal, see warpath.Warp.")
      .def_prop_ro("layout", [](const Trained& self) { return self.file.layout; })
      .def_prop_ro("family", [](const Trained& self) { return family_of(self.file); })
      .def_prop_ro("settings", [](const Trained& self) { return self.file.settings; })
      .def_prop_rw(
          "scene", [](const Trained& self) { return self.file.scene; },
          [](Trained& self, std::string scene) { self.file.scene = std::move(scene); })
      .def_prop_ro("seconds", [](const Trained& self) { return self.log.seconds; })
      .def_prop_ro("stopped", [](const Trained& self) { return self.log.stopped; })
      .def_prop_ro("log",
                   [](const Trained& self) {
                     std::vector<std::tuple<double, std::uint64_t, double, double>> points;
                     for (const auto& p : self.log.points)
                       points.emplace_back(p.seconds, p.samples, p.loss, p.held_out);
                     return points;
                   })
      .def("draw", draw, "seed"_a, "first"_a, "y"_a, "inv_q"_a, "stratified"_a)
      .def("log_density", log_density, "y"_a, "log_q"_a)
      .def(
          "save", [](const Trained& self, const std::filesystem::path& path) { save_warp(path, self.file); }, "path"_a)
      .def_static("load", load, "path"_a);

  m.def("train", train_on, "candidates"_a, "family"_a, "options"_a, "seed"_a, "init"_a.none());
}

}  // namespace warpath::python
