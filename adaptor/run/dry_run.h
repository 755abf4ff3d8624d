// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "adaptor/step/step.h"

namespace vestige {

/// What a step costs.
struct DryRunReport {
  std::uint64_t bytes = 0;
  std::vector<std::string> sentences;  ///< one for the step, one for each proxy of each field
};

/// Of a step that has been made and not written.
DryRunReport dryRunReport(const StepFrame& frame, const std::vector<EncodedProxy>& proxies,
                          const StepTimes& times);

}  // namespace vestige
