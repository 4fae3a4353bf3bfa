#include "report/results.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <type_traits>

#include "core/file.h"
#include "warpath/error.h"

namespace warpath {
namespace {

using Json = nlohmann::ordered_json;
constexpr int kFormat = 1;

// Each struct's fields are listed once, for writing and for reading alike.

template <class Point, class F>
requires std::is_same_v<std::remove_const_t<Point>, ErrorPoint>
void for_each_field(Point& point, F&& f) {
  f("spp", point.spp);
  f("seconds", point.seconds);
  f("mse", point.mse);
  f("relmse", point.relmse);
  f("cpu_seconds", point.cpu_seconds);
}

template <class Point, class F>
requires std::is_same_v<std::remove_const_t<Point>, TrainingPoint>
void for_each_field(Point& point, F&& f) {
  f("seconds", point.seconds);
  f("samples", point.samples);
  f("loss", point.loss);
  f("held_out", point.held_out);
  f("cpu_seconds", point.cpu_seconds);
}

template <class Record, class F>
requires std::is_same_v<std::remove_const_t<Record>, PassRecord>
void for_each_field(Record& pass, F&& f) {
  f("spp", pass.spp);
  f("batches", pass.batches);
  f("teaches", pass.teaches);
  f("drawn_by", pass.drawn_by);
  f("chosen", pass.chosen);
}

template <class Run, class F>
requires std::is_same_v<std::remove_const_t<Run>, MethodRun>
void for_each_field(Run& run, F&& f) {
  f("method", run.method);
  f("family", run.family);
  f("dims", run.dims);
  f("size", run.size);
  f("seed", run.seed);
  f("spp", run.spp);
  f("samples", run.samples);
  f("train_samples", run.train_samples);
  f("candidate_seconds", run.candidate_seconds);
  f("train_seconds", run.train_seconds);
  f("warp_seconds", run.warp_seconds);
  f("trace_seconds", run.trace_seconds);
  f("total_seconds", run.total_seconds);
  f("candidate_cpu_seconds", run.candidate_cpu_seconds);
  f("train_cpu_seconds", run.train_cpu_seconds);
  f("warp_cpu_seconds", run.warp_cpu_seconds);
  f("trace_cpu_seconds", run.trace_cpu_seconds);
  f("total_cpu_seconds", run.total_cpu_seconds);
  f("mse", run.mse);
  f("relmse", run.relmse);
  f("relmse_trimmed", run.relmse_trimmed);
  f("mape", run.mape);
  f("mse_raw", run.mse_raw);
  f("relmse_raw", run.relmse_raw);
  f("mse_predicted", run.mse_predicted);
  f("relmse_predicted", run.relmse_predicted);
  f("mse_rest", run.mse_rest);
  f("relmse_rest", run.relmse_rest);
  f("mean", run.mean);
  f("mean_rest", run.mean_rest);
  f("non_finite", run.non_finite);
  f("candidates", run.candidates);
  f("candidates_nonzero", run.candidates_nonzero);
  f("training_stopped", run.training_stopped);
  f("error_curve", run.error_curve);
  f("training_curve", run.training_curve);
  f("passes", run.passes);
}

template <class C, class F>
requires std::is_same_v<std::remove_const_t<C>, Comparison>
void for_each_field(C& comparison, F&& f) {
  f("scene", comparison.scene);
  f("reference", comparison.reference);
  f("reference_has_variance", comparison.reference_has_variance);
  f("version", comparison.version);
  f("commit", comparison.commit);
  f("cpu", comparison.cpu);
  f("date", comparison.date);
  f("command", comparison.command);
  f("width", comparison.width);
  f("height", comparison.height);
  f("threads", comparison.threads);
  f("seed", comparison.seed);
  f("settings", comparison.settings);
  f("warnings", comparison.warnings);
  f("results", comparison.results);
}

template <class T>
concept HasFields = requires(T& value) {
  for_each_field(value, [](const char*, auto&) {});
};

template <class T>
Json to_value(const T& value) {
  if constexpr (HasFields<const T>) {
    Json object = Json::object();
    for_each_field(value, [&](const char* name, const auto& field) { object[name] = to_value(field); });
    return object;
  } else if constexpr (requires { requires HasFields<const typename T::value_type>; }) {
    Json array = Json::array();
    for (const auto& element : value) array.push_back(to_value(element));
    return array;
  } else {
    return value;
  }
}

template <class T>
void from_value(const Json& json, T& value) {
  if constexpr (HasFields<T>) {
    for_each_field(value, [&](const char* name, auto& field) {
      if (const auto found = json.find(name); found != json.end()) from_value(*found, field);
    });
  } else if constexpr (requires { requires HasFields<typename T::value_type>; }) {
    for (const Json& element : json) from_value(element, value.emplace_back());
  } else if constexpr (std::is_same_v<T, double>) {
    value = json.is_null() ? kUnknown : json.get<double>();
  } else if constexpr (std::is_same_v<T, std::array<double, 3>>) {
    for (std::size_t i = 0; i < value.size(); ++i) from_value(json.at(i), value[i]);
  } else {
    value = json.get<T>();
  }
}

}  // namespace

void MethodRun::set_errors(const ImageErrors& errors) {
  mse = errors.mse;
  relmse = errors.relmse;
  relmse_trimmed = errors.relmse_trimmed;
  mape = errors.mape;
  mse_raw = errors.mse_raw;
  relmse_raw = errors.relmse_raw;
}

std::string results_json(const Comparison& comparison) {
  Json json{{"format", kFormat}};
  json.update(to_value(comparison));
  // The library writes NaN and infinity as null.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

void write_results(const std::filesystem::path& path, const Comparison& comparison) {
  write_atomically(path, results_json(comparison));
}

Comparison read_results(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw FileError(fmt::format("{}: cannot be opened", path.string()));
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  try {
    const Json json = Json::parse(text);
    if (!json.is_object() || !json.contains("results"))
      throw FileError(fmt::format("{}:1:1: not a results file of warpath: it has no \"results\"", path.string()));
    if (const int format = json.value("format", kFormat); format != kFormat)
      throw FileError(fmt::format("{}: is of format {}, but this warpath reads {}", path.string(), format, kFormat));
    Comparison comparison;
    from_value(json, comparison);
    return comparison;
  } catch (const Json::parse_error& error) {
    const std::string_view before = std::string_view(text).substr(0, error.byte > 0 ? error.byte - 1 : 0);
    const auto line = 1 + std::count(before.begin(), before.end(), '\n');
    const auto column = before.size() - (before.rfind('\n') + 1) + 1;  // npos + 1 is 0
    throw FileError(fmt::format("{}:{}:{}: not JSON: {}", path.string(), line, column, error.what()));
  } catch (const Json::exception& error) {
    throw FileError(fmt::format("{}: not a results file of warpath: {}", path.string(), error.what()));
  }
}

}  // namespace warpath
