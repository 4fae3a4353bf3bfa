#include "estimate/sample_numbering.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "estimate/film.h"

namespace warpath {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

const std::vector<std::uint32_t> kPixels{2, 0, 3, 1, 4};  // in an order other than their own

NumberedSamples all_of(const SampleNumbering& numbering) {
  NumberedSamples samples;
  numbering.number(0, numbering.size(), samples);
  return samples;
}

BegunSamples nothing_begun() {
  BegunSamples begun;
  begun.in_pixel.resize(kPixels.size());
  return begun;
}

/// The points that a stream's sequences have handed out, for each stream.
using Points = std::map<std::uint64_t, std::vector<std::uint32_t>>;
void add_points(const NumberedSamples& samples, Points& points) {
  for (std::size_t i = 0; i < samples.size(); ++i) points[samples.ids[i]].push_back(samples.indices[i]);
}

TEST(SampleNumbering, BatchesDoNotChangeWhatASampleIs) {
  BegunSamples begun = nothing_begun();
  begun.add(3);
  const std::vector<std::uint32_t> counts{1, 9, 2, 4, 4};
  const JointNumbering joint(kPixels.size(), begun, 4);
  const PlainNumbering plain(kPixels, begun, Sampler::sobol, 4);
  const GuidedNumbering guided(kPixels, begun, Sampler::sobol, 4, counts, 0.5f);
  for (const SampleNumbering* numbering :
       {static_cast<const SampleNumbering*>(&joint), static_cast<const SampleNumbering*>(&plain),
        static_cast<const SampleNumbering*>(&guided)}) {
    ASSERT_EQ(numbering->size(), 20u);
    const NumberedSamples whole = all_of(*numbering);
    NumberedSamples joined, batch;
    for (std::size_t begin = 0; begin < 20; begin += 7) {
      numbering->number(begin, std::min<std::size_t>(begin + 7, 20), batch);
      const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
      append(joined.ids, batch.ids);
      append(joined.indices, batch.indices);
      append(joined.pixels, batch.pixels);
      append(joined.replicates, batch.replicates);
      append(joined.weights, batch.weights);
    }
    EXPECT_EQ(joined.ids, whole.ids);
    EXPECT_EQ(joined.indices, whole.indices);
    EXPECT_EQ(joined.pixels, whole.pixels);
    EXPECT_EQ(joined.replicates, whole.replicates);
    EXPECT_EQ(joined.weights, whole.weights);
  }
}

TEST(SampleNumbering, JointSamplesAreOfTheWholeFilmAndNeverTheSame) {
  BegunSamples begun;
  std::vector<std::uint64_t> ids;
  for (const int spp : {2, 3}) {
    const NumberedSamples samples = all_of(JointNumbering(kPixels.size(), begun, spp));
    EXPECT_FALSE(samples.have_pixels());
    EXPECT_THAT(samples.weights, IsEmpty());
    ids.insert(ids.end(), samples.ids.begin(), samples.ids.end());
    begun.add(spp);
  }
  std::vector<std::uint64_t> expected(25);
  std::iota(expected.begin(), expected.end(), 0u);
  EXPECT_EQ(ids, expected);
}

TEST(SampleNumbering, SamplesOfAPixelStandTogether) {
  const NumberedSamples plain = all_of(PlainNumbering(kPixels, nothing_begun(), Sampler::independent, 2));
  EXPECT_THAT(plain.pixels, ElementsAre(2, 2, 0, 0, 3, 3, 1, 1, 4, 4));
  const std::vector<std::uint32_t> counts{1, 3, 2, 1, 3};
  const BegunSamples begun = nothing_begun();
  const NumberedSamples guided = all_of(GuidedNumbering(kPixels, begun, Sampler::independent, 2, counts, 1));
  EXPECT_THAT(guided.pixels, ElementsAre(2, 2, 0, 3, 1, 1, 1, 4, 4, 4));
}

TEST(SampleNumbering, IndependentSamplesHaveAStreamEachForWhateverPasses) {
  BegunSamples begun = nothing_begun();
  std::vector<std::uint64_t> ids;
  const std::vector<std::uint32_t> counts{1, 9, 2, 4, 4};
  const auto add = [&](const NumberedSamples& samples) {
    ids.insert(ids.end(), samples.ids.begin(), samples.ids.end());
    EXPECT_THAT(samples.indices, IsEmpty());
    EXPECT_THAT(samples.replicates, IsEmpty());
  };
  add(all_of(PlainNumbering(kPixels, begun, Sampler::independent, 3)));
  begun.add(3);
  add(all_of(GuidedNumbering(kPixels, begun, Sampler::independent, 4, counts, 1)));
  begun.add(4, counts);
  add(all_of(PlainNumbering(kPixels, begun, Sampler::independent, 2)));
  EXPECT_EQ(ids.size(), 45u);
  EXPECT_EQ(std::set<std::uint64_t>(ids.begin(), ids.end()).size(), ids.size());
}

TEST(SampleNumbering, PlainPassesCarrySequencesOn) {
  BegunSamples begun = nothing_begun();
  Points points;
  for (const int spp : {5, 11, 8}) {
    add_points(all_of(PlainNumbering(kPixels, begun, Sampler::sobol, spp)), points);
    begun.add(spp);
  }
  EXPECT_EQ(points.size(), kPixels.size() * kReplicates);
  for (const auto& [stream, indices] : points) EXPECT_THAT(indices, ElementsAre(0, 1, 2));
}

TEST(SampleNumbering, GuidedPassesBeginSequencesAnew) {
  BegunSamples begun = nothing_begun();
  const std::vector<std::uint32_t> counts(kPixels.size(), 16);
  Points plain, first, second;
  add_points(all_of(PlainNumbering(kPixels, begun, Sampler::sobol, 8)), plain);
  begun.add(8);
  add_points(all_of(GuidedNumbering(kPixels, begun, Sampler::sobol, 16, counts, 1)), first);
  begun.add(16, counts);
  add_points(all_of(GuidedNumbering(kPixels, begun, Sampler::sobol, 16, counts, 1)), second);
  std::set<std::uint64_t> streams;
  for (const Points* points : {&plain, &first, &second})
    for (const auto& [stream, indices] : *points) streams.insert(stream);
  EXPECT_EQ(streams.size(), 3 * kPixels.size() * kReplicates) << "no stream serves two of the passes";
  for (const Points* points : {&first, &second})
    for (const auto& [stream, indices] : *points) EXPECT_THAT(indices, ElementsAre(0, 1));
}

// Whatever was begun before, a pixel's samples go to replicates in turn, and a replicate has sequences of its own.
TEST(SampleNumbering, ReplicatesTakeTurnsOverAllPasses) {
  BegunSamples begun = nothing_begun();
  const std::vector<std::uint32_t> counts{1, 3, 5, 7, 9};
  std::map<std::uint32_t, std::vector<std::uint32_t>> replicates;  // of each pixel, in the order of its samples
  std::map<std::uint64_t, std::uint32_t> replicate_of_stream;
  for (int pass = 0; pass < 3; ++pass) {
    const NumberedSamples samples = all_of(GuidedNumbering(kPixels, begun, Sampler::stratified, 5, counts, 1));
    for (std::size_t i = 0; i < samples.size(); ++i) {
      replicates[samples.pixels[i]].push_back(samples.replicates[i]);
      const auto known = replicate_of_stream.emplace(samples.ids[i], samples.replicates[i]).first;
      EXPECT_EQ(known->second, samples.replicates[i]);
    }
    begun.add(5, counts);
  }
  for (const auto& [pixel, taken] : replicates) {
    ASSERT_EQ(taken.size(), 3 * counts[pixel]);
    for (std::size_t i = 0; i < taken.size(); ++i) EXPECT_EQ(taken[i], i % kReplicates) << "pixel " << pixel;
  }
}

// Or counts that follow a pixel's own fireflies would bias it (Kirk and Arvo 1991).
TEST(SampleNumbering, AGuidedPassWeighsTheSameInEveryPixel) {
  const BegunSamples begun = nothing_begun();
  const std::vector<std::uint32_t> counts{1, 9, 2, 4, 4};
  const NumberedSamples samples = all_of(GuidedNumbering(kPixels, begun, Sampler::independent, 4, counts, 0.25f));
  std::vector<double> weight(kPixels.size());
  for (std::size_t i = 0; i < samples.size(); ++i) weight[samples.pixels[i]] += samples.weights[i];
  EXPECT_THAT(weight, Each(::testing::DoubleNear(0.25 * 4, 1e-6)));
  EXPECT_THAT(all_of(PlainNumbering(kPixels, begun, Sampler::independent, 4)).weights, IsEmpty()) << "all are 1";
}

}  // namespace
}  // namespace warpath
