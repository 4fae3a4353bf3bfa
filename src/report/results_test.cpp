#include "report/results.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "report/summary.h"
#include "warpath/error.h"

namespace warpath {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class ResultsTest : public testing::Test {
 protected:
  ResultsTest()
      : m_folder(fs::path(testing::TempDir()) / (std::string("warpath_results_") + std::to_string(getpid()))) {
    fs::create_directories(m_folder);
  }
  ~ResultsTest() override { fs::remove_all(m_folder); }
  fs::path path(const std::string& name) const { return m_folder / name; }

 private:
  fs::path m_folder;
};

MethodRun run_of(const std::string& method, double mse, double seconds) {
  MethodRun run;
  run.method = method;
  run.family = method.substr(0, method.find(':'));
  run.spp = 128;
  run.mse = mse;
  run.relmse = 4 * mse;
  run.trace_seconds = run.total_seconds = seconds;
  return run;
}

Comparison two_methods() {
  Comparison comparison;
  comparison.scene = "kitchen/scene.xml";
  comparison.reference = "ref.exr";
  comparison.width = 320;
  comparison.height = 180;
  comparison.threads = 2;
  comparison.seed = 18446744073709551615ull;
  comparison.settings = {{"max_depth", "8"}, {"epp", "16"}};
  comparison.warnings = {"scene.xml:3:1: \"<odd>\" & co"};
  comparison.results = {run_of("none", 0.020, 10), run_of("none", 0.022, 10), run_of("kdtree:film+bounce1", 0.010, 15),
                        run_of("kdtree:film+bounce1", 0.011, 15)};
  MethodRun& trained = comparison.results.back();
  trained.dims = "film+bounce1";
  trained.mean = {0.25, 0.5, 0.125};
  trained.candidates = 1000;
  trained.candidates_nonzero = 0.75;
  trained.error_curve = {{1, 0.5, 0.3, 1.2}, {2, 0.9, 0.15, kUnknown}};
  trained.training_curve = {{0.1, 2000, 0.0, 0.01}, {0.2, 4000, -1.5, -1.25}};
  return comparison;
}

TEST_F(ResultsTest, come_back_from_json_as_they_went) {
  const Comparison written = two_methods();
  write_results(path("results.json"), written);
  const Comparison read = read_results(path("results.json"));
  // The text is made field by field from the same list, so equal texts mean equal fields; a few are checked by hand.
  EXPECT_EQ(results_json(read), results_json(written));
  EXPECT_EQ(read.seed, written.seed);
  EXPECT_EQ(read.settings, written.settings);
  ASSERT_EQ(read.results.size(), 4u);
  EXPECT_EQ(read.results[3].method, "kdtree:film+bounce1");
  EXPECT_EQ(read.results[3].mean, written.results[3].mean);
  EXPECT_TRUE(std::isnan(read.results[3].mape));
  ASSERT_EQ(read.results[3].error_curve.size(), 2u);
  EXPECT_EQ(read.results[3].error_curve[1].mse, 0.15);
  EXPECT_TRUE(std::isnan(read.results[3].error_curve[1].relmse));
  EXPECT_EQ(read.results[3].training_curve[1].held_out, -1.25);
  EXPECT_EQ(read.results[3].training_curve[1].samples, 4000u);
}

TEST_F(ResultsTest, json_has_the_promised_fields) {
  const std::string json = results_json(two_methods());
  for (const char* field : {"method",
                            "family",
                            "dims",
                            "size",
                            "spp",
                            "samples",
                            "train_samples",
                            "candidate_seconds",
                            "train_seconds",
                            "warp_seconds",
                            "trace_seconds",
                            "total_seconds",
                            "candidate_cpu_seconds",
                            "train_cpu_seconds",
                            "warp_cpu_seconds",
                            "trace_cpu_seconds",
                            "total_cpu_seconds",
                            "mse",
                            "relmse",
                            "relmse_trimmed",
                            "mape",
                            "mse_raw",
                            "relmse_raw",
                            "mse_predicted",
                            "relmse_predicted",
                            "mse_rest",
                            "relmse_rest",
                            "mean",
                            "mean_rest",
                            "non_finite",
                            "scene",
                            "reference",
                            "commit",
                            "cpu",
                            "threads",
                            "seed"})
    EXPECT_THAT(json, HasSubstr("\"" + std::string(field) + "\":"));
}

TEST_F(ResultsTest, names_that_are_not_utf8_are_written_with_a_replacement) {
  Comparison comparison = two_methods();
  comparison.scene = "caf\xE9.xml";
  write_results(path("results.json"), comparison);
  EXPECT_EQ(read_results(path("results.json")).scene, "caf\xEF\xBF\xBD.xml");
}

TEST_F(ResultsTest, a_broken_file_is_an_error_with_its_place) {
  std::ofstream(path("broken.json")) << "{\n  \"results\": [}\n";
  try {
    read_results(path("broken.json"));
    FAIL() << "no error";
  } catch (const FileError& error) {
    EXPECT_THAT(error.what(), HasSubstr("broken.json:2:15: not JSON"));
  }
  std::ofstream(path("other.json")) << "{\"a\": 1}";
  EXPECT_THROW(read_results(path("other.json")), FileError);
  std::ofstream(path("types.json")) << "{\"results\": [{\"method\": 3}]}";
  EXPECT_THROW(read_results(path("types.json")), FileError);
  std::ofstream(path("newer.json")) << "{\"format\": 99, \"results\": []}";
  EXPECT_THROW(read_results(path("newer.json")), FileError);
  EXPECT_THROW(read_results(path("absent.json")), FileError);
}

TEST_F(ResultsTest, summary_groups_runs_and_compares_with_none) {
  const Comparison comparison = two_methods();
  const Summary summary = summarise(comparison);
  ASSERT_EQ(summary.methods.size(), 2u);
  EXPECT_EQ(summary.methods[summary.baseline].method, "none");
  EXPECT_EQ(summary.max_runs, 2u);
  const MethodSummary& kdtree = summary.methods[1];
  EXPECT_DOUBLE_EQ(kdtree.mse.value, 0.0105);
  EXPECT_DOUBLE_EQ(kdtree.gain_mse.value, 2.0);
  EXPECT_NEAR(kdtree.gain_mse.standard_error, 2 * std::hypot(0.001 / 0.021, 0.0005 / 0.0105), 1e-12);
  EXPECT_DOUBLE_EQ(kdtree.gain_equal_time.value, 2.0 * 10 / 15);
  EXPECT_DOUBLE_EQ(summary.methods[0].gain_mse.value, 1.0);
  EXPECT_EQ(summary.methods[0].gain_mse.standard_error, 0.0);
}

TEST_F(ResultsTest, gains_are_over_the_first_method_where_there_is_no_none) {
  Comparison comparison = two_methods();
  std::erase_if(comparison.results, [](const MethodRun& run) { return run.method == "none"; });
  comparison.results.push_back(run_of("grid:film", 0.021, 10));
  const Summary summary = summarise(comparison);
  EXPECT_EQ(summary.methods[summary.baseline].method, "kdtree:film+bounce1");
  EXPECT_DOUBLE_EQ(summary.methods[1].gain_mse.value, 0.5);
}

TEST(format_estimate, shows_the_digits_that_it_can_answer_for) {
  const auto format = [](double value, double error) {
    const FormattedEstimate e = format_estimate({value, error});
    return e.error.empty() ? e.value : e.value + " ± " + e.error;
  };
  EXPECT_EQ(format(0.0192345, 0.000312), "0.0192 ± 0.0003");
  EXPECT_EQ(format(0.0192345, 0.000152), "0.01923 ± 0.00015");
  EXPECT_EQ(format(0.0192345, kUnknown), "0.0192");
  EXPECT_EQ(format(2.1678, 0.05), "2.17 ± 0.05");
  EXPECT_EQ(format(217.8, 12.4), "218 ± 12");
  EXPECT_EQ(format(1.0, 0.0), "1");
  EXPECT_EQ(format(0.0, kUnknown), "0");
  EXPECT_EQ(format(-0.00123, 0.002), "-0.0012 ± 0.0020");
  EXPECT_EQ(format(1.234e-12, kUnknown), "1.23e-12");
  EXPECT_EQ(format(kUnknown, kUnknown), "–");
}

TEST(format_seconds, chooses_its_unit) {
  EXPECT_EQ(format_seconds(0.4249), "0.42 s");
  EXPECT_EQ(format_seconds(12.34), "12.3 s");
  EXPECT_EQ(format_seconds(247.2), "4 min 07 s");
  EXPECT_EQ(format_seconds(7260), "2 h 01 min");
}

TEST(results_table, aligns_its_columns_at_the_decimal_point) {
  EXPECT_EQ("\n" + results_table(two_methods()), R"(
kitchen/scene.xml, 320 x 180, 2 threads, seed 18446744073709551615, 2 runs (± is the standard error of their mean)
method                spp               MSE          gain            relMSE          gain   train s   warp s   trace s   total s
none                  128   0.0210 ± 0.0010   1             0.084  ± 0.004    1                   –        –     10.00     10.00
kdtree:film+bounce1   128   0.0105 ± 0.0005   2.00 ± 0.13   0.0420 ± 0.0020   2.00 ± 0.13         –        –     15.00     15.00
gain: error of none over the method's
)");
}

TEST(results_table, says_that_it_has_no_reference) {
  Comparison comparison = two_methods();
  for (MethodRun& run : comparison.results) run.mse = run.relmse = kUnknown;
  comparison.results[0].non_finite = 7;
  const std::string table = results_table(comparison);
  EXPECT_THAT(table, HasSubstr("No reference was given"));
  EXPECT_THAT(table, HasSubstr("none: 7 samples were not finite"));
  EXPECT_THAT(table, testing::Not(HasSubstr("relMSE")));
}

}  // namespace
}  // namespace warpath
