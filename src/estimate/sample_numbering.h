#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "path/latents.h"

namespace warpath {

/// The samples of a batch by their numbers, an entry for each lane.
struct NumberedSamples {
  std::vector<std::uint64_t> ids;         ///< streams of random numbers
  std::vector<std::uint32_t> indices;     ///< points of the sequences of these streams; empty: independent samples
  std::vector<std::uint32_t> pixels;      ///< empty: each sample is one of the whole film
  std::vector<std::uint32_t> replicates;  ///< groups, see Film::add; empty: all are of the first
  std::vector<float> weights;             ///< on the film; empty: all are 1
  std::size_t size() const { return ids.size(); }
  bool have_pixels() const { return !pixels.empty(); }
  void clear();
};

/// How many samples earlier passes have begun: those to come are numbered from there.
struct BegunSamples {
  std::vector<std::uint32_t> in_pixel;  ///< of a stratified film, row-major; else empty
  std::uint64_t spp = 0;                ///< on average
  /// A pass with as many samples in every pixel, and one with counts[pixel]; spp is their average.
  void add(int pass_spp);
  void add(int pass_spp, std::span<const std::uint32_t> counts);
};

/// Which samples a pass consists of, in the order in which they are traced and merged. What a sample is depends on its
/// number alone, not on batches.
class SampleNumbering {
 public:
  virtual ~SampleNumbering() = default;
  virtual std::size_t size() const = 0;
  /// The samples `begin` up to `end` of the pass, in place of what `samples` held.
  virtual void number(std::size_t begin, std::size_t end, NumberedSamples& samples) const = 0;
};

/// Samples of the whole film, which go where a proposal puts them: one stream for each, from pass to pass.
class JointNumbering final : public SampleNumbering {
 public:
  JointNumbering(std::size_t pixels, const BegunSamples& begun, int spp);
  std::size_t size() const override { return m_size; }
  void number(std::size_t begin, std::size_t end, NumberedSamples& samples) const override;

 private:
  std::uint64_t m_first;
  std::size_t m_size;
};

/// `spp` samples in every pixel of a stratified film. All samples of a pixel stand together. They go in turn to
/// kReplicates streams, whose sequences are carried on from pass to pass; independent samples have a stream each.
class PlainNumbering final : public SampleNumbering {
 public:
  /// pixels: in their order. Views; `begun` is how it is before the pass and stays so until its end.
  PlainNumbering(std::span<const std::uint32_t> pixels, const BegunSamples& begun, Sampler sampler, int spp);
  std::size_t size() const override { return m_pixels.size() * m_spp; }
  void number(std::size_t begin, std::size_t end, NumberedSamples& samples) const override;

 private:
  std::span<const std::uint32_t> m_pixels;
  const BegunSamples& m_begun;
  Sampler m_sampler;
  std::size_t m_spp;
};

/// The same with counts[pixel] samples in each. Sequences begin anew: points that complete those of earlier passes
/// would depend on what these taught. Each sample weighs by the average count over that of its pixel, so that the pass
/// weighs the same in every pixel.
class GuidedNumbering final : public SampleNumbering {
 public:
  /// As above. weight: of a sample in a pixel of an average count, `spp`.
  GuidedNumbering(std::span<const std::uint32_t> pixels, const BegunSamples& begun, Sampler sampler, int spp,
                  std::span<const std::uint32_t> counts, float weight);
  std::size_t size() const override { return m_begin.back(); }
  void number(std::size_t begin, std::size_t end, NumberedSamples& samples) const override;

 private:
  std::span<const std::uint32_t> m_pixels;
  const BegunSamples& m_begun;
  Sampler m_sampler;
  std::span<const std::uint32_t> m_counts;
  float m_pixel_weight;              // of all samples of a pixel
  std::vector<std::size_t> m_begin;  // first sample of the k-th pixel in their order; at the end how many there are
};

}  // namespace warpath
