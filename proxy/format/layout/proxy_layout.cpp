// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/format/layout/proxy_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "proxy/base/error.h"
#include "proxy/format/exr/exr_threads.h"
#include "proxy/format/image/length_unit.h"
#include "proxy/format/image/storage_quantiser.h"
#include "proxy/format/layout/stored_planes.h"

namespace vestige {
namespace {

constexpr double kLengthSteps = 8192.0;  ///< per domain diagonal
constexpr double kMostRuns = kHalfLevels;
constexpr double kLayerDepthSteps = 0x1p20;  ///< per domain diagonal, at least
constexpr double kMipSteps = 0x1p16;         ///< over the field's range, at least
constexpr double kNormalSteps = 128.0;

Channel channelOf(std::string name, ChannelStorage storage, std::size_t pixels) {
  return {std::move(name), storage, std::vector<float>(pixels)};
}

bool isZero(std::span<const float> plane) {
  return std::all_of(plane.begin(), plane.end(), [](float v) { return v == 0.0f; });
}

/// A channel of fractions in [0, 1] and a little beyond.
Channel fractions(std::string name, std::span<const float> plane,
                  const std::function<double(float)>& map = {}) {
  Channel channel = channelOf(std::move(name), ChannelStorage::Half, plane.size());
  if (!map && isZero(plane)) return channel;
  const Quantiser quantise(kFractionStep);
  for (std::size_t i = 0; i < plane.size(); ++i) {
    const double value = map ? map(plane[i]) : plane[i];
    channel.values[i] = value > 0.0 ? quantise(value) : 0.0f;
  }
  return channel;
}

/// Which channel a ray enters and leaves in, as 1 + channel; 0 = it misses.
ProxyPart endsPart(std::span<const std::uint8_t> first, std::span<const std::uint8_t> last,
                   ImageSize size) {
  constexpr std::uint8_t kMiss = 255;
  ProxyPart part{"ends", 1.0 / kHalfQuantum, 0.0, 0.0, {}};
  for (const auto& [name, ends] : {std::pair{"first", first}, std::pair{"last", last}}) {
    if (ends.size() != size.pixels())
      throw Error(ErrorCode::InvalidArgument,
                  fmt::format("'{}' has {} channels, the picture {} pixels", name, ends.size(),
                              size.pixels()));
    Channel channel = channelOf(name, ChannelStorage::Half, ends.size());
    for (std::size_t i = 0; i < ends.size(); ++i)
      channel.values[i] = ends[i] == kMiss ? 0.0f : float(ends[i] + 1);
    part.channels.push_back(std::move(channel));
  }
  return part;
}

}  // namespace

DepthRange depthRange(const Camera& camera, const Box& box) {
  DepthRange range{std::numeric_limits<double>::infinity(),
                   -std::numeric_limits<double>::infinity()};
  for (int i = 0; i < 8; ++i) {
    const double depth = glm::dot(box.corner(i) - camera.position, camera.forward);
    range.low = std::min(range.low, depth);
    range.high = std::max(range.high, depth);
  }
  return range;
}

ProxyImage attenuationImage(ProxyHeader header, std::span<const float> attenuation,
                            std::span<const float> transmittance) {
  header.kind = kind::kAttenuation;
  const IntervalPartition& partition = partitionOf(header);
  const ImageSize size = header.size;
  const int channels = partition.channels();
  requirePlanes("attenuation", attenuation.size(), std::size_t(channels), size);
  requirePlanes("transmittance", transmittance.size(), 1, size);
  ProxyPart part{"attenuation", kFractionStep / kHalfQuantum, 0.0, kFractionStep, {}};
  part.channels.resize(std::size_t(channels) + 1);
  forEachOnExrThreads(channels + 1, [&](int k) {
    part.channels[std::size_t(k)] =
        k < channels
            ? fractions(partition.channelName(k), planeOf(attenuation, std::size_t(k), size))
            : fractions("T", transmittance);
  });
  return {std::move(header), {std::move(part)}};
}

ProxyImage lengthImage(ProxyHeader header, std::span<const float> length,
                       std::span<const float> moment, std::span<const float> runs,
                       std::span<const std::uint8_t> first, std::span<const std::uint8_t> last) {
  header.kind = kind::kLength;
  const IntervalPartition& partition = partitionOf(header);
  const ImageSize size = header.size;
  const std::size_t channels = std::size_t(partition.channels());
  requirePlanes("length", length.size(), channels, size);
  requirePlanes("moment", moment.size(), channels, size);
  requirePlanes("runs", runs.size(), channels, size);

  const double lengthStep = diagonalOf(header.domain) / kLengthSteps;
  const DepthRange range = depthRange(header.camera, header.domain);
  const double extent = std::max(range.high - range.low, diagonalOf(header.domain) / 1e6);
  const double depthStep = extent / kDepthLevels;
  // One step before the nearest depth, so that a stored 0 can mean "nothing here".
  const double depthZero = range.low - depthStep;
  const double floatError = std::max(std::abs(range.low), std::abs(range.high)) * 0x1p-24;
  const Quantiser lengths(lengthStep), depths(depthStep, depthZero);
  const double momentUnit = lengthUnitFor(header.domain);
  ProxyPart lengthPart{"length", lengths.unit(), 0.0, 2.0 * lengthStep, {}};
  ProxyPart depthPart{"depth", depths.unit(), depthZero, 0.5 * depthStep + floatError, {}};
  ProxyPart runsPart{"runs", 1.0 / kHalfQuantum, 0.0, 0.0, {}};
  for (ProxyPart* part : {&lengthPart, &depthPart, &runsPart}) part->channels.resize(channels);

  forEachOnExrThreads(int(channels), [&](int number) {
    const std::size_t k = std::size_t(number);
    const std::string name = partition.channelName(number);
    auto l = planeOf(length, k, size), m = planeOf(moment, k, size), r = planeOf(runs, k, size);
    Channel& lengthOut = lengthPart.channels[k] = channelOf(name, ChannelStorage::Half, l.size());
    Channel& depthOut = depthPart.channels[k] = channelOf(name, ChannelStorage::Half, l.size());
    Channel& runsOut = runsPart.channels[k] = channelOf(name, ChannelStorage::Half, l.size());
    const float least = float(0.5 * lengthStep);
    for (std::size_t i = 0; i < l.size(); ++i) {
      if (!(l[i] > least)) continue;
      lengthOut.values[i] = lengths(l[i]);
      const double mean =
          std::clamp(double(m[i]) / double(l[i]) * momentUnit, range.low, range.low + extent);
      depthOut.values[i] = depths(mean);
      runsOut.values[i] = float(std::clamp(std::nearbyint(double(r[i])), 1.0, kMostRuns));
    }
  });
  ProxyImage image{std::move(header),
                   {std::move(lengthPart), std::move(depthPart), std::move(runsPart)}};
  if (!first.empty() || !last.empty()) image.parts.push_back(endsPart(first, last, size));
  return image;
}

ProxyImage depthImage(ProxyHeader header, std::span<const float> depth,
                      std::span<const float> normal) {
  header.kind = kind::kDepth;
  const ImageSize size = header.size;
  const std::size_t layers = header.isovalues.size();
  if (layers == 0)
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("the depth proxy of field '{}' has no isovalue", header.field));
  requirePlanes("depth", depth.size(), layers, size);
  requirePlanes("normal", normal.size(), layers * 3, size);
  // A power of two, so that rounding leaves zeros at the end of the mantissa.
  const double step =
      std::exp2(std::floor(std::log2(diagonalOf(header.domain) / kLayerDepthSteps)));
  const double perStep = 1.0 / step;
  const DepthRange range = depthRange(header.camera, header.domain);
  const double floatError = std::max(std::abs(range.low), std::abs(range.high)) * 0x1p-24;
  ProxyImage image{std::move(header), std::vector<ProxyPart>(layers)};
  forEachOnExrThreads(int(layers), [&](int number) {
    const std::size_t layer = std::size_t(number);
    ProxyPart& part = image.parts[layer];
    // A power of two again: it scales Z without loss and makes the normals small integers.
    part = {fmt::format("layer{:02d}", number),
            1.0 / (kNormalSteps * kHalfQuantum),
            0.0,
            0.5 * step + floatError,
            {}};
    auto z = planeOf(depth, layer, size);
    part.channels.push_back(channelOf("Z", ChannelStorage::Float, z.size()));
    std::vector<float>& out = part.channels.back().values;
    for (std::size_t i = 0; i < z.size(); ++i)
      out[i] = std::isfinite(z[i]) ? float(std::nearbyint(double(z[i]) * perStep) * step)
                                   : std::numeric_limits<float>::infinity();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      static constexpr const char* kNames[] = {"nx", "ny", "nz"};
      auto n = planeOf(normal, layer * 3 + axis, size);
      part.channels.push_back(channelOf(kNames[axis], ChannelStorage::Half, n.size()));
      std::vector<float>& to = part.channels.back().values;
      for (std::size_t i = 0; i < n.size(); ++i)
        if (std::isfinite(z[i]) && std::isfinite(n[i]))
          to[i] = float(std::nearbyint(std::clamp(double(n[i]), -1.0, 1.0) * kNormalSteps) /
                        kNormalSteps) +
                  0.0f;  // no negative zero
    }
  });
  return image;
}

StorageScale mipScale(const IntervalPartition& intervals) {
  const double range = intervals.high() - intervals.low();
  const double size = std::max(std::abs(intervals.low()), std::abs(intervals.high()));
  // A float has 24 bits, of which 16 are for the range.
  if (size <= 1e37 && range >= 0x1p-7 * size && range >= 1e-30) return {};
  return {range, intervals.low() - range};
}

ProxyImage mipImage(ProxyHeader header, std::span<const float> value) {
  header.kind = kind::kMip;
  requirePlanes("mip", value.size(), 1, header.size);
  const double low = header.statistics.low, extent = header.statistics.high - low;
  const bool round = std::isfinite(extent) && extent > 0.0;
  // A power of two, as for depths; what float cannot resolve is left alone.
  const StorageScale scale = header.partition ? mipScale(*header.partition) : StorageScale{};
  const double step =
      round ? std::exp2(std::floor(std::log2(extent / scale.unit / kMipSteps))) : 0.0;
  Channel channel = channelOf("value", ChannelStorage::Float, value.size());
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (std::isnan(value[i]))
      channel.values[i] = std::numeric_limits<float>::quiet_NaN();  // one NaN of the many
    else
      channel.values[i] =
          step > 0.0 ? float(std::nearbyint(double(value[i]) / step) * step) : value[i];
    // As stored, 0 would mean missing.
    if (scale.missingIsZero() && channel.values[i] == 0.0f) channel.values[i] = 0x1p-24f;
  }
  return {std::move(header),
          {{"mip", scale.unit, scale.zero, 0.5 * step * scale.unit, {std::move(channel)}}}};
}

ProxyImage referenceImage(ProxyHeader header, std::span<const float> rgb,
                          std::span<const float> transmittance) {
  header.kind = kind::kReference;
  const ImageSize size = header.size;
  requirePlanes("reference", rgb.size(), 3, size);
  requirePlanes("transmittance", transmittance.size(), 1, size);
  ProxyPart part{"reference", kFractionStep / kHalfQuantum, 0.0, kFractionStep, {}};
  part.channels.resize(4);
  forEachOnExrThreads(4, [&](int i) {
    static constexpr const char* kNames[] = {"R", "G", "B", "A"};
    part.channels[std::size_t(i)] =
        i < 3 ? fractions(kNames[i], planeOf(rgb, std::size_t(i), size))
              : fractions("A", transmittance, [](float t) { return 1.0 - double(t); });
  });
  return {std::move(header), {std::move(part)}};
}

}  // namespace vestige
