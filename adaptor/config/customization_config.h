// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "adaptor/config/config_reader.h"
#include "proxy/customization/customization.h"

namespace vestige {

/// Reads [customization], whose keys are those of looks; a march cannot blend to other functions.
/// Errors are Config errors at the key's line.
Customization readCustomization(const ConfigReader& reader);

}  // namespace vestige
