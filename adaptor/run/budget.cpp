// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/run/budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

namespace vestige {
namespace {

std::string megabytes(double bytes) { return fmt::format("{:.4g} MB", bytes * 1e-6); }

}  // namespace

double sumOf(const TierBytes& bytes) { return std::accumulate(bytes.begin(), bytes.end(), 0.0); }

Budget::Budget(BudgetConfig config, bool cadenceAsked, Clock clock)
    : config_(config), cadenceAsked_(cadenceAsked), clock_(std::move(clock)) {}

void Budget::setLevels(std::vector<LevelEstimate> levels) {
  levels_ = std::move(levels);
  correction_.assign(levels_.size(), 1.0);
  cost_.assign(levels_.size(), std::nullopt);
  level_ = 0;
}

std::string Budget::place(int level) const {
  return fmt::format("quality level {} of {} ({})", level + 1, levels(),
                     levels_[std::size_t(level)].name);
}

// --- bytes ---------------------------------------------------------------------------------------

double Budget::uncorrected(const TierBytes& made, int from, int to) const {
  const TierBytes &here = levels_[std::size_t(from)].bytes, &there = levels_[std::size_t(to)].bytes;
  // Tiers that only one of the levels has are as far from what was expected as the step as a whole.
  const double whole = sumOf(here) > 0.0 ? sumOf(made) / sumOf(here) : 1.0;
  double sum = 0.0;
  for (std::size_t tier = 0; tier < made.size(); ++tier) {
    sum += here[tier] > 0.0 ? made[tier] * there[tier] / here[tier] : whole * there[tier];
  }
  return sum;
}

double Budget::expected(const TierBytes& made, int from, int to) const {
  return uncorrected(made, from, to) * correction_[std::size_t(to)] /
         correction_[std::size_t(from)];
}

void Budget::learn(const TierBytes& made) {
  if (attempt_) {
    const auto& [from, before] = *attempt_;
    if (const double guess = uncorrected(before, from, level_); guess > 0.0) {
      correction_[std::size_t(level_)] = correction_[std::size_t(from)] * sumOf(made) / guess;
    }
  }
  attempt_ = {level_, made};
}

void Budget::descended() {
  if (sinceAscent_ && *sinceAscent_ < 4 * patience_) {
    patience_ = std::min(2 * patience_, kMostPatience);
  }
  sinceAscent_.reset();
  calm_ = 0;
}

Budget::Verdict Budget::judge(std::int64_t cycle, const TierBytes& made) {
  learn(made);
  const double bytes = sumOf(made);
  if (!config_.bytesPerStep || bytes <= double(*config_.bytesPerStep)) {
    attempt_.reset();
    made_ = made;
    return Verdict::Keep;
  }
  const double budget = double(*config_.bytesPerStep);
  descended();
  if (level_ + 1 == levels()) {
    attempt_.reset();
    news_.emplace_back(true,
                       fmt::format("cycle {} is not stored: it has {} even at the last {}, "
                                   "more than [budget] bytes_per_step = {}",
                                   cycle, megabytes(bytes), place(level_), megabytes(budget)));
    return Verdict::Drop;
  }
  const int before = level_++;
  while (level_ + 1 < levels() && expected(made, before, level_) > budget) ++level_;
  news_.emplace_back(
      false, fmt::format("cycle {} has {} at {}, more than [budget] bytes_per_step "
                         "= {}: it is made again at {}",
                         cycle, megabytes(bytes), place(before), megabytes(budget), place(level_)));
  return Verdict::Again;
}

// --- time ----------------------------------------------------------------------------------------

double Budget::costAt(int level) const {
  if (const auto& known = cost_[std::size_t(level)]) return *known;
  // That of the nearest level, those below first: there it was last.
  for (int away = 1; away < levels(); ++away) {
    for (const int other : {level + away, level - away}) {
      if (other >= 0 && other < levels() && cost_[std::size_t(other)]) {
        return *cost_[std::size_t(other)];
      }
    }
  }
  return 0.0;
}

bool Budget::hasTime() const {
  if (!config_.timeShare || due_ == 0) return true;
  const double cost = costAt(level_);
  return spent_ + cost <= *config_.timeShare * (clock_() + cost);
}

double Budget::secondsNeeded() const {
  return config_.timeShare ? costAt(level_) / *config_.timeShare : 0.0;
}

void Budget::skip(std::int64_t cycle) {
  if (lastPassed_ == cycle) return;
  lastPassed_ = cycle;
  ++due_;
  if (++passedOver_ == 1) {
    news_.emplace_back(
        false, fmt::format("cycle {} is skipped, and more may be: {:.3g} s of {:.3g} s are "
                           "spent, and a step of {:.3g} s would take more than [budget] time_share "
                           "= {}",
                           cycle, spent_, clock_(), costAt(level_), *config_.timeShare));
  }
}

void Budget::begin() {
  begun_ = clock_();
  attempt_.reset();  // a step that failed halfway says nothing of this one
}
void Budget::end() { spent_ += clock_() - begun_; }

double Budget::passesAt(int level) const {
  const double cost = costAt(level), now = clock_();
  const double solver = now - spent_ - (now - begun_);  // we are between begin and end
  const double between = cost / *config_.timeShare - cost;
  return solver > 0.0 ? between * double(due_) / solver : double(due_);
}

void Budget::stored(std::int64_t cycle) {
  cost_[std::size_t(level_)] = clock_() - begun_;
  ++due_;
  const int passed = std::exchange(passedOver_, 0);
  const bool late = config_.timeShare && cadenceAsked_ && passed > kMostSkipped;
  if (late && level_ + 1 < levels()) {
    descended();
    ++level_;
    news_.emplace_back(false, fmt::format("{} steps were skipped before cycle {} to keep "
                                          "[budget] time_share = {}: on at {}",
                                          passed, cycle, *config_.timeShare, place(level_)));
    return;
  }
  if (sinceAscent_) ++*sinceAscent_;
  tryAbove(cycle);
}

void Budget::tryAbove(std::int64_t cycle) {
  if (level_ == 0) return;
  const double above = expected(made_, level_, level_ - 1);
  const bool room = !config_.bytesPerStep || above <= kRoom * double(*config_.bytesPerStep);
  const bool time =
      !config_.timeShare || !cadenceAsked_ ||
      (passesAt(level_) <= 0.5 * kMostSkipped && passesAt(level_ - 1) <= 0.5 * kMostSkipped);
  calm_ = room && time ? calm_ + 1 : 0;
  if (calm_ < patience_) return;
  calm_ = 0;
  sinceAscent_ = 0;
  --level_;
  news_.emplace_back(false, fmt::format("after cycle {} there is room: {} are expected at {}, "
                                        "which is tried next",
                                        cycle, megabytes(above), place(level_)));
}

}  // namespace vestige
