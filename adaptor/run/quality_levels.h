// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "adaptor/config/config.h"
#include "adaptor/run/budget.h"

namespace vestige {

/// A complete setting of a step, and where it stands.
struct Level : LevelEstimate {
  Config config;
};

/// What bytes follow, other than the configuration.
struct StepExtent {
  double samples = 0.0;  ///< of a field, in all blocks
  int fields = 1;
  int views = 1;
  /// Pixels of the stacks that a configuration makes, all together.
  std::function<double(const Config&)> stackPixels;
  TierBytes features{};  ///< of classifiers, which no level changes
};

/// The settings that [budget] may choose among, from what the configuration asks for downwards; one
/// if there is no [budget]. Each tier goes down its own part of the frontier measured by the sweep
/// of docs/fidelity.md, all of them reaching its end together: settings that another one beats in
/// bytes and in fidelity (decibels of an edit at the stored view, and of DSSIM at 45 degrees,
/// added) are left out; then resolution, of which no more than its harm to the field is measured.
/// Keys that the configuration gives (Config::fixed) stay as they are. Where it gives bytes but no
/// proxies the tier is free too: the reduced field or stacks, whichever the frontier has for this
/// extent.
std::vector<Level> qualityLevelsOf(const Config& config, const StepExtent& extent);

/// The tier of a proxy, by its name in archives.
Tier tierOf(std::string_view kind);

}  // namespace vestige
