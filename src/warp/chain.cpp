#include "warp/chain.h"

#include "warp/load.h"
#include "warp/scratch.h"
#include "warpath/error.h"

namespace warpath {
namespace {

/// first, then second; the sum of what both say of their volumes.
template <class First, class Second>
void run(Batch<const double> from, Batch<double> to, std::span<double> log_det, const First& first,
         const Second& second) {
  const Scratch<double> of_second(from.rows());
  first(from, to, log_det);
  second(to, to, std::span<double>(of_second.data(), from.rows()));
  for (std::size_t i = 0; i < from.rows(); ++i) log_det[i] += of_second[i];
}

}  // namespace

Chain::Chain(std::shared_ptr<const Warp> inner, std::shared_ptr<const Warp> outer)
    : m_inner(std::move(inner)), m_outer(std::move(outer)) {
  WARPATH_CHECK(m_inner && m_outer);
  WARPATH_CHECK_EQ(m_inner->dims(), m_outer->dims());
}

void Chain::forward(Batch<const double> z, Batch<double> y, std::span<double> log_det) const {
  run(
      z, y, log_det, [&](auto... a) { m_inner->forward(a...); }, [&](auto... a) { m_outer->forward(a...); });
}

void Chain::inverse(Batch<const double> y, Batch<double> z, std::span<double> log_det) const {
  run(
      y, z, log_det, [&](auto... a) { m_outer->inverse(a...); }, [&](auto... a) { m_inner->inverse(a...); });
}

void Chain::save(TensorFile& file, const std::string& prefix) const {
  save_header(file, prefix, *this);
  m_inner->save(file, prefix + "inner.");
  m_outer->save(file, prefix + "outer.");
}

std::shared_ptr<const Chain> Chain::load(const TensorFile& file, const std::string& prefix,
                                         const ProposalLoader& load_part) {
  const int dims = load_dims(file, prefix);
  const auto part = [&](const char* name) {
    // Chains of chains could nest without end in a file that is not ours.
    if (file.meta(prefix + name + "family") == "chain") fail_load(file, prefix, "a chain within a chain");
    auto warp = std::dynamic_pointer_cast<const Warp>(load_part(file, prefix + name));
    if (!warp) fail_load(file, prefix, "a chain of what is no warp");
    if (warp->dims() != dims) fail_load(file, prefix, "a part of other dimensions than the chain's");
    return warp;
  };
  return std::make_shared<Chain>(part("inner."), part("outer."));
}

}  // namespace warpath
