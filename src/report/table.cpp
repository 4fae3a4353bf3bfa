#include <algorithm>
#include <cmath>

#include "report/summary.h"
#include "warpath/error.h"

namespace warpath {
namespace {

/// Columns that a terminal needs for UTF-8 text of characters one column wide.
std::size_t display_width(std::string_view text) {
  return std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; });
}

std::string padding(std::size_t width, std::string_view text) {
  return std::string(width - std::min(width, display_width(text)), ' ');
}

/// A column of numbers meets at the decimal point: `  12.5  ± 0.3 `.
struct Cell {
  std::string before;  ///< up to the decimal point
  std::string after;   ///< from the decimal point on
  std::string error;   ///< ` ± 0.3`
};

Cell number_cell(const FormattedEstimate& number) {
  const std::size_t point = std::min(number.value.find('.'), number.value.size());
  return {number.value.substr(0, point), number.value.substr(point),
          number.error.empty() ? "" : fmt::format(" ± {}", number.error)};
}

struct Column {
  std::string title;
  std::vector<Cell> cells;
  bool left = false;

  /// The lines of the column, title first, all of one width.
  std::vector<std::string> lines() const {
    std::size_t before = 0, after = 0, error = 0;
    for (const Cell& cell : cells) {
      before = std::max(before, display_width(cell.before));
      after = std::max(after, display_width(cell.after));
      error = std::max(error, display_width(cell.error));
    }
    std::vector<std::string> result{title};
    for (const Cell& cell : cells)
      result.push_back(left ? cell.before
                            : padding(before, cell.before) + cell.before + cell.after + padding(after, cell.after) +
                                  cell.error + padding(error, cell.error));
    std::size_t width = 0;
    for (const std::string& line : result) width = std::max(width, display_width(line));
    for (std::string& line : result) line = left ? line + padding(width, line) : padding(width, line) + line;
    return result;
  }
};

std::string heading(const Comparison& comparison, const Summary& summary) {
  std::string text =
      fmt::format("{}, {} x {}, {} thread{}, seed {}", comparison.scene, comparison.width, comparison.height,
                  comparison.threads, comparison.threads == 1 ? "" : "s", comparison.seed);
  if (summary.max_runs > 1) text += fmt::format(", {} runs (± is the standard error of their mean)", summary.max_runs);
  return text + "\n";
}

}  // namespace

std::string results_table(const Comparison& comparison) {
  const Summary summary = summarise(comparison);
  if (summary.methods.empty()) return "no results\n";

  std::vector<Column> columns;
  const auto add_numbers = [&](std::string title, Estimate MethodSummary::*field) {
    Column& column = columns.emplace_back(Column{std::move(title), {}});
    for (const MethodSummary& m : summary.methods) column.cells.push_back(number_cell(format_estimate(m.*field)));
  };
  // Times come from one machine on one day: their spread over runs says little, so they are shown without.
  const auto add_seconds = [&](std::string title, Estimate MethodSummary::*field) {
    Column& column = columns.emplace_back(Column{std::move(title), {}});
    for (const MethodSummary& m : summary.methods)
      column.cells.push_back(number_cell({(m.*field).value == 0 ? "–" : fmt::format("{:.2f}", (m.*field).value), ""}));
  };

  columns.push_back({"method", {}, true});
  for (const MethodSummary& m : summary.methods) columns[0].cells.push_back({m.method, "", ""});
  columns.push_back({"spp", {}});
  for (const MethodSummary& m : summary.methods)
    columns.back().cells.push_back(number_cell({fmt::format("{:.4g}", m.spp.value), ""}));
  if (summary.has_errors) {
    add_numbers("MSE", &MethodSummary::mse);
    add_numbers("gain", &MethodSummary::gain_mse);
    add_numbers("relMSE", &MethodSummary::relmse);
    add_numbers("gain", &MethodSummary::gain_relmse);
  }
  add_seconds("train s", &MethodSummary::training_seconds);
  add_seconds("warp s", &MethodSummary::warp_seconds);
  add_seconds("trace s", &MethodSummary::trace_seconds);
  add_seconds("total s", &MethodSummary::total_seconds);

  std::string text = heading(comparison, summary);
  std::vector<std::string> rows(summary.methods.size() + 1);
  for (const Column& column : columns) {
    const std::vector<std::string> lines = column.lines();
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i] += (rows[i].empty() ? "" : "   ") + lines[i];
  }
  for (std::string& row : rows) {
    row.erase(row.find_last_not_of(' ') + 1);
    text += row + "\n";
  }
  if (summary.has_errors)
    text += fmt::format("gain: error of {} over the method's\n", summary.methods[summary.baseline].method);
  else
    text += "No reference was given, so no errors are shown: --reference ref.exr.\n";
  for (const MethodSummary& m : summary.methods)
    if (m.non_finite > 0)
      text += fmt::format("{}: {} samples were not finite and count as zero\n", m.method, m.non_finite);
  return text;
}

}  // namespace warpath
