#include "warp/mixture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "warp/load.h"
#include "warp/log_add.h"
#include "warp/scratch.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr std::size_t kMaxComponents = 64;

}  // namespace

Mixture::Mixture(const std::vector<Component>& components) {
  double sum = 0;
  for (const Component& component : components) sum += component.weight;
  for (const Component& component : components) {
    WARPATH_CHECK(component.proposal && component.weight > 0 && std::isfinite(component.weight));
    WARPATH_CHECK_EQ(component.proposal->dims(), components.front().proposal->dims());
    const double weight = component.weight / sum;
    if (const auto* nested = dynamic_cast<const Mixture*>(component.proposal.get())) {
      for (const Component& inner : nested->m_components)
        m_components.push_back({inner.proposal, weight * inner.weight});
    } else {
      m_components.push_back({component.proposal, weight});
    }
  }
  WARPATH_CHECK(!m_components.empty() && m_components.size() <= kMaxComponents);
  double end = 0;
  for (const Component& component : m_components) m_end.push_back(end += component.weight);
  m_end.back() = 1;  // u < 1 always finds a component
}

void Mixture::sample(Batch<const double> z, std::span<const double> u, Batch<double> y, std::span<double> log_q) const {
  const std::size_t rows = z.rows(), cols = z.cols();
  // Rows sorted by the component that draws them: order[first[k]] ... order[first[k + 1] - 1] are those of k.
  const Scratch<std::uint32_t> order(rows);
  const Scratch<std::uint8_t> chosen(rows);
  std::array<std::size_t, kMaxComponents + 1> first{}, next{};
  for (std::size_t i = 0; i < rows; ++i) {
    const auto k = static_cast<std::size_t>(std::upper_bound(m_end.begin(), m_end.end() - 1, u[i]) - m_end.begin());
    chosen[i] = static_cast<std::uint8_t>(k);
    ++first[k + 1];
  }
  for (std::size_t k = 0; k < m_components.size(); ++k) first[k + 1] += first[k];
  next = first;
  for (std::size_t i = 0; i < rows; ++i) order[next[chosen[i]]++] = static_cast<std::uint32_t>(i);

  // Each component draws its rows, packed; then each tells its density of the rows that the others drew.
  const Scratch<double> packed_z(rows * cols), packed_y(rows * cols), packed_u(rows), packed_q(rows);
  const Scratch<double> others_y(rows * cols), others_q(rows);
  for (std::size_t k = 0; k < m_components.size(); ++k) {
    const double begin = k == 0 ? 0 : m_end[k - 1], width = m_end[k] - begin;
    for (std::size_t j = first[k]; j < first[k + 1]; ++j) {
      std::copy_n(&z(order[j], 0), cols, &packed_z[j * cols]);
      packed_u[j] = std::min((u[order[j]] - begin) / width, 1 - 0x1p-53);  // uniform again
    }
    const std::size_t count = first[k + 1] - first[k];
    if (count == 0) continue;
    m_components[k].proposal->sample({&packed_z[first[k] * cols], count, cols}, {&packed_u[first[k]], count},
                                     {&packed_y[first[k] * cols], count, cols}, {&packed_q[first[k]], count});
    const double log_weight = std::log(m_components[k].weight);
    for (std::size_t j = first[k]; j < first[k + 1]; ++j) packed_q[j] += log_weight;
  }
  if (m_components.size() > 1) {
    for (std::size_t k = 0; k < m_components.size(); ++k) {
      const std::size_t count = rows - (first[k + 1] - first[k]);
      if (count == 0) continue;
      // Those before the component's own, and those behind.
      std::copy_n(packed_y.data(), first[k] * cols, others_y.data());
      std::copy_n(packed_y.data() + first[k + 1] * cols, (rows - first[k + 1]) * cols, &others_y[first[k] * cols]);
      m_components[k].proposal->log_density({others_y.data(), count, cols}, {others_q.data(), count});
      const double log_weight = std::log(m_components[k].weight);
      log_add(first[k], packed_q.data(), others_q.data(), log_weight);
      log_add(count - first[k], &packed_q[first[k + 1]], &others_q[first[k]], log_weight);
    }
  }
  for (std::size_t j = 0; j < rows; ++j) {
    std::copy_n(&packed_y[j * cols], cols, &y(order[j], 0));
    log_q[order[j]] = packed_q[j];
  }
}

void Mixture::log_density(Batch<const double> y, std::span<double> log_q) const {
  const Scratch<double> of_component(y.rows());
  std::fill_n(log_q.begin(), y.rows(), -std::numeric_limits<double>::infinity());
  for (const Component& component : m_components) {
    component.proposal->log_density(y, {of_component.data(), y.rows()});
    log_add(y.rows(), log_q.data(), of_component.data(), std::log(component.weight));
  }
}

void Mixture::save(TensorFile& file, const std::string& prefix) const {
  save_header(file, prefix, *this);
  std::vector<double> weights;
  for (std::size_t k = 0; k < m_components.size(); ++k) {
    weights.push_back(m_components[k].weight);
    m_components[k].proposal->save(file, fmt::format("{}component{}.", prefix, k));
  }
  file.put<double>(prefix + "weights", {static_cast<std::int64_t>(weights.size())}, weights);
}

std::shared_ptr<const Mixture> Mixture::load(const TensorFile& file, const std::string& prefix) {
  const int dims = load_dims(file, prefix);
  const std::vector<double> weights = file.get<double>(prefix + "weights").values;
  if (weights.empty() || weights.size() > kMaxComponents)
    fail_load(file, prefix, fmt::format("{} components, not 1 to {}", weights.size(), kMaxComponents));
  std::vector<Component> components;
  for (std::size_t k = 0; k < weights.size(); ++k) {
    if (!(weights[k] > 0) || !std::isfinite(weights[k]))
      fail_load(file, prefix, fmt::format("weight {} of component {}", weights[k], k));
    const std::string name = fmt::format("{}component{}.", prefix, k);
    // A mixture never holds mixtures, so a file in which they nest is not ours, and could nest without end.
    if (file.meta(name + "family") == "mixture") fail_load(file, name, "a mixture within a mixture");
    components.push_back({load_proposal(file, name), weights[k]});
    if (components.back().proposal->dims() != dims) fail_load(file, name, "dimensions other than the mixture's");
  }
  return std::make_shared<Mixture>(components);
}

}  // namespace warpath
