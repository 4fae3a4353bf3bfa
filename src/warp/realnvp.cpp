#include "warp/realnvp.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "core/tensor_file.h"
#include "warp/load.h"
#include "warp/scratch.h"
#include "warpath/error.h"

namespace warpath {
namespace {

using nn::kBlock;

struct alignas(nn::kAlignment) Line {
  float values[16];
};

/// Runs `step` (Flow::forward or Flow::inverse) over all rows, a block at a time; the last one is filled up.
template <class Step>
void for_blocks(const realnvp::Flow& flow, Batch<const double> from, Batch<double> to, std::span<double> log_det,
                Step step) {
  WARPATH_CHECK_EQ(from.cols(), static_cast<std::size_t>(flow.dims()));
  WARPATH_CHECK_EQ(to.cols(), from.cols());
  WARPATH_CHECK_EQ(to.rows(), from.rows());
  WARPATH_CHECK_EQ(log_det.size(), from.rows());
  const std::size_t dims = from.cols();
  const Scratch<Line> scratch(((dims + 1) * 2 * kBlock + flow.scratch_count()) / 16);
  double* const block = reinterpret_cast<double*>(scratch.data());
  double* const sums = block + dims * kBlock;
  float* const rest = reinterpret_cast<float*>(sums + kBlock);
  for (std::size_t first = 0; first < from.rows(); first += kBlock) {
    const std::size_t rows = std::min<std::size_t>(kBlock, from.rows() - first);
    for (std::size_t i = 0; i < dims; ++i) {
      for (std::size_t r = 0; r < rows; ++r) block[i * kBlock + r] = from(first + r, i);
      std::fill(block + i * kBlock + rows, block + (i + 1) * kBlock, 0.5);
    }
    step(block, sums, rest);
    for (std::size_t i = 0; i < dims; ++i)
      for (std::size_t r = 0; r < rows; ++r) to(first + r, i) = block[i * kBlock + r];
    std::copy_n(sums, rows, log_det.data() + first);
  }
}

constexpr std::array<std::string_view, 2> kMasks{"alternating", "binary"};
constexpr std::array<std::string_view, 3> kNorms{"none", "actnorm", "batch"};

int load_int(const TensorFile& file, const std::string& prefix, const char* key, int most) {
  const std::string& text = file.meta(prefix + key);
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < 0 || value > most)
    fail_load(file, prefix, fmt::format("{} \"{}\", not 0 to {}", key, text, most));
  return value;
}

template <class Enum, std::size_t N>
Enum load_enum(const TensorFile& file, const std::string& prefix, const char* key,
               const std::array<std::string_view, N>& names) {
  const std::string& text = file.meta(prefix + key);
  const auto found = std::find(names.begin(), names.end(), text);
  if (found == names.end()) fail_load(file, prefix, fmt::format("unknown {} \"{}\"", key, text));
  return static_cast<Enum>(found - names.begin());
}

std::vector<std::int64_t> shape_of(const realnvp::ParameterView& view) {
  const std::int64_t rows = static_cast<std::int64_t>(view.rows), cols = static_cast<std::int64_t>(view.cols);
  return view.name.ends_with(".weight") ? std::vector{rows, cols} : std::vector{rows};
}

}  // namespace

RealNvp::RealNvp(realnvp::Flow flow, nn::AlignedVector<float> parameters)
    : m_flow(std::move(flow)), m_parameters(std::move(parameters)) {
  WARPATH_CHECK_EQ(m_parameters.size(), m_flow.parameter_count());
  m_flow.pack(m_parameters.data(), m_packed, false);
}

std::shared_ptr<const RealNvp> RealNvp::untrained(int dims, const RealNvpSettings& settings, std::uint64_t seed) {
  realnvp::Flow flow(dims, settings);
  auto parameters = flow.initial(seed);
  return std::make_shared<RealNvp>(std::move(flow), std::move(parameters));
}

void RealNvp::forward(Batch<const double> z, Batch<double> y, std::span<double> log_det) const {
  for_blocks(m_flow, z, y, log_det, [&](double* block, double* sums, float* scratch) {
    m_flow.forward(m_packed, block, block, sums, scratch);
  });
}

void RealNvp::inverse(Batch<const double> y, Batch<double> z, std::span<double> log_det) const {
  for_blocks(m_flow, y, z, log_det, [&](double* block, double* sums, float* scratch) {
    m_flow.inverse(m_packed, block, block, sums, scratch);
  });
}

void RealNvp::save(TensorFile& file, const std::string& prefix) const {
  save_header(file, prefix, *this);
  auto& meta = file.metadata();
  const RealNvpSettings& s = settings();
  meta[prefix + "couplings"] = std::to_string(s.couplings);
  meta[prefix + "width"] = std::to_string(s.width);
  meta[prefix + "blocks"] = std::to_string(s.blocks);
  meta[prefix + "shared"] = std::to_string(s.shared ? 1 : 0);
  meta[prefix + "bins"] = std::to_string(s.bins);
  meta[prefix + "masks"] = kMasks[static_cast<std::size_t>(s.masks)];
  meta[prefix + "norm"] = kNorms[static_cast<std::size_t>(s.norm)];
  std::vector<float> values;
  for (const realnvp::ParameterView& view : m_flow.views()) {
    values.clear();
    for (std::size_t r = 0; r < view.rows; ++r)
      for (std::size_t c = 0; c < view.cols; ++c) values.push_back(m_parameters[view.offset + r * view.stride + c]);
    file.put<float>(prefix + view.name, shape_of(view), values);
  }
}

std::shared_ptr<const RealNvp> RealNvp::load(const TensorFile& file, const std::string& prefix) {
  const int dims = load_dims(file, prefix);
  RealNvpSettings s;
  s.couplings = load_int(file, prefix, "couplings", 1000);
  s.width = load_int(file, prefix, "width", 8192);
  s.blocks = load_int(file, prefix, "blocks", 100);
  s.shared = load_int(file, prefix, "shared", 1) == 1;
  s.bins = load_int(file, prefix, "bins", 256);
  s.masks = load_enum<RealNvpSettings::Masks>(file, prefix, "masks", kMasks);
  s.norm = load_enum<RealNvpSettings::Norm>(file, prefix, "norm", kNorms);
  if (s.couplings < 1 || s.width < 16 || s.width % 16 != 0)
    fail_load(file, prefix, fmt::format("{} couplings of width {} make no Real NVP", s.couplings, s.width));

  realnvp::Flow flow(dims, s);
  const auto views = flow.views();
  for (const realnvp::ParameterView& view : views) {  // before anything is allocated
    const auto entry = file.entries().find(prefix + view.name);
    if (entry == file.entries().end()) fail_load(file, prefix, fmt::format("no tensor \"{}\"", view.name));
    if (entry->second.shape != shape_of(view))
      fail_load(file, prefix,
                fmt::format("{} is {}, not {}", view.name, fmt::join(entry->second.shape, " x "),
                            fmt::join(shape_of(view), " x ")));
  }
  nn::AlignedVector<float> parameters(flow.parameter_count(), 0.0f);
  for (const realnvp::ParameterView& view : views) {
    const auto stored = file.get<float>(prefix + view.name);
    for (std::size_t r = 0; r < view.rows; ++r)
      std::copy_n(stored.values.data() + r * view.cols, view.cols, parameters.data() + view.offset + r * view.stride);
  }
  if (!std::all_of(parameters.begin(), parameters.end(), [](float p) { return std::isfinite(p); }))
    fail_load(file, prefix, "its weights are not all finite");
  for (const realnvp::ParameterView& view : views)
    if (view.name.ends_with("variance") &&
        std::any_of(&parameters[view.offset], &parameters[view.offset] + view.rows, [](float v) { return v < 0; }))
      fail_load(file, prefix, fmt::format("{} holds a negative variance", view.name));
  return std::make_shared<RealNvp>(std::move(flow), std::move(parameters));
}

}  // namespace warpath
