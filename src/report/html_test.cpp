#include "report/html.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "warpath/error.h"

namespace warpath {
namespace {

using testing::HasSubstr;
using testing::Not;

ReportData small_report() {
  ReportData data;
  data.comparison.scene = "room.xml";
  data.comparison.seed = 18446744073709551615ull;
  MethodRun run;
  run.method = "grid:film";
  data.comparison.results.push_back(run);
  data.images.push_back({"grid:film", ImageRgb(2, 1, Color(1.0f, 0.5f, 1e9f))});
  data.densities.push_back({"grid:film", "film.x", "film.y", "", {2, 1, {0.5f, 1.5f}}, {2, 1, {1.0f, 1.0f}}});
  return data;
}

std::string data_block(const std::string& html) {
  const std::string open = "<script type=\"application/json\" id=\"data\">";
  const std::size_t begin = html.find(open) + open.size();
  return html.substr(begin, html.find("</script>", begin) - begin);
}

TEST(report_html, holds_its_data_as_json) {
  const std::string html = report_html(small_report());
  const auto json = nlohmann::json::parse(data_block(html));
  EXPECT_EQ(json["comparison"]["scene"], "room.xml");
  EXPECT_EQ(json["comparison"]["seed"], "18446744073709551615");  // beyond the 53 bits of JavaScript's numbers
  EXPECT_TRUE(json["reference"].is_null());
  EXPECT_EQ(json["images"][0]["width"], 2);
  // Halves, little endian: 1 is 0x3C00, 0.5 is 0x3800, the largest 0x7BFF; in base64 the six values of two pixels.
  EXPECT_EQ(json["images"][0]["halves"], "ADwAOP97ADwAOP97");
  EXPECT_EQ(json["densities"][0]["learned"]["halves"], "ADgAPg==");
}

TEST(report_html, has_no_slot_left_and_names_nothing_outside_itself) {
  const std::string html = report_html(small_report());
  for (const char* slot : {"{{title}}", "{{style}}", "{{data}}", "{{script}}"}) EXPECT_THAT(html, Not(HasSubstr(slot)));
  for (const char* outside : {"src=", "@import", "url(", "fetch(", "https:"})
    EXPECT_THAT(html, Not(HasSubstr(outside)));
  EXPECT_THAT(html, HasSubstr("default-src 'none'"));
}

TEST(report_html, lets_no_name_act_as_markup) {
  ReportData data = small_report();
  data.comparison.scene = "</title></script><script>alert(1)</script><!--{{script}}\xFF";
  data.comparison.warnings = {"<!-- <script>"};
  const std::string html = report_html(data);
  EXPECT_THAT(html, Not(HasSubstr("<script>alert(1)")));
  EXPECT_THAT(html, HasSubstr("<title>&lt;/title&gt;&lt;/script&gt;"));
  EXPECT_THAT(data_block(html), Not(HasSubstr("<")));
  const auto json = nlohmann::json::parse(data_block(html));
  EXPECT_EQ(json["comparison"]["scene"], "</title></script><script>alert(1)</script><!--{{script}}\uFFFD");
}

TEST(report_html, refuses_grids_that_do_not_match) {
  ReportData data = small_report();
  data.densities[0].learned.values.pop_back();
  EXPECT_THROW(report_html(data), InternalError);
  data = small_report();
  data.densities[0].candidates = {1, 2, {1, 1}};
  EXPECT_THROW(report_html(data), InternalError);
}

TEST(write_report, makes_page_and_results) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("warpath_report_" + std::to_string(getpid()));
  write_report(folder / "deep", small_report());
  EXPECT_TRUE(std::filesystem::exists(folder / "deep" / "index.html"));
  EXPECT_EQ(read_results(folder / "deep" / "results.json").results.size(), 1u);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / "deep"), {}), 2);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace warpath
