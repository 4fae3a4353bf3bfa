#include "tracer/environment.h"

#include <algorithm>
#include <limits>

#include "tracer/sampling.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr float kSmallestSine = 0x1p-24f;

Color texel(const Image& image, int x, int y) {
  const auto& pixels = std::get<std::vector<float>>(image.pixels);
  const float* p = &pixels[(static_cast<std::size_t>(y) * image.width + x) * image.channels];
  return image.channels == 1 ? Color(p[0]) : Color(p[0], p[1], p[2]);
}

}  // namespace

Environment::Environment(const ConstantEmitter& emitter) : m_radiance(emitter.radiance) {}

Environment::Environment(const EnvmapEmitter& emitter)
    : m_image(emitter.image),
      m_scale(emitter.scale),
      m_to_world(emitter.to_world),
      m_to_local(emitter.to_world.inverse()) {
  if (!std::holds_alternative<std::vector<float>>(m_image->pixels))
    throw InternalError("an environment map must hold floats");
  const int width = m_image->width, height = std::max(m_image->height, 2);
  std::vector<float> values;
  values.reserve(static_cast<std::size_t>(width + 1) * height);
  for (int y = 0; y < height; ++y) {
    const float sine = std::sin(kPi * static_cast<float>(y) / static_cast<float>(height - 1));
    for (int x = 0; x <= width; ++x)
      values.push_back(larger(0.0f, luminance(texel(*m_image, x % width, std::min(y, m_image->height - 1)))) * sine);
  }
  m_distribution = BilinearDistribution(std::move(values), width + 1, height);
}

Vec2 Environment::direction_to_uv(const Vec3& local) const {
  return {std::atan2(local.x, -local.z) / (2 * kPi), std::acos(std::clamp(local.y, -1.0f, 1.0f)) / kPi};
}

Color Environment::lookup(const Vec2& uv) const {
  const int width = m_image->width, height = m_image->height;
  const float px = (uv.x - std::floor(uv.x)) * static_cast<float>(width) - 0.5f;
  const float py = clamp01(uv.y) * static_cast<float>(height - 1);
  const int x0 = static_cast<int>(std::floor(px)), y0 = std::min(static_cast<int>(py), std::max(height - 2, 0));
  const float tx = px - static_cast<float>(x0), ty = py - static_cast<float>(y0);
  const int left = (x0 + width) % width, right = (x0 + 1) % width, below = std::min(y0 + 1, height - 1);
  const Color upper = texel(*m_image, left, y0) * (1 - tx) + texel(*m_image, right, y0) * tx;
  const Color lower = texel(*m_image, left, below) * (1 - tx) + texel(*m_image, right, below) * tx;
  return (upper * (1 - ty) + lower * ty) * m_scale;
}

Color Environment::radiance(const Vec3& wo) const {
  if (!m_image) return m_radiance;
  return lookup(direction_to_uv(transform_vector(m_to_local, wo)));
}

float Environment::pdf(const Vec3& wo) const {
  if (!m_image) return 1 / (4 * kPi);
  const Vec3 local = transform_vector(m_to_local, wo);
  Vec2 uv = direction_to_uv(local);
  uv.x -= 0.5f / static_cast<float>(m_image->width);
  uv.x -= std::floor(uv.x);
  const float sine = larger(std::hypot(local.x, local.z), kSmallestSine);
  return m_distribution.pdf(uv) / (2 * kPi * kPi * sine);
}

Vec3 Environment::sample(const Vec2& u, float& pdf_out) const {
  if (!m_image) {
    pdf_out = 1 / (4 * kPi);
    return sample_sphere(u);
  }
  float density;
  const Vec2 uv = m_distribution.sample(u, density);
  const float theta = uv.y * kPi, phi = (uv.x + 0.5f / static_cast<float>(m_image->width)) * 2 * kPi;
  const float sine = std::sin(theta);
  pdf_out = density / (2 * kPi * kPi * larger(sine, kSmallestSine));
  return transform_vector(m_to_world, {std::sin(phi) * sine, std::cos(theta), -std::cos(phi) * sine}).normalized();
}

}  // namespace warpath
