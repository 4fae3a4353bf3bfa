#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace warpath {

/// Where an option's value goes: read from text, and told as text.
struct OptionValue {
  std::string domain;                           ///< what it may be, in short: `1 to 64`, `mean or rms`
  std::function<void(const std::string&)> set;  ///< throws ConfigError that says what is wrong with the text
  std::function<std::string()> get;             ///< the value as it is; empty for none
};

/// The place of a value for some user of an option, such as a family of warps.
struct OptionUse {
  std::string user;  ///< empty: all
  OptionValue value;
};

/// An option: the one row from which the command line, Python's keywords and the guide are made. It is bound to the
/// settings that it was made for, which must outlive it.
struct Option {
  std::string name;   ///< as on the command line without dashes; Python has _ in place of -
  std::string group;  ///< under which help lists it
  std::string help;
  std::vector<OptionUse> uses;  ///< one for each user; all take the same values
  std::vector<std::string> excludes{};

  /// Sets the value for every user. Throws ConfigError, which names the option as `spelled`.
  void set(const std::string& text, std::string_view spelled) const;
  const std::string& domain() const { return uses.front().value.domain; }
  /// `16`, or `16; spline: 6` where users differ.
  std::string defaults() const;
};

/// An option's name as Python has it, with _ in place of -, and as the command line has it.
std::string python_name(std::string name);
std::string option_name(std::string name);

/// The row of that name. Throws ConfigError that suggests a similar one.
const Option& find_option(const std::vector<Option>& options, std::string_view name);

// Values. Numbers that are not finite, out of range, or followed by anything else are refused.
OptionValue whole(int& value, int low, int high);
OptionValue whole(std::optional<int>& value, int low, int high);
OptionValue whole(std::uint32_t& value, std::uint32_t low, std::uint32_t high);
OptionValue whole(std::uint64_t& value, std::uint64_t low, std::uint64_t high);
/// low <= value <= high; or low < value with above().
OptionValue real(double& value, double low, double high);
OptionValue above(double low, double& value, double high);
OptionValue above(double low, std::optional<double>& value, double high);
OptionValue text(std::string& value, std::string form);
/// A file that is there.
OptionValue existing_file(std::filesystem::path& value);
/// One of some names, by its place among them.
OptionValue one_of(std::vector<std::string> names, std::function<void(std::size_t)> set,
                   std::function<std::size_t()> get);
template <class T>
OptionValue one_of(T& value, std::initializer_list<std::pair<std::string, T>> names) {
  std::vector<std::string> spelled;
  std::vector<T> values;
  for (const auto& [name, meaning] : names) spelled.push_back(name), values.push_back(meaning);
  return one_of(
      std::move(spelled), [&value, values](std::size_t k) { value = values[k]; },
      [&value, values] {
        std::size_t k = 0;
        while (k < values.size() && !(values[k] == value)) ++k;
        return k;
      });
}

/// `a, b or c`.
std::string alternatives(const std::vector<std::string>& names);

}  // namespace warpath
