#pragma once
#include <chrono>
#include <functional>
#include <string>

#include "core/ordered.h"

namespace warpath {

/// Progress of one stage: a bar with the time left on a terminal, a line at the end in a pipe. On standard error.
class StageProgress {
 public:
  StageProgress(std::string stage, bool quiet);
  ~StageProgress();
  StageProgress(const StageProgress&) = delete;
  StageProgress& operator=(const StageProgress&) = delete;
  void update(double fraction);
  Progress callback() {
    return [this](double fraction) { update(fraction); };
  }

 private:
  std::string m_stage;
  bool m_quiet, m_terminal;
  std::chrono::steady_clock::time_point m_start, m_last_drawn;
};

/// A StageProgress for every stage that begins, for as long as what this returns is kept.
std::function<Progress(const std::string& stage)> terminal_stages(bool quiet);

/// Ctrl-C asks running loops to end with what they have; a second one ends the process.
void handle_interrupts();

}  // namespace warpath
