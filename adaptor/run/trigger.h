// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "adaptor/config/config.h"
#include "proxy/transfer/statistics.h"

namespace vestige {

/// Which steps are stored: the first one, and those at which any rule of the configuration fires;
/// all if there is none. Rules:
///   every_cycles N  cycle is a multiple of N
///   every_time Δt   simulation time has reached another multiple of Δt since the first stored step
///   change          a statistic of a field is further than the threshold from what it was at the
///                   last stored step; `histogram` is the total variation, 0..1, between the two
///                   normalised histograms, rebinned onto the union of both ranges
class Trigger {
 public:
  explicit Trigger(TriggerConfig config) : config_(std::move(config)) {}

  /// Whether a rule that needs no field fires.
  bool byCadence(std::int64_t cycle, double time) const;
  /// Whether execute would do anything at all. Reads no field.
  bool mayFire(std::int64_t cycle, double time) const;
  /// Decides. `statistics(field)` is called only where the answer depends on it.
  bool fires(std::int64_t cycle, double time,
             const std::function<FieldStatistics(const std::string&)>& statistics);
  /// The step is on disk.
  void stored(std::int64_t cycle, double time,
              const std::function<FieldStatistics(const std::string&)>& statistics);

 private:
  bool looksAtChange(std::int64_t cycle) const;

  TriggerConfig config_;
  bool any_ = false;  ///< a step has been stored
  double firstTime_ = 0.0;
  double lastTime_ = 0.0;
  std::optional<FieldStatistics> last_;  ///< of the change rule's field, at the last stored step
};

/// How far two statistics are apart by a measure.
double changeBetween(const FieldStatistics& before, const FieldStatistics& now,
                     TriggerConfig::Measure measure);

}  // namespace vestige
