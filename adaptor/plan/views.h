// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "adaptor/config/config.h"
#include "proxy/camera/view_set.h"

namespace vestige {

/// The cameras of the configuration for a domain; `front` if there is none. An explicit camera
/// gets what it does not say from a frame around the domain. Throws Config when two views share a
/// name.
std::vector<View> resolveViews(const Config& config, const Box& domain);

}  // namespace vestige
