#include "core/option.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "warpath/error.h"

namespace warpath {
namespace {

/// The whole text as a number, if it is one that T holds.
template <class T>
std::optional<T> parse(const std::string& text) {
  T value{};
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || rest != end || text.empty()) return {};
  return value;
}

template <class T>
std::string told(const T& value) {
  return fmt::format("{}", value);
}
template <class T>
std::string told(const std::optional<T>& value) {
  return value ? fmt::format("{}", *value) : std::string();
}

/// A number T that goes to `value`, if it is `allowed`; `kind` says what it is in a message.
template <class T, class Value, class Allowed>
OptionValue number(Value& value, std::string domain, std::string_view kind, Allowed allowed) {
  return {domain,
          [&value, domain, kind, allowed](const std::string& text) {
            const auto parsed = parse<T>(text);
            if (!parsed || !allowed(*parsed))
              throw ConfigError(fmt::format("\"{}\" is not {}, {}", text, kind, domain));
            value = *parsed;
          },
          [&value] { return told(value); }};
}

template <class T, class Value>
OptionValue whole_number(Value& value, T low, T high) {
  const bool open = high == std::numeric_limits<T>::max();
  return number<T>(value, open ? fmt::format("{} or more", low) : fmt::format("{} to {}", low, high), "a whole number",
                   [low, high](T x) { return x >= low && x <= high; });
}

template <class Value>
OptionValue number_above(double low, Value& value, double high) {
  return number<double>(value, fmt::format("above {} to {:g}", low, high), "a number",
                        [low, high](double x) { return x > low && x <= high; });
}

}  // namespace

void Option::set(const std::string& text, std::string_view spelled) const {
  for (const OptionUse& use : uses) try {
      use.value.set(text);
    } catch (const ConfigError& error) {
      throw ConfigError(fmt::format("{}: {}", spelled, error.what()));
    }
}

std::string Option::defaults() const {
  const std::string first = uses.front().value.get();
  std::string all = first;
  for (const OptionUse& use : uses)
    if (const std::string other = use.value.get(); other != first) all += fmt::format("; {}: {}", use.user, other);
  return all;
}

std::string python_name(std::string name) {
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

std::string option_name(std::string name) {
  std::replace(name.begin(), name.end(), '_', '-');
  return name;
}

const Option& find_option(const std::vector<Option>& options, std::string_view name) {
  std::vector<std::string_view> known;
  for (const Option& option : options) {
    if (option.name == name) return option;
    known.push_back(option.name);
  }
  throw ConfigError(fmt::format("unknown option \"{}\";{}", name, suggestion(name, known)));
}

OptionValue whole(int& value, int low, int high) { return whole_number(value, low, high); }
OptionValue whole(std::optional<int>& value, int low, int high) { return whole_number(value, low, high); }
OptionValue whole(std::uint32_t& value, std::uint32_t low, std::uint32_t high) {
  return whole_number(value, low, high);
}
OptionValue whole(std::uint64_t& value, std::uint64_t low, std::uint64_t high) {
  return whole_number(value, low, high);
}

OptionValue real(double& value, double low, double high) {
  return number<double>(value, fmt::format("{:g} to {:g}", low, high), "a number",
                        [low, high](double x) { return x >= low && x <= high; });
}

OptionValue above(double low, double& value, double high) { return number_above(low, value, high); }
OptionValue above(double low, std::optional<double>& value, double high) { return number_above(low, value, high); }

OptionValue text(std::string& value, std::string form) {
  return {std::move(form), [&value](const std::string& given) { value = given; }, [&value] { return value; }};
}

OptionValue existing_file(std::filesystem::path& value) {
  return {"a file",
          [&value](const std::string& given) {
            if (!std::filesystem::exists(given)) throw ConfigError(fmt::format("\"{}\" does not exist", given));
            if (std::filesystem::is_directory(given)) throw ConfigError(fmt::format("\"{}\" is a folder", given));
            value = given;
          },
          [&value] { return value.string(); }};
}

OptionValue one_of(std::vector<std::string> names, std::function<void(std::size_t)> set,
                   std::function<std::size_t()> get) {
  return {alternatives(names),
          [names, set](const std::string& given) {
            const auto found = std::find(names.begin(), names.end(), given);
            if (found == names.end()) {
              const std::vector<std::string_view> known(names.begin(), names.end());
              throw ConfigError(fmt::format("unknown value \"{}\";{}", given, suggestion(given, known)));
            }
            set(static_cast<std::size_t>(found - names.begin()));
          },
          [names, get] {
            const std::size_t k = get();
            return k < names.size() ? names[k] : std::string();
          }};
}

std::string alternatives(const std::vector<std::string>& names) {
  if (names.size() < 2) return names.empty() ? "" : names.front();
  return fmt::format("{} or {}", fmt::join(names.begin(), names.end() - 1, ", "), names.back());
}

}  // namespace warpath
