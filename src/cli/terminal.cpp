#include "cli/terminal.h"

#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <memory>

#include "core/interrupt.h"
#include "core/log.h"

namespace warpath {
namespace {

using Clock = std::chrono::steady_clock;
double seconds_between(Clock::time_point a, Clock::time_point b) {
  return std::chrono::duration<double>(b - a).count();
}

std::string duration(double seconds) {
  const int whole = static_cast<int>(std::min(seconds, 1e6) + 0.5);
  return whole < 60 ? fmt::format("{}s", whole) : fmt::format("{}m{:02}s", whole / 60, whole % 60);
}

}  // namespace

StageProgress::StageProgress(std::string stage, bool quiet)
    : m_stage(std::move(stage)), m_quiet(quiet), m_terminal(::isatty(STDERR_FILENO) != 0), m_start(Clock::now()) {}

StageProgress::~StageProgress() {
  if (m_quiet) return;
  if (m_terminal) fmt::print(stderr, "\r\033[K");
  log::info("{}: {:.1f} s", m_stage, seconds_between(m_start, Clock::now()));
}

void StageProgress::update(double fraction) {
  if (m_quiet || !m_terminal) return;
  const auto now = Clock::now();
  constexpr double kRedrawSeconds = 0.1;
  if (seconds_between(m_last_drawn, now) < kRedrawSeconds) return;
  m_last_drawn = now;
  constexpr int kWidth = 32;
  const int filled = std::clamp(static_cast<int>(fraction * kWidth), 0, kWidth);
  const double elapsed = seconds_between(m_start, now);
  const std::string left = fraction > 0.01 ? duration(elapsed / fraction - elapsed) + " left" : "";
  fmt::print(stderr, "\r\033[K{:<28} [{}{}] {:3.0f} %  {}", m_stage, std::string(static_cast<std::size_t>(filled), '#'),
             std::string(static_cast<std::size_t>(kWidth - filled), '.'), 100 * fraction, left);
  std::fflush(stderr);
}

std::function<Progress(const std::string& stage)> terminal_stages(bool quiet) {
  return [quiet](const std::string& stage) -> Progress {
    return [progress = std::make_shared<StageProgress>(stage, quiet)](double fraction) { progress->update(fraction); };
  };
}

void handle_interrupts() {
  struct sigaction action {};
  action.sa_handler = [](int) { g_interrupted = true; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

}  // namespace warpath
