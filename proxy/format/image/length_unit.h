// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

#include "proxy/customization/customization.h"
#include "proxy/format/image/proxy_image.h"

namespace vestige {

// Domains from atoms to clusters of galaxies: lengths in world units need not fit single precision,
// nor their squares. In units of about the domain they do. A factor that is a power of two changes
// no digit.

/// The power of two nearest to a domain's diagonal where that is below 2^-16 or above 2^16; else 1.
double lengthUnitFor(const Box& domain);

/// Multiplies all places and lengths.
void scaleLengths(Camera& camera, double factor);
void scaleLengths(Box& box, double factor);
void scaleLengths(TransferFunction& function, double factor);
void scaleLengths(Customization& customization, double factor);
void scaleLengths(ProxyHeader& header, double factor);

/// Whether a part of a kind of proxy holds lengths or depths alone.
bool isLength(std::string_view kind, std::string_view part);
/// Whether a channel of a part does.
bool isLength(std::string_view kind, std::string_view part, std::string_view channel);

}  // namespace vestige
