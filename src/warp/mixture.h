#pragma once
#include <array>
#include <vector>

#include "warp/load.h"
#include "warp/proposal.h"

namespace warpath {

/// q = sum of w_k q_k. With the uniform proposal among its components no region starves and no weight is above
/// 1 / (its share). Each sample is divided by the density of the whole mixture, whichever component drew it (the
/// balance heuristic of Veach and Guibas 1995); the caller may stratify u.
class Mixture : public Proposal {
 public:
  struct Component {
    std::shared_ptr<const Proposal> proposal;
    double weight;  ///< > 0; all of them are scaled to sum to 1
  };
  /// Mixtures among the components are taken apart.
  explicit Mixture(const std::vector<Component>& components);

  std::span<const Component> components() const { return m_components; }
  int dims() const override { return m_components.front().proposal->dims(); }
  std::string family() const override { return "mixture"; }
  void sample(Batch<const double> z, std::span<const double> u, Batch<double> y,
              std::span<double> log_q) const override;
  void log_density(Batch<const double> y, std::span<double> log_q) const override;
  void save(TensorFile& file, const std::string& prefix) const override;
  static std::shared_ptr<const Mixture> load(const TensorFile& file, const std::string& prefix,
                                             const ProposalLoader& load_component);

 private:
  static constexpr std::size_t kMaxComponents = 64;
  using Starts = std::array<std::size_t, kMaxComponents + 1>;
  /// Rows [first[k], first[k + 1]) are drawn by component k; then each tells its density of those that others drew.
  void sample_runs(const Starts& first, Batch<const double> z, std::span<const double> u, Batch<double> y,
                   std::span<double> log_q) const;

  std::vector<Component> m_components;
  std::vector<double> m_end;  ///< component k is chosen by u in [m_end[k-1], m_end[k])
};

}  // namespace warpath
