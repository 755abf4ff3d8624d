// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "proxy/camera/camera.h"

namespace vestige {

/// A camera: projection, position, forward, up and what is its own.
nlohmann::json cameraInfo(const Camera& camera);

}  // namespace vestige
