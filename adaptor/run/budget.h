// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "adaptor/config/config.h"

namespace vestige {

/// What budgets count apart: proxies that are pictures of views, stacks, fields.
enum class Tier { Pictures, Sliced, Field };
using TierBytes = std::array<double, 3>;  ///< by Tier
double sumOf(const TierBytes& bytes);

/// A setting of a step by name, and the bytes that are expected of it.
struct LevelEstimate {
  std::string name;
  TierBytes bytes{};
};

/// Keeps a run within [budget]: at which level of a list of quality levels, best first, a step is
/// made, whether it may be stored, and at which times. It knows neither configurations nor GL; its
/// clock is given. Without a time share nothing depends on the clock.
///
/// Bytes. A step that turns out larger than the budget is made again at the next level that is
/// expected to fit; one that does not fit at the last level is not stored. What it came to at both
/// levels corrects what is expected. When a step would have left kRoom of the budget at the level
/// above, `patience` stored steps in a row, the next one is made there; an ascent that fails
/// doubles the patience.
///
/// Time. A step may be stored once it would keep the share, taken that it costs as much as the last
/// one at its level: so cadence goes first. Where the configuration asks for a cadence and more
/// than kMostSkipped of its steps in a row are skipped, the level goes down, and up again when no
/// more than half as many would be.
class Budget {
 public:
  using Clock = std::function<double()>;  ///< seconds of the run, never falling
  enum class Verdict { Keep, Again, Drop };
  static constexpr double kRoom = 0.8;
  static constexpr int kPatience = 3, kMostPatience = 48, kMostSkipped = 8;

  /// `cadenceAsked`: the run has triggers of its own.
  Budget(BudgetConfig config, bool cadenceAsked, Clock clock);

  /// At least one level. Until then there is one without a name.
  void setLevels(std::vector<LevelEstimate> levels);
  int level() const { return level_; }
  int levels() const { return int(levels_.size()); }

  /// "quality level 2 of 7 (one stack of 20 slabs, 32 levels)"
  std::string place(int level) const;

  /// Whether the time share has room for a step; it always has for the first one.
  bool hasTime() const;
  /// A step that was due is not stored for want of time; counted once a cycle.
  void skip(std::int64_t cycle);
  /// Around everything that takes the host's time.
  void begin();
  void end();

  /// Of a step that was made at level() and not written yet. Again: make it at level(), which is
  /// lower now.
  Verdict judge(std::int64_t cycle, const TierBytes& made);
  /// The step is on disk; between begin() and end().
  void stored(std::int64_t cycle);

  /// Steps skipped since the last stored one, and seconds of the run that a step as the last
  /// one needs to keep the share; 0 without a share.
  int passedOver() const { return passedOver_; }
  double secondsNeeded() const;

  /// One sentence for each change since the last call; true = something is lost.
  std::vector<std::pair<bool, std::string>> takeNews() { return std::exchange(news_, {}); }

 private:
  double expected(const TierBytes& made, int from, int to) const;
  double uncorrected(const TierBytes& made, int from, int to) const;
  double costAt(int level) const;
  double passesAt(int level) const;
  void learn(const TierBytes& made);
  void descended();
  void tryAbove(std::int64_t cycle);

  BudgetConfig config_;
  bool cadenceAsked_;
  Clock clock_;
  std::vector<LevelEstimate> levels_{1};
  std::vector<double> correction_{1.0};          ///< [level] of expected bytes
  std::vector<std::optional<double>> cost_{{}};  ///< [level] seconds of its last step
  int level_ = 0;
  std::optional<std::pair<int, TierBytes>> attempt_;  ///< of the step at hand: level and bytes
  TierBytes made_{};                                  ///< by the last step that fitted
  int calm_ = 0;                                      ///< stored steps in a row with room above
  int patience_ = kPatience;
  std::optional<int> sinceAscent_;  ///< steps stored since the last ascent

  double spent_ = 0.0, begun_ = 0.0;
  int passedOver_ = 0;
  long due_ = 0;  ///< steps stored or skipped
  std::optional<std::int64_t> lastPassed_;
  std::vector<std::pair<bool, std::string>> news_;
};

}  // namespace vestige
