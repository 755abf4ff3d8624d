// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/format/image/proxy_image.h"

#include <algorithm>

#include "proxy/base/error.h"

namespace vestige {

const Channel* ProxyPart::find(std::string_view channel) const {
  auto it = std::find_if(channels.begin(), channels.end(),
                         [&](const Channel& c) { return c.name == channel; });
  return it == channels.end() ? nullptr : &*it;
}

const ProxyPart* ProxyImage::find(std::string_view part) const {
  auto it =
      std::find_if(parts.begin(), parts.end(), [&](const ProxyPart& p) { return p.name == part; });
  return it == parts.end() ? nullptr : &*it;
}

const ProxyPart& ProxyImage::part(std::string_view name) const {
  if (const ProxyPart* found = find(name)) return *found;
  throw Error(ErrorCode::NotFound,
              "the " + header.kind + " proxy has no part '" + std::string(name) + "'");
}

const Channel& ProxyImage::channel(std::string_view partName, std::string_view name) const {
  if (const Channel* found = part(partName).find(name)) return *found;
  throw Error(ErrorCode::NotFound, "part '" + std::string(partName) + "' of the " + header.kind +
                                       " proxy has no channel '" + std::string(name) + "'");
}

}  // namespace vestige
