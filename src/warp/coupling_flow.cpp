#include "warp/coupling_flow.h"

#include <algorithm>
#include <bit>

#include "warp/scratch.h"
#include "warpath/error.h"

namespace warpath {
namespace {

struct alignas(nn::kAlignment) Line {
  float values[16];
};

}  // namespace

void CouplingFlow::pack(const float* parameters, PackedParameters& packed, bool back) const {
  resize(packed, back);
  for (std::size_t c = 0; c < coupling_count(); ++c) pack_coupling(c, parameters, packed);
}

void run_flow(const CouplingFlow& flow, const PackedParameters& packed, bool forward, Batch<const double> from,
              Batch<double> to, std::span<double> log_det) {
  using nn::kBlock;
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
    for (std::size_t r = 0; r < rows; ++r) {
      const double* row = &from(first + r, 0);
      for (std::size_t i = 0; i < dims; ++i) block[i * kBlock + r] = row[i];
    }
    if (rows < kBlock)  // the last block is filled up
      for (std::size_t i = 0; i < dims; ++i) std::fill(block + i * kBlock + rows, block + (i + 1) * kBlock, 0.5);
    if (forward) {
      flow.forward(packed, block, block, sums, rest);
    } else {
      flow.inverse(packed, block, block, sums, rest);
    }
    for (std::size_t r = 0; r < rows; ++r) {
      double* row = &to(first + r, 0);
      for (std::size_t i = 0; i < dims; ++i) row[i] = block[i * kBlock + r];
    }
    std::copy_n(sums, rows, log_det.data() + first);
  }
}

std::vector<bool> binary_mask(int dims, int coupling) {
  if (dims == 1) return {true};
  unsigned bits = 1;
  if (dims > 2) {
    const unsigned all = std::bit_ceil(static_cast<unsigned>(dims)) - 1;
    std::vector<unsigned> order;
    for (unsigned m = 1; m <= all; ++m) order.push_back(m);
    std::stable_sort(order.begin(), order.end(),
                     [](unsigned a, unsigned b) { return std::popcount(a) < std::popcount(b); });
    bits = order[static_cast<std::size_t>(coupling / 2) % order.size()];
  }
  std::vector<bool> moved;
  for (unsigned i = 0; i < static_cast<unsigned>(dims); ++i)
    moved.push_back((std::popcount(i & bits) % 2 == 1) != (coupling % 2 == 1));
  return moved;
}

}  // namespace warpath
