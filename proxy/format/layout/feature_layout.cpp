// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/format/layout/feature_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "proxy/base/error.h"
#include "proxy/format/exr/exr_threads.h"
#include "proxy/format/image/length_unit.h"
#include "proxy/format/image/storage_quantiser.h"
#include "proxy/format/layout/proxy_layout.h"
#include "proxy/format/layout/sliced_stack.h"
#include "proxy/format/layout/stored_planes.h"

namespace vestige {
namespace {

constexpr double kRelativeError = 0x1p-9;
/// Deflate's level: see docs/archive-format.md, "Compression".
constexpr int kFeatureZipLevel = 7;

const FeatureOrigin& neededFeatures(const ProxyHeader& header) {
  if (!header.features)
    throw Error(
        ErrorCode::InvalidArgument,
        fmt::format("the {} proxy of field '{}' has no classifier", header.kind, header.field));
  return *header.features;
}

ProxyPart emptyPart(const char* name, double unit, double zero, double error,
                    const std::vector<std::string>& channels, std::size_t pixels) {
  ProxyPart part{name, unit, zero, error, {}};
  for (const std::string& channel : channels)
    part.channels.push_back({channel, ChannelStorage::Half, std::vector<float>(pixels)});
  return part;
}

/// Channel by channel, pixel by pixel: to = value(plane, pixel).
template <typename Value>
void fill(ProxyPart& part, const Value& value) {
  forEachOnExrThreads(int(part.channels.size()), [&](int c) {
    std::vector<float>& to = part.channels[std::size_t(c)].values;
    for (std::size_t i = 0; i < to.size(); ++i) to[i] = value(std::size_t(c), i);
  });
}

ProxyPart fractions(const char* name, const std::vector<std::string>& channels,
                    std::span<const float> planes, std::size_t pixels) {
  ProxyPart part =
      emptyPart(name, kFractionStep / kHalfQuantum, 0.0, kFractionStep, channels, pixels);
  const Quantiser quantise(kFractionStep);
  fill(part, [&](std::size_t c, std::size_t i) {
    const double value = planes[c * pixels + i];
    return value > 0.0 ? quantise(value) : 0.0f;
  });
  return part;
}

std::vector<float> planesOf(const ProxyImage& proxy, const char* part,
                            const std::vector<std::string>& channels) {
  std::vector<float> planes;
  for (const std::string& channel : channels) {
    const std::vector<float>& values = proxy.channel(part, channel).values;
    planes.insert(planes.end(), values.begin(), values.end());
  }
  return planes;
}

/// A number in [0, 1] to a relative 2^-9, and 2^-25, as a half holds it.
float inNineBits(double value) {
  if (!(value > 0.0)) return 0.0f;
  if (value >= 1.0) return 1.0f;
  // A half has fixed steps down there.
  if (value < 0x1p-14) return float(std::nearbyint(value * 0x1p24) * 0x1p-24);
  // Nine of a float's significant bits, ties to even.
  auto bits = std::bit_cast<std::uint32_t>(float(value));
  bits += 0x3fffu + ((bits >> 15) & 1u);
  return std::bit_cast<float>(bits & 0xffff8000u);
}

/// Slab by slab what a stack holds as shares of the rays' stretches.
ProxyPart slabPart(const FeatureStack& stack, const SlabChords& chords,
                   const std::vector<std::string>& channels, int slab) {
  const std::size_t pixels = stack.header.size.pixels();
  const std::vector<float>& integrals = stack.slabs[std::size_t(slab)];
  ProxyPart part =
      emptyPart("", kFractionStep / kHalfQuantum, 0.0, kFractionStep, channels, pixels);
  part.name = slabName(slab);
  const double least = chords.least();
  fill(part, [&](std::size_t c, std::size_t i) {
    const double chord = chords.chord(slab, i);
    return chord > least ? storedShare(double(integrals[c * pixels + i]) / chord) : 0.0f;
  });
  return part;
}

void validate(const FeatureStack& stack) {
  const auto refuse = [&](const std::string& reason) {
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("the sliced features '{}': {}", stack.header.field, reason));
  };
  const std::size_t slabs = stack.slabs.size(), channels = neededFeatures(stack.header).channels();
  if (channels == 0) refuse("the classifier has no channels");
  if (stack.header.camera.projection != Projection::Orthographic)
    refuse("view '" + stack.header.view + "' is perspective; slabs need an orthographic one");
  if (slabs < 1 || slabs > std::size_t(FeatureStack::kMostSlabs))
    refuse(fmt::format("{} slabs, not 1 to {}", slabs, FeatureStack::kMostSlabs));
  if (stack.header.slabDepths.size() != slabs + 1)
    refuse(fmt::format("{} slabs have {} depths", slabs, stack.header.slabDepths.size()));
  for (const auto& slab : stack.slabs)
    requirePlanes("a slab of features", slab.size(), channels, stack.header.size);
}

}  // namespace

double attenuationRate(const ChannelOptics& optics) {
  const glm::dvec3& e = optics.emission;
  return optics.extinction > 0.0 ? optics.extinction : std::max({e.r, e.g, e.b});
}

const FeatureOrigin& featuresOf(const ProxyHeader& header) {
  if (!header.features)
    throw Error(ErrorCode::Format, fmt::format("the {} proxy of field '{}' has no classifier",
                                               header.kind, header.field));
  return *header.features;
}

ProxyImage featureProxy(ProxyHeader header, std::span<const float> attenuation,
                        std::span<const float> transmittance, std::span<const float> integral,
                        std::span<const float> moment) {
  header.kind = kind::kFeatures;
  const std::vector<std::string> names = neededFeatures(header).classifier->channels();
  const ImageSize size = header.size;
  const std::size_t pixels = size.pixels();
  requirePlanes("attenuation", attenuation.size(), names.size(), size);
  requirePlanes("transmittance", transmittance.size(), 1, size);
  requirePlanes("integral", integral.size(), names.size(), size);
  requirePlanes("moment", moment.size(), names.size(), size);

  const double diagonal = diagonalOf(header.domain);
  ProxyPart integralPart =
      emptyPart("integral", diagonal, 0.0, diagonal * kRelativeError, names, pixels);
  const StorageScale scale{diagonal, 0.0};
  fill(integralPart, [&](std::size_t c, std::size_t i) {
    return scale.memory(inNineBits(double(integral[c * pixels + i]) / diagonal));
  });

  const DepthRange range = depthRange(header.camera, header.domain);
  const double extent = std::max(range.high - range.low, diagonal / 1e6);
  const double step = extent / kDepthLevels;
  // One step before the nearest depth, so that a stored 0 can mean "nothing here".
  const double zero = range.low - step;
  const double floatError = std::max(std::abs(range.low), std::abs(range.high)) * 0x1p-24;
  const Quantiser depths(step, zero);
  const double momentUnit = lengthUnitFor(header.domain);
  ProxyPart depthPart =
      emptyPart("depth", depths.unit(), zero, 0.5 * step + floatError, names, pixels);
  fill(depthPart, [&](std::size_t c, std::size_t i) {
    if (!(integralPart.channels[c].values[i] > 0.0f)) return 0.0f;
    const std::size_t at = c * pixels + i;
    const double mean = double(moment[at]) / double(integral[at]) * momentUnit;
    return depths(std::clamp(mean, range.low, range.low + extent));
  });

  ProxyImage image{std::move(header), {}};
  image.parts.push_back(fractions("attenuation", names, attenuation, pixels));
  image.parts.push_back(fractions("transmittance", {"T"}, transmittance, pixels));
  image.parts.push_back(std::move(integralPart));
  image.parts.push_back(std::move(depthPart));
  return image;
}

FeatureImage featureImage(const ProxyImage& proxy) {
  const std::vector<std::string> names = featuresOf(proxy.header).classifier->channels();
  if (proxy.header.kind != kind::kFeatures)
    throw Error(ErrorCode::Format, fmt::format("the {} proxy of '{}' is not one of features",
                                               proxy.header.kind, proxy.header.field));
  return {proxy.header, planesOf(proxy, "attenuation", names),
          planesOf(proxy, "transmittance", {"T"}), planesOf(proxy, "integral", names),
          planesOf(proxy, "depth", names)};
}

float storedShare(double share) {
  static const Quantiser quantise(kFractionStep);
  return share > 0.0 ? quantise(std::min(share, 1.0)) : 0.0f;
}

void roundToStored(FeatureStack& stack) {
  validate(stack);
  const SlabChords chords(stack.header);
  const double least = chords.least();
  const std::size_t pixels = stack.header.size.pixels();
  for (std::size_t s = 0; s < stack.slabs.size(); ++s)
    for (std::size_t at = 0; at < stack.slabs[s].size(); ++at) {
      const double chord = chords.chord(int(s), at % pixels);
      float& value = stack.slabs[s][at];
      value = chord > least ? float(double(storedShare(double(value) / chord)) * chord) : 0.0f;
    }
}

std::vector<std::byte> encodeFeatureStack(const FeatureStack& stack) {
  validate(stack);
  ProxyHeader header = stack.header;
  header.kind = kind::kSlicedFeatures;
  const auto names = header.features->classifier->channels();
  const SlabChords chords(header);
  return encodeExr(
      header, int(stack.slabs.size()), [&](int s) { return slabPart(stack, chords, names, s); },
      kFeatureZipLevel);
}

FeatureStack readFeatureStack(const ExrFile& file) {
  const auto refuse = [&](const std::string& reason) {
    throw Error(ErrorCode::Format, fmt::format("'{}': {}", file.path().string(), reason));
  };
  FeatureStack stack{file.header(), {}};
  const ProxyHeader& header = stack.header;
  if (header.kind != kind::kSlicedFeatures)
    refuse(fmt::format("it is a {} proxy, not one of sliced features", header.kind));
  if (!header.features) refuse("it has no classifier");
  if (header.camera.projection != Projection::Orthographic)
    refuse("its camera is not orthographic, as slabs need it");
  const int slabs = int(header.slabDepths.size()) - 1;
  if (slabs < 1 || slabs > FeatureStack::kMostSlabs)
    refuse(fmt::format("it has {} slabs, not 1 to {}", slabs, FeatureStack::kMostSlabs));
  if (int(file.partNames().size()) != slabs)
    refuse(fmt::format("it has {} parts for {} slabs", file.partNames().size(), slabs));
  if (!std::is_sorted(header.slabDepths.begin(), header.slabDepths.end(), std::less_equal<>()))
    refuse("its slabs' depths do not rise");
  const auto names = header.features->classifier->channels();
  const SlabChords chords(header);
  const double least = chords.least();
  const std::size_t pixels = header.size.pixels(), width = std::size_t(header.size.width);
  for (int s = 0; s < slabs; ++s) {
    const ProxyPart part = file.part(slabName(s));
    if (!std::equal(part.channels.begin(), part.channels.end(), names.begin(), names.end(),
                    [](const Channel& c, const std::string& name) { return c.name == name; }))
      refuse(fmt::format("part '{}' has other channels than the classifier", part.name));
    std::vector<float>& slab = stack.slabs.emplace_back(names.size() * pixels);
    for (std::size_t c = 0; c < names.size(); ++c)
      for (std::size_t i = 0; i < pixels; ++i) {
        const float share = part.channels[c].values[i];
        const double chord = chords.chord(s, i);
        if (!(share >= 0.0f && share <= 1.0f) || (share > 0.0f && !(chord > least)))
          refuse(
              fmt::format("channel '{}' of part '{}' is {} at pixel ({}, {}); it must be a "
                          "share 0 .. 1, and 0 where the ray misses the slab",
                          names[c], part.name, share, i % width, i / width));
        slab[c * pixels + i] = float(double(share) * chord);
      }
  }
  return stack;
}

}  // namespace vestige
