// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "proxy/format/exr/exr_file.h"
#include "proxy/format/image/proxy_image.h"

namespace vestige {

/// What is wrong with the values of a proxy: parts or channels that its kind does not have, and
/// values outside of what the table of ProxyPart and method §2 allow, storage errors granted. One
/// sentence each; empty = all is well.
std::vector<std::string> problemsOf(const ProxyImage& image);
/// The same of a file; stacks are read part by part. Throws as ExrFile.
std::vector<std::string> problemsOf(const ExrFile& file);

/// What of that concerns each value by itself, for readers that cannot afford the rest: the first
/// pixel of each channel outside of its range. Nanoseconds a pixel and channel.
std::vector<std::string> outOfRange(const ProxyHeader& header, const ProxyPart& part);

}  // namespace vestige
