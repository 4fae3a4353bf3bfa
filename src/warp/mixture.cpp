#include "warp/mixture.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "warp/load.h"
#include "warp/log_add.h"
#include "warp/scratch.h"
#include "warpath/error.h"

namespace warpath {

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
  const Scratch<std::uint8_t> chosen(rows);
  Starts first{};
  for (std::size_t i = 0; i < rows; ++i) {
    const auto k = static_cast<std::size_t>(std::upper_bound(m_end.begin(), m_end.end() - 1, u[i]) - m_end.begin());
    chosen[i] = static_cast<std::uint8_t>(k);
    ++first[k + 1];
  }
  for (std::size_t k = 0; k < m_components.size(); ++k) first[k + 1] += first[k];

  // Rows sorted by the component that draws them: order[first[k]] ... order[first[k + 1] - 1] are those of k.
  const Scratch<std::uint32_t> order(rows);
  const Scratch<double> u_of_component(rows);
  Starts next = first;
  for (std::size_t i = 0; i < rows; ++i) {
    const std::size_t k = chosen[i], j = next[k]++;
    const double begin = k == 0 ? 0 : m_end[k - 1];
    order[j] = static_cast<std::uint32_t>(i);
    u_of_component[j] = std::min((u[i] - begin) / (m_end[k] - begin), 1 - 0x1p-53);  // uniform again
  }
  const std::span<const double> inner_u{u_of_component.data(), rows};
  // As they come if u is stratified over the batch.
  if (std::is_sorted(chosen.data(), chosen.data() + rows)) return sample_runs(first, z, inner_u, y, log_q);

  const Scratch<double> packed_y(rows * cols), packed_q(rows);
  const Batch<double> packed(packed_y.data(), rows, cols);
  for (std::size_t j = 0; j < rows; ++j) std::copy_n(&z(order[j], 0), cols, &packed(j, 0));
  sample_runs(first, packed, inner_u, packed, {packed_q.data(), rows});
  for (std::size_t j = 0; j < rows; ++j) {
    std::copy_n(&packed(j, 0), cols, &y(order[j], 0));
    log_q[order[j]] = packed_q[j];
  }
}

void Mixture::sample_runs(const Starts& first, Batch<const double> z, std::span<const double> u, Batch<double> y,
                          std::span<double> log_q) const {
  for (std::size_t k = 0; k < m_components.size(); ++k) {
    const std::size_t begin = first[k], count = first[k + 1] - begin;
    if (count == 0) continue;
    const std::span<double> own_q = log_q.subspan(begin, count);
    m_components[k].proposal->sample(z.rows_from(begin, count), u.subspan(begin, count), y.rows_from(begin, count),
                                     own_q);
    const double log_weight = std::log(m_components[k].weight);
    for (double& value : own_q) value += log_weight;
  }
  const Scratch<double> other_q(z.rows());
  for (std::size_t k = 0; k < m_components.size(); ++k) {
    const auto add_density = [&](std::size_t begin, std::size_t end) {
      if (begin == end) return;
      m_components[k].proposal->log_density(y.rows_from(begin, end - begin), {other_q.data(), end - begin});
      log_add(end - begin, &log_q[begin], other_q.data(), std::log(m_components[k].weight));
    };
    add_density(0, first[k]);
    add_density(first[k + 1], z.rows());
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

std::shared_ptr<const Mixture> Mixture::load(const TensorFile& file, const std::string& prefix,
                                             const ProposalLoader& load_component) {
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
    components.push_back({load_component(file, name), weights[k]});
    if (components.back().proposal->dims() != dims) fail_load(file, name, "dimensions other than the mixture's");
  }
  return std::make_shared<Mixture>(components);
}

}  // namespace warpath
