// SPDX-License-Identifier: BSD-3-Clause
#include "mini-sim/terminal.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace minisim {
namespace {

volatile sig_atomic_t interruptSeen = 0;
void noteInterrupt(int) { interruptSeen = 1; }

constexpr auto kRedraw = std::chrono::milliseconds(100);
constexpr int kBarWidth = 30;

}  // namespace

Progress::Progress(long total, std::string unit, bool quiet)
    : total_(total), unit_(std::move(unit)), quiet_(quiet), terminal_(isatty(STDERR_FILENO)) {}

Progress::~Progress() {
  if (barShown_) std::fputc('\n', stderr);
}

bool Progress::due(long done) const {
  if (quiet_ || total_ <= 0) return false;
  if (done == total_) return true;
  if (terminal_) return Clock::now() - shownAt_ >= kRedraw;
  return done * 10 / total_ > (done - 1) * 10 / total_;
}

void Progress::show(long done, const std::string& note) {
  if (!due(done)) return;
  if (!terminal_) {
    std::fprintf(stderr, "%ld/%ld %s%s%s\n", done, total_, unit_.c_str(), note.empty() ? "" : ", ",
                 note.c_str());
    return;
  }
  const int filled = int(kBarWidth * double(done) / double(total_));
  std::string bar(std::size_t(filled), '#');
  bar.resize(kBarWidth, '.');
  std::fprintf(stderr, "\r\033[K[%s] %ld/%ld %s  %s", bar.c_str(), done, total_, unit_.c_str(),
               note.c_str());
  std::fflush(stderr);
  shownAt_ = Clock::now();
  barShown_ = true;
}

void Progress::say(const std::string& line) {
  std::fprintf(stderr, "%s%s\n", barShown_ ? "\r\033[K" : "", line.c_str());
  barShown_ = false;
}

InterruptGuard::InterruptGuard() {
  interruptSeen = 0;
  struct sigaction action = {};
  action.sa_handler = noteInterrupt;
  action.sa_flags = SA_RESETHAND | SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

InterruptGuard::~InterruptGuard() {
  signal(SIGINT, SIG_DFL);
  signal(SIGTERM, SIG_DFL);
}

bool InterruptGuard::interrupted() { return interruptSeen != 0; }

}  // namespace minisim
