// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <OpenEXR/ImfForward.h>

#include <string>
#include <vector>

#include "proxy/format/image/proxy_image.h"

namespace vestige {

/// How one channel of a part is stored.
struct ChannelLayout {
  std::string name;
  ChannelStorage storage = ChannelStorage::Float;
  float fill = 0.0f;      ///< in-memory value of pixels outside the data window
  bool constant = false;  ///< every pixel is `fill`; the file has no such channel
};

/// How a part is stored: everything of a ProxyPart but its pixels.
struct PartLayout {
  std::string name;
  double unit = 1.0;
  double zero = 0.0;
  double error = 0.0;
  std::vector<ChannelLayout> channels;
};

/// Sets the standard and the vestige:* attributes of docs/archive-format.md. Throws InvalidArgument
/// naming what is not finite.
void setProxyAttributes(Imf::Header& header, const ProxyHeader& proxy);
void setPartAttributes(Imf::Header& header, const PartLayout& layout);
/// Back; throw Format with the reason, without the file's name.
ProxyHeader proxyHeaderFrom(const Imf::Header& header);
PartLayout partLayoutFrom(const Imf::Header& header);

}  // namespace vestige
