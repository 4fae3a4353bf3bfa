#include "report/html.h"

#include <Imath/half.h>
#include <OpenImageIO/strutil.h>

#include <algorithm>
#include <bit>
#include <functional>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "report/summary.h"
#include "report/web_sources.h"
#include "warpath/error.h"

namespace warpath {
namespace {

using Json = nlohmann::ordered_json;

/// Half floats, little endian as every browser has them, in base64.
class HalfBytes {
 public:
  explicit HalfBytes(std::size_t count) { m_bytes.reserve(2 * count); }
  void add(float value) {
    constexpr float kLargest = 65504.0f;
    const float clipped = std::isfinite(value) ? std::clamp(value, -kLargest, kLargest) : value;
    const std::uint16_t bits = Imath::half(clipped).bits();
    m_bytes.push_back(static_cast<char>(bits & 0xFF));
    m_bytes.push_back(static_cast<char>(bits >> 8));
  }
  std::string base64() const { return OIIO::Strutil::base64_encode(m_bytes); }

 private:
  std::string m_bytes;
};

Json image_json(const ImageRgb& image) {
  HalfBytes halves(3 * image.pixels.size());
  for (const Color& pixel : image.pixels)
    for (int c = 0; c < 3; ++c) halves.add(pixel[c]);
  return {{"width", image.width}, {"height", image.height}, {"halves", halves.base64()}};
}

Json grid_json(const DensityGrid& grid) {
  WARPATH_CHECK_EQ(grid.values.size(), static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height));
  HalfBytes halves(grid.values.size());
  for (const float value : grid.values) halves.add(value);
  return {{"width", grid.width}, {"height", grid.height}, {"halves", halves.base64()}};
}

Json density_json(const DensityPicture& picture) {
  WARPATH_CHECK_EQ(picture.learned.width, picture.candidates.width);
  WARPATH_CHECK_EQ(picture.learned.height, picture.candidates.height);
  return {{"method", picture.method},
          {"x_dimension", picture.x_dimension},
          {"y_dimension", picture.y_dimension},
          {"slice", picture.slice},
          {"learned", grid_json(picture.learned)},
          {"candidates", grid_json(picture.candidates)}};
}

/// The number itself, for bars and marks, and the text that table and page have in common.
Json estimate_json(const Estimate& estimate) {
  const FormattedEstimate text = format_estimate(estimate);
  return {{"value", estimate.value}, {"text", text.value}, {"error", text.error}};
}

Json summary_json(const Comparison& comparison) {
  const Summary summary = summarise(comparison);
  Json methods = Json::array();
  for (const MethodSummary& m : summary.methods) {
    methods.push_back({{"method", m.method},
                       {"runs", m.runs.size()},
                       {"spp", estimate_json({m.spp.value, 0.0})},
                       {"mse", estimate_json(m.mse)},
                       {"relmse", estimate_json(m.relmse)},
                       {"relmse_trimmed", estimate_json(m.relmse_trimmed)},
                       {"mape", estimate_json(m.mape)},
                       {"gain_mse", estimate_json(m.gain_mse)},
                       {"gain_relmse", estimate_json(m.gain_relmse)},
                       {"gain_relmse_trimmed", estimate_json(m.gain_relmse_trimmed)},
                       {"gain_equal_time", estimate_json(m.gain_equal_time)},
                       {"non_finite", m.non_finite}});
  }
  return {{"baseline", summary.baseline},
          {"max_runs", summary.max_runs},
          {"has_errors", summary.has_errors},
          {"methods", std::move(methods)}};
}

std::string dump(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

std::string page_data(const ReportData& data) {
  Json images = Json::array();
  for (const ReportImage& image : data.images) {
    images.push_back(image_json(image.image));
    images.back()["method"] = image.method;
  }
  Json densities = Json::array();
  for (const DensityPicture& picture : data.densities) densities.push_back(density_json(picture));
  Json comparison = Json::parse(results_json(data.comparison));
  // JavaScript's numbers hold 53 bits.
  comparison["seed"] = std::to_string(data.comparison.seed);
  for (Json& run : comparison["results"]) run["seed"] = run["seed"].dump();
  const Json json{{"comparison", std::move(comparison)},
                  {"summary", summary_json(data.comparison)},
                  {"reference", data.reference ? image_json(*data.reference) : Json()},
                  {"images", std::move(images)},
                  {"densities", std::move(densities)}};
  // Within a script element only "<" can begin something else than JSON: a comment, or the end of the element.
  std::string text = dump(json);
  for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at))
    text.replace(at, 1, "\\u003c");
  return text;
}

std::string escape_html(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

/// Valid UTF-8 in any case: JSON's writer replaces what is not.
std::string to_utf8(const std::string& text) { return Json::parse(dump(Json(text))).get<std::string>(); }

/// Replaces each {{slot}} of the template once; what is filled in is not looked at again.
std::string fill(std::string_view page, const std::function<std::string(std::string_view)>& slot) {
  std::string result;
  while (true) {
    const std::size_t open = page.find("{{");
    result += page.substr(0, open);
    if (open == std::string_view::npos) return result;
    const std::size_t close = page.find("}}", open);
    WARPATH_CHECK(close != std::string_view::npos);
    result += slot(page.substr(open + 2, close - open - 2));
    page.remove_prefix(close + 2);
  }
}

}  // namespace

std::string report_html(const ReportData& data) {
  return fill(web::kReportHtml, [&](std::string_view slot) -> std::string {
    if (slot == "title") return escape_html(to_utf8(data.comparison.scene));
    if (slot == "style") return std::string(web::kStyle);
    if (slot == "script") return std::string(web::kScript);
    WARPATH_CHECK_EQ(slot, std::string_view("data"));
    return page_data(data);
  });
}

void write_report(const std::filesystem::path& folder, const ReportData& data) {
  write_atomically(folder / "index.html", report_html(data));
  write_results(folder / "results.json", data.comparison);
}

}  // namespace warpath
