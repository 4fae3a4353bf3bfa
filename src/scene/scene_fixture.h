#pragma once
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <sstream>

#include "scene/scene.h"
#include "scene/temporary_files.h"
#include "warpath/error.h"

namespace warpath {

inline constexpr std::string_view kSensor = R"(<sensor type="perspective"/>)";

/// For tests that load small scenes; the log is caught.
class SceneTest : public testing::Test {
 protected:
  void SetUp() override {
    m_before = spdlog::default_logger();
    auto logger = std::make_shared<spdlog::logger>("test", std::make_shared<spdlog::sinks::ostream_sink_mt>(m_log));
    logger->set_pattern("%v");
    spdlog::set_default_logger(logger);
  }
  void TearDown() override { spdlog::set_default_logger(m_before); }

  Scene load(const std::string& body, const SceneOptions& options = {}) {
    return load_scene(m_files.write("s.xml", "<scene version=\"3.0.0\">\n" + body + "\n</scene>"), options);
  }
  Scene load_with_sensor(const std::string& body) { return load(std::string(kSensor) + "\n" + body); }
  /// The error for elements that start in line 3, column 1.
  std::string error(const std::string& body) {
    return error_of<SceneError>(m_files, [&] { load_with_sensor(body); });
  }
  std::string warnings() const {
    std::string text = m_log.str();
    const std::string folder = m_files.folder().string() + "/";
    for (std::size_t at = text.find(folder); at != std::string::npos; at = text.find(folder))
      text.erase(at, folder.size());
    return text;
  }
  template <class T>
  T bsdf(const std::string& body) {
    const Scene scene = load_with_sensor(body);
    m_textures = scene.textures;
    EXPECT_TRUE(std::holds_alternative<T>(scene.bsdfs.back().model));
    return std::get<T>(scene.bsdfs.back().model);
  }
  Color constant(TextureId id) const {
    return std::get<ConstantTexture>(m_textures.at(static_cast<std::size_t>(id))).value;
  }
  template <class T>
  T emitter(const std::string& body) {
    return std::get<T>(load_with_sensor(body).emitters.at(0).model);
  }

  TemporaryFiles m_files;
  std::vector<Texture> m_textures;
  std::ostringstream m_log;
  std::shared_ptr<spdlog::logger> m_before;
};

inline void expect_color(const Color& color, float r, float g, float b, float tolerance = 2e-6f) {
  EXPECT_NEAR(color.x, r, tolerance);
  EXPECT_NEAR(color.y, g, tolerance);
  EXPECT_NEAR(color.z, b, tolerance);
}

}  // namespace warpath
