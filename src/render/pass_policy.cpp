#include "render/pass_policy.h"

namespace warpath {

std::optional<PassRecord> Fixed::plan(int done) {
  const auto length = m_schedule.next(done);
  if (!length) return {};
  PassRecord pass;
  pass.spp = length->spp;
  pass.drawn_by = m_drawn_by;
  pass.teaches = m_learns_from_last || !length->last;
  return pass;
}

bool Fixed::ends(const PassRecord&, int done, std::uint64_t) const { return m_schedule.over(done); }

void Fixed::judge(PassRecord& pass, const PassResult& result) { m_schedule.took(result.seconds / pass.spp); }

double Fixed::progress(const PassRecord& pass, int done, double fraction) const {
  return m_schedule.progress(done + fraction * pass.spp);
}

Replayed::Replayed(std::vector<PassRecord> passes) : m_passes(std::move(passes)) {
  for (const PassRecord& pass : m_passes) m_spp += pass.spp;
}

std::optional<PassRecord> Replayed::plan(int) {
  if (m_next == m_passes.size()) return {};
  return m_passes[m_next++];
}

bool Replayed::ends(const PassRecord& pass, int, std::uint64_t begun) const { return begun == pass.batches; }

double Replayed::progress(const PassRecord& pass, int done, double fraction) const {
  return (done + fraction * pass.spp) / m_spp;
}

}  // namespace warpath
