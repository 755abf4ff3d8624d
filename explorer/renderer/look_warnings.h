// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "explorer/renderer/renderer.h"
#include "explorer/picture/stretch.h"
#include "proxy/format/image/proxy_image.h"

namespace vestige {

/// The keys of a look that have no part in a picture made of `answer`.
std::vector<Warning> keysInVain(const Look& look, Answer answer);

/// What a look asks for outside of the data's range or of the domain, or from where it cannot be
/// seen. `camera` of the picture of `size`, in the scene; `function` may be null.
std::vector<Warning> valuesOutside(const Look& look, Answer answer, const ProxyHeader& header,
                                   const TransferFunction* function, const Camera& camera,
                                   ImageSize size);

/// For a picture that holds nothing at all.
Warning nothingSeen(const ProxyHeader& header, const TransferFunction* function);

}  // namespace vestige
