#pragma once
#include <string>
#include <tuple>
#include <vector>

#include "core/option.h"

namespace warpath::python {

/// (name, group, help, values, default, families) of an option; the name as in Python.
using OptionRow = std::tuple<std::string, std::string, std::string, std::string, std::string, std::vector<std::string>>;

/// The rows of a table of options; families_of tells who uses one, and has nobody for an option of every method.
std::vector<OptionRow> option_rows(const std::vector<Option>& table, const auto& families_of) {
  std::vector<OptionRow> rows;
  for (const Option& option : table) {
    rows.emplace_back(python_name(option.name), option.group, option.help, option.domain(), option.defaults(),
                      families_of(option));
  }
  return rows;
}

inline std::vector<OptionRow> option_rows(const std::vector<Option>& table) {
  return option_rows(table, [](const Option&) { return std::vector<std::string>(); });
}

}  // namespace warpath::python
