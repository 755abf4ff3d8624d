// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "explorer/recomposition/edit_pass.h"
#include "proxy/archive/archive.h"
#include "proxy/format/image/proxy_image.h"

namespace vestige::synthetic {

/// The analytic scene of the explorer's tests: f = 1 - |x| in the box [-1, 1]^3, so that intervals
/// are nested spherical shells, seen from the front (along +y).
inline constexpr int kIntervals = 5;

ProxyHeader header(std::string_view kind, ImageSize size);
/// The stretches of one ray, front to back, in closed form.
std::vector<Segment> trueSegments(const ProxyHeader& header, int x, int y);
ProxyImage lengthProxy(ImageSize size);
ProxyImage attenuationProxy(ImageSize size);
/// Spheres of radius 1 - isovalue with exact normals.
ProxyImage depthProxy(ImageSize size, std::vector<double> isovalues);
ProxyImage mipProxy(ImageSize size);
ProxyImage referenceProxy(ImageSize size);

/// The recomposition of method §2 in double: what a picture must be.
std::array<double, 4> composite(const std::vector<Segment>& segments, const ChannelTable& table);

/// A function without structure: three bumps of opacity.
IntervalLook someLook(const IntervalPartition& partition);

/// Writes an archive of `cycles` steps (cycles 0, 10, 20 ...) with every proxy above.
void writeArchive(const std::filesystem::path& directory, ImageSize size, int cycles);

/// A folder of its own, removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace vestige::synthetic
