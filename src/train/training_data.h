#pragma once
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "path/integrand.h"
#include "path/layout.h"
#include "warpath/batch.h"

namespace warpath {

/// Candidates are evaluated as samples kFirstCandidate, kFirstCandidate + 1, ...; rendering counts from 0. So one seed
/// serves both, and no number of a candidate's path is used again by a sample.
inline constexpr std::uint64_t kFirstCandidate = std::uint64_t{1} << 63;

/// Uniform primary samples with their target values (the candidate set T of [ZZ19]). Only the target of each is kept:
/// its y is a function of (seed, id) and is made again when it is needed, so a candidate costs 4 bytes.
struct Candidates {
  Layout layout;
  std::uint64_t seed = 0;
  std::uint64_t first = 0;          ///< id of the first one here, where they come in chunks
  std::vector<float> target;        ///< g >= 0 of candidate first + i; non-finite ones are stored as 0
  std::vector<float> contribution;  ///< f, count x channels, as it came; only where it was asked for
  std::uint64_t non_finite = 0;     ///< how many were not finite
  double seconds = 0;               ///< wall time that it took
  double cpu_seconds = 0;           ///< of all threads
  std::size_t size() const { return target.size(); }
  /// y of candidate first + i: layout.dims() numbers, the ones that a UniformSource of this seed gives to the sample
  /// kFirstCandidate + first + i.
  void primary_sample(std::uint64_t i, float* y) const;
};

/// What a flow is trained on, an example at a time.
class TrainingSet {
 public:
  virtual ~TrainingSet() = default;
  virtual std::size_t size() const = 0;
  virtual std::size_t dims() const = 0;
  virtual void primary_sample(std::size_t i, float* y) const = 0;  ///< dims() numbers
  virtual float weight(std::size_t i) const = 0;                   ///< g / q, up to a factor that all share
  virtual float target(std::size_t i) const = 0;                   ///< g, up to a factor that all share
};

/// Examples that a density is fitted to: y with a weight each.
struct Examples {
  Matrix<float> y;            ///< N x D
  std::vector<float> weight;  ///< N; g / q, up to a factor that all share: the target
  std::vector<float> inv_q;   ///< N; 1 / q, of the density that y was drawn from; empty if that was 1
  std::size_t size() const { return y.rows(); }
};

/// The same as a TrainingSet; `examples` must outlive it.
class ExampleSet final : public TrainingSet {
 public:
  explicit ExampleSet(const Examples& examples) : m_examples(examples) {}
  std::size_t size() const override { return m_examples.size(); }
  std::size_t dims() const override { return m_examples.y.cols(); }
  void primary_sample(std::size_t i, float* y) const override { std::copy_n(&m_examples.y(i, 0), dims(), y); }
  float weight(std::size_t i) const override { return m_examples.weight.empty() ? 1.0f : m_examples.weight[i]; }
  float target(std::size_t i) const override {
    return m_examples.inv_q.empty() ? weight(i) : weight(i) / m_examples.inv_q[i];
  }

 private:
  const Examples& m_examples;
};

}  // namespace warpath
