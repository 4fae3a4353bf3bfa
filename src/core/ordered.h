#pragma once
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "core/floating_point.h"
#include "core/interrupt.h"

namespace warpath {

/// Told how much of a long piece of work is done, 0 to 1. Called from one thread at a time.
using Progress = std::function<void(double)>;

/// Runs work(job, i) for i = 0 ... count-1 on all threads, and merge(job, i) one at a time in the order of i, so that
/// sums made in merge do not depend on the number of threads. Jobs (default-constructed) are reused and are at most a
/// few per thread. stop() is asked before each i; when it returns true, or on Ctrl-C, no further i begins. Returns how
/// many i were merged: always the first ones.
template <class Job, class Work, class Merge, class Stop>
std::size_t run_ordered(std::size_t count, const Work& work, const Merge& merge, const Stop& stop) {
  struct Ticket {
    Job* job = nullptr;
    std::size_t index = 0;
  };
  const auto tokens = static_cast<std::size_t>(2 * tbb::this_task_arena::max_concurrency());
  // Both ends of the pipeline are serial and tickets are merged in order, so job i % tokens is free again when i
  // begins: at most `tokens` tickets are in flight.
  std::vector<std::unique_ptr<Job>> jobs;
  for (std::size_t i = 0; i < tokens; ++i) jobs.push_back(std::make_unique<Job>());
  std::size_t next = 0, merged = 0;
  tbb::parallel_pipeline(
      tokens, tbb::make_filter<void, Ticket>(tbb::filter_mode::serial_in_order, [&](tbb::flow_control& control) {
                if (next == count || g_interrupted || stop()) {
                  control.stop();
                  return Ticket{};
                }
                const Ticket ticket{jobs[next % tokens].get(), next};
                ++next;
                return ticket;
              }) & tbb::make_filter<Ticket, Ticket>(tbb::filter_mode::parallel, [&](Ticket ticket) {
                const FlushDenormals flush;
                work(*ticket.job, ticket.index);
                return ticket;
              }) & tbb::make_filter<Ticket, void>(tbb::filter_mode::serial_in_order, [&](Ticket ticket) {
                merge(*ticket.job, ticket.index);
                ++merged;
              }));
  return merged;
}

}  // namespace warpath
