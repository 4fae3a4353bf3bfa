#include "integrate/learner.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/rng.h"
#include "family/family.h"
#include "train/fit_grid.h"
#include "train/tempering.h"
#include "warp/chain.h"
#include "warp/mixture.h"
#include "warp/uniform.h"
#include "warpath/error.h"

namespace warpath {
namespace {

// Names beside those of the families: a grid, and a spline flow in front of it where that pays, or in any case.
constexpr char kAuto[] = "auto", kGridSpline[] = "grid+spline";
constexpr char kGrid[] = "grid", kFront[] = "spline";

constexpr double kEnough = 2000;      // effective samples that a warp can learn from without annealing
constexpr double kEnoughShare = 0.2;  // or that share of all
constexpr double kWorse = 4;          // iterations with so much larger a variance than the best are not learned from
// A grid that leaves this share of effective samples is good enough: scrambled points do the rest.
constexpr double kGoodGrid = 0.75;
// Intervals are halved where an average one has so many effective samples, as far as they go; more where there are more
// dimensions, as the noise of all of them adds up.
constexpr double kEnoughOfBin = 200;
constexpr double kDimsOfEnough = 16;
constexpr int kMostGridBins = 512;
constexpr std::size_t kMostGridNumbers = std::size_t{1} << 24;  // coordinates that a grid learns from
constexpr double kAnnealingGain = 2;  // in tempered effective samples, for a grid to go on annealing by itself
constexpr double kFlowGain = 1.01;    // in effective samples from one iteration to the next, to train a flow on
constexpr int kFlowTries = 3;         // times that a flow may be trained without beating the grid

double enough_of(double examples) { return std::min(kEnough, kEnoughShare * examples); }

/// Whether a family can be fitted to the points of iterations.
bool can_adapt(const Family& family) {
  return family.joint() && (family.joint()->adapt || !family.learns() || family.name == kGrid);
}

/// Throws ConfigError for a name that is unknown.
const JointFamily& family_of_name(const std::string& name) {
  const Family* family = find_family(name == kAuto ? kGrid : name == kGridSpline ? kFront : name);
  if (family && can_adapt(*family)) return *family->joint();
  std::vector<std::string> names = family_names(can_adapt);
  names.insert(names.begin(), kAuto);
  names.emplace_back(kGridSpline);
  const std::vector<std::string_view> known(names.begin(), names.end());
  throw ConfigError(fmt::format("unknown warp \"{}\";{}", name, suggestion(name, known)));
}

}  // namespace

Learner::Learner(int dims, const std::string& family, std::uint64_t seed, std::size_t memory)
    : m_dims(dims), m_family(family), m_seed(seed), m_memory(memory) {
  const JointFamily& joint = family_of_name(family);
  if (dims < 1 || dims > joint.most_dims)
    throw ConfigError(fmt::format("{} dimensions; the warp \"{}\" has 1 to {}", dims, family, joint.most_dims));
  if (has_front() || family == kGrid) m_grid = std::make_shared<const Grid>(dims, GridSettings().intervals);
  m_adapts = has_front() ? find_family(kFront)->joint() : &joint;
}

bool Learner::has_front() const { return m_family == kAuto || m_family == kGridSpline; }

void Learner::start_from(std::shared_ptr<const Proposal> proposal) {
  const auto refuse = [&] {
    throw ConfigError(fmt::format("a saved {} cannot be gone on with as \"{}\"", proposal->family(), m_family));
  };
  if (proposal->dims() != m_dims) refuse();
  if (const auto* mixture = dynamic_cast<const Mixture*>(proposal.get()))
    proposal = mixture->components().front().proposal;
  if (proposal->family() == "uniform") return;
  m_learned = 1;
  auto warp = std::dynamic_pointer_cast<const Warp>(proposal);
  if (const auto* chain = dynamic_cast<const Chain*>(warp.get())) {
    m_grid = std::dynamic_pointer_cast<const Grid>(chain->outer());
    m_warp = chain->inner();
    m_grid_done = true;
    if (!m_grid || !has_front()) refuse();
  } else if (auto grid = std::dynamic_pointer_cast<const Grid>(warp)) {
    if (!m_grid) refuse();
    m_grid = std::move(grid);
  } else if (warp && warp->family() == m_family) {
    m_warp = std::move(warp);
  } else {
    refuse();
  }
}

bool Learner::defended() const {
  if (!m_warp) return false;
  if (m_family == kGridSpline) return true;
  return !m_grid || m_warp_variance == 0 || m_warp_variance <= m_grid_variance || m_grid_variance == 0;
}

std::shared_ptr<const Proposal> Learner::proposal(double share) const {
  if (!defended()) {
    if (m_grid) return m_grid;
    return std::make_shared<Uniform>(m_dims);
  }
  std::shared_ptr<const Proposal> main = m_warp, second = m_grid;
  if (m_grid) {
    main = std::make_shared<Chain>(m_warp, m_grid);
  } else {
    second = std::make_shared<Uniform>(m_dims);
  }
  return std::make_shared<Mixture>(std::vector<Mixture::Component>{{main, 1 - share}, {second, share}});
}

std::string Learner::description() const {
  if (!m_grid) return m_warp ? m_warp->family() : "uniform";
  return defended() ? "grid+" + m_warp->family() : m_learned == 0 ? "uniform" : "grid";
}

void Learner::learn(Examples examples, double variance) {
  if (!m_grid && !m_adapts->adapt) return;
  (defended() ? m_warp_variance : m_grid_variance) = variance;
  const double effective = effective_samples(examples.weight);
  if (effective == 0) return;  // nothing was seen; what there is draws again
  ++m_learned;
  const double count = static_cast<double>(examples.size()), share = effective / count;
  if (has_front()) m_grid_done = grid_is_done(examples, share);
  const bool trained = m_flows > 0 && defended() && share < kFlowGain * m_passes.back().effective_share;
  remember(std::move(examples), share);

  const double enough = enough_of(count);
  const bool annealing = effective < enough;
  if (trained && !annealing) return;
  const bool of_grid = m_grid && !m_grid_done;
  const std::size_t most = of_grid ? kMostGridNumbers / static_cast<std::size_t>(m_dims) : m_memory;
  Examples chosen = annealing ? tempered(m_passes.back().examples, enough) : pooled(most);
  if (of_grid) {
    learn_grid(chosen, annealing);
  } else if (!m_grid || defended() || m_flows < kFlowTries) {
    learn_warp(std::move(chosen), annealing);
  }
}

void Learner::remember(Examples examples, double effective_share) {
  m_passes.push_back({std::move(examples), effective_share});
  std::size_t rows = 0, kept = 0;
  while (kept < m_passes.size() && rows < m_memory) rows += m_passes[m_passes.size() - ++kept].examples.size();
  m_passes.erase(m_passes.begin(), m_passes.end() - static_cast<std::ptrdiff_t>(kept));
}

// A grid has done what it can when an iteration that it drew is hardly better than the one before.
bool Learner::grid_is_done(const Examples& examples, double effective_share) const {
  if (m_dims > m_adapts->most_dims) return false;
  if (m_grid_done || m_passes.empty()) return m_grid_done;
  if (effective_share > kGoodGrid) return m_family == kGridSpline;
  const Pass& last = m_passes.back();
  const double count = static_cast<double>(last.examples.size()), enough = enough_of(count);
  if (last.effective_share * count >= enough)
    return effective_share / last.effective_share < (effective_share < 0.1 ? 4.0 : 1.3);
  // How many of a handful of samples are effective is chance; of weights tempered as the grid was taught it is not.
  const double b = tempering(last.examples.weight, enough);
  const double now = effective_samples(examples.weight, b) / static_cast<double>(examples.size());
  return now < kAnnealingGain * enough / count;
}

Examples Learner::pooled(std::size_t most) const {
  double best = 0;
  for (const Pass& pass : m_passes) best = std::max(best, pass.effective_share);
  std::vector<const Examples*> used;
  std::size_t rows = 0, longest = 0;
  for (const Pass& pass : m_passes) {
    // 1 / share - 1 is the variance of a point's weight, relative to its mean squared.
    if (1 / pass.effective_share - 1 > kWorse * (1 / best - 1) && pass.effective_share < best) continue;
    used.push_back(&pass.examples);
    rows += pass.examples.size();
    longest = std::max(longest, pass.examples.size());
  }
  rows = std::min(rows, most);
  const auto dims = static_cast<std::size_t>(m_dims);
  Examples all{Matrix<float>(rows, dims), std::vector<float>(rows), std::vector<float>(rows)};
  std::size_t row = 0;
  for (std::size_t i = 0; i < longest; ++i)
    for (const Examples* part : used) {
      if (i >= part->size() || row == rows) continue;
      std::copy_n(&part->y(i, 0), dims, &all.y(row, 0));
      all.weight[row] = part->weight[i];
      all.inv_q[row++] = part->inv_q[i];
    }
  return all;
}

void Learner::learn_grid(const Examples& examples, bool tempered) {
  GridSettings settings;
  settings.iterations = tempered ? 3 : 5;
  if (tempered) settings.target = GridSettings::Target::mean;
  const double most = effective_samples(examples.weight) / (kEnoughOfBin * std::max(1.0, m_dims / kDimsOfEnough));
  while (2 * m_grid->bins() <= std::min<double>(kMostGridBins, most))
    m_grid = std::make_shared<const Grid>(halved(*m_grid));
  m_grid = fit_grid(examples, settings, m_grid.get());
}

void Learner::learn_warp(Examples examples, bool tempered) {
  if (m_grid) examples = behind_grid(std::move(examples));
  if (m_adapts->is_flow) ++m_flows;
  const std::uint64_t seed = sample_key(m_seed, static_cast<std::uint64_t>(m_flows));
  auto adapted = m_adapts->adapt(std::move(examples), tempered, seed, m_warp.get());
  m_warp = std::move(adapted.warp);
  m_trained += adapted.trained;
}

Examples Learner::behind_grid(Examples examples) const {
  constexpr std::size_t kRows = 1024;
  const std::size_t dims = examples.y.cols();
  parallel((examples.size() + kRows - 1) / kRows, [&](std::size_t batch) {
    const std::size_t first = batch * kRows, rows = std::min(kRows, examples.size() - first);
    Matrix<double> y(rows, dims);
    std::vector<double> log_q(rows);
    for (std::size_t i = 0; i < rows; ++i) std::copy_n(&examples.y(first + i, 0), dims, &y(i, 0));
    m_grid->inverse(y.batch(), y.batch(), log_q);
    for (std::size_t i = 0; i < rows; ++i) {
      for (std::size_t d = 0; d < dims; ++d) examples.y(first + i, d) = to_primary(y(i, d));
      examples.inv_q[first + i] *= static_cast<float>(std::exp(log_q[i]));
    }
  });
  return examples;
}

}  // namespace warpath
