#include "tracer/emission_mask.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tracer/test_scene.h"
#include "tracer/tracer.h"

namespace warpath {
namespace {

using testing::facing;
using testing::make_ids;
using testing::make_rectangle;
using testing::make_sphere;
using testing::scale;
using testing::SceneBuilder;
using testing::translate;

// No camera ray through a pixel that the mask leaves out meets an emitter, and the mask leaves out most of the film.
TEST(EmissionMask, CoversAllThatIsSeen) {
  for (const int crop : {0, 1}) {
    SceneBuilder b;
    b.light(make_rectangle(facing({0.4f, 0.9f, -1}, {-0.1f, -0.5f, 1}, 0.3f)), Color(1.0f));
    b.light(make_sphere({-1, 0.2f, 0}, 0.3f), Color(1.0f));
    b.light(SceneBuilder::grid(2, facing({1.2f, -1, 0}, {-1, 0.3f, 1}, 0.4f)), Color(1.0f));
    Matrix4 m = scale({0.1f, 0.1f, 0.7f}) * translate({-1, -1, 0});
    b.light(Cylinder{{m, m}, false}, Color(1.0f));
    b.light(make_rectangle(facing({0, -1.8f, 3}, {0, 1, 0}, 2)), Color(1.0f));  // from behind the camera to before it
    b.look({0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 50);
    FilmSettings& film = b.scene.film;
    film.width = 97, film.height = 61;
    film.crop_width = 97, film.crop_height = 61;
    if (crop) film.crop_x = 13, film.crop_y = 21, film.crop_width = 50, film.crop_height = 33;
    const int x0 = film.crop_x, y0 = film.crop_y, width = film.crop_width;
    const Tracer tracer(std::move(b.scene));
    const auto& mask = tracer.may_see_emission();
    ASSERT_EQ(mask.size(), static_cast<std::size_t>(width) * tracer.scene().film.crop_height);
    std::size_t seen = 0;
    PathResults results;
    for (int pass = 0; pass < 50; ++pass) {
      const auto ids = make_ids(4096u * static_cast<unsigned>(pass), 4096);
      UniformSource source(9, ids);
      tracer.trace_emission(source, 4096, results);
      for (std::size_t i = 0; i < 4096; ++i) {
        if (results.radiance[i].x == 0) continue;
        ++seen;
        const int x = static_cast<int>(results.film_x[i]) - x0, y = static_cast<int>(results.film_y[i]) - y0;
        EXPECT_EQ(mask[static_cast<std::size_t>(y * width + x)], 1) << x << " " << y;
      }
    }
    const auto marked = static_cast<double>(std::count(mask.begin(), mask.end(), 1)) / static_cast<double>(mask.size());
    const double share = static_cast<double>(seen) / (50 * 4096);
    EXPECT_GT(share, 0.05);
    EXPECT_LT(marked, 2 * share + 0.1);
  }
}

}  // namespace
}  // namespace warpath
