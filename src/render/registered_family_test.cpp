// A family that exists only here is rendered with, trained, saved and loaded, by one registration.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "family/load_as.h"
#include "render/train_warp.h"
#include "scene/scene.h"
#include "train/fit_grid.h"
#include "warp/load.h"
#include "warpath/error.h"

namespace warpath {
namespace {

/// A grid that goes by another name.
class Lattice final : public Proposal {
 public:
  explicit Lattice(std::shared_ptr<const Grid> grid) : m_grid(std::move(grid)) {}
  int dims() const override { return m_grid->dims(); }
  std::string family() const override { return "lattice"; }
  void sample(Batch<const double> z, std::span<const double> u, Batch<double> y,
              std::span<double> log_q) const override {
    m_grid->sample(z, u, y, log_q);
  }
  void log_density(Batch<const double> y, std::span<double> log_q) const override { m_grid->log_density(y, log_q); }
  void save(TensorFile& file, const std::string& prefix) const override {
    m_grid->save(file, prefix);
    save_header(file, prefix, *this);
  }
  static std::shared_ptr<const Lattice> load(const TensorFile& file, const std::string& prefix) {
    return std::make_shared<Lattice>(Grid::load(file, prefix));
  }

 private:
  std::shared_ptr<const Grid> m_grid;
};

Family lattice_family() {
  const auto fit = [](Examples examples, const TrainSettings& settings, const Proposal*) {
    return std::make_shared<const Lattice>(fit_grid(examples, settings.grid));
  };
  return {"lattice", "a grid by another name",
          JointFamily{.load = load_as<Proposal, Lattice>, .fit = FitToCandidates(fit), .most_dims = kMaxDims}};
}

class RegisteredFamily : public testing::Test {
 protected:
  static void SetUpTestSuite() { register_family(lattice_family()); }

  std::shared_ptr<const Tracer> tracer() const {
    SceneOptions options;
    options.width = 16;
    options.height = 12;
    return std::make_shared<const Tracer>(
        load_scene(std::string(WARPATH_SOURCE_DIR) + "/scenes/box/scene.xml", options));
  }
  static TrainSettings quick() {
    TrainSettings settings;
    settings.examples = 2000;
    settings.seed = 3;
    return settings;
  }
  static RenderSettings two_samples() {
    RenderSettings settings;
    settings.seed = 3;
    settings.spp = 2;
    return settings;
  }
};

TEST_F(RegisteredFamily, IsListedWithTheOthersAndSuggested) {
  EXPECT_THAT(method_names(), testing::Contains("lattice"));
  EXPECT_THAT([] { parse_method("latice:film"); },
              testing::ThrowsMessage<ConfigError>(testing::HasSubstr("did you mean \"lattice\"?")));
}

TEST_F(RegisteredFamily, RendersTheImageOfWhatItIs) {
  Renderer renderer(tracer());
  const auto image = [&](const char* method) {
    return renderer.render(parse_method(method), two_samples(), quick(), "").estimator->develop().mean;
  };
  EXPECT_EQ(image("lattice:film+bounce1"), image("grid:film+bounce1"));
}

TEST_F(RegisteredFamily, IsTrainedSavedAndLoaded) {
  Renderer renderer(tracer());
  const TrainedWarp trained = train_warp(renderer, parse_method("lattice:film+bounce1"), quick());
  const auto path = std::filesystem::temp_directory_path() / fmt::format("warpath-lattice-{}.warp", ::getpid());
  save_warp(path, trained.file);
  const Method saved = parse_method(path.string());
  EXPECT_EQ(saved.layout.name(), "film+bounce1.dir");
  const auto again = renderer.render(saved, two_samples(), quick(), "").estimator->develop().mean;
  EXPECT_EQ(
      again,
      renderer.render(parse_method("lattice:film+bounce1"), two_samples(), quick(), "").estimator->develop().mean);
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace warpath
