// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/export/export_meanings.h"

#include <fmt/format.h>

#include <cstdlib>

namespace vestige {
namespace {

int numberIn(const std::string& name) {
  const std::size_t digits = name.find_first_of("0123456789");
  return digits == name.npos ? 0 : std::atoi(name.c_str() + digits);
}

/// The channel of the partition that has a name, or -1.
int channelOf(const ProxyHeader& header, const std::string& name) {
  if (!header.partition) return -1;
  for (int k = 0; k < header.partition->channels(); ++k)
    if (header.partition->channelName(k) == name) return k;
  return -1;
}

ExportChannel ofDepthLayer(const ProxyHeader& header, const std::string& part,
                           const std::string& name) {
  if (name != "Z")
    return {name,
            "unit normal in eye space: x right, y up, z toward the viewer; 0 = none",
            kNumber,
            {},
            {}};
  const auto layer = std::size_t(numberIn(part));
  return {name,
          layer < header.isovalues.size()
              ? fmt::format("planar depth of the first crossing of {}; NaN = there is none",
                            header.isovalues[layer])
              : "planar depth; NaN = there is none",
          kWorldLength,
          {},
          {}};
}

ExportChannel ofLight(const std::string& name) {
  return {name, name == "A" ? "opacity" : "linear light, premultiplied", kNumber, {}, {}};
}

ExportChannel ofLayered(const std::string& part, const std::string& name) {
  if (part == "tau")
    return {name,
            fmt::format("optical depth of layer {} along the ray", numberIn(name)),
            kNumber,
            {},
            {}};
  if (part == "boundaries")
    return {name,
            fmt::format("planar depth of the near face of layer {}, or of the far face of the one "
                        "before; NaN = the pixel is empty",
                        numberIn(name)),
            kWorldLength,
            {},
            {}};
  if (part == "state")
    return {name,
            "0 = empty, 1 = all of the ray's opacity is in its layers, 2 = what is behind the last "
            "one is not stored",
            kNumber,
            {},
            {}};
  return {name, "linear light of the layer alone, premultiplied", kNumber, {}, {}};
}

/// How a part speaks of its channels, and in what.
struct Phrase {
  std::string meaning;
  const char* units;
};
Phrase phraseOf(const std::string& part) {
  if (part == "attenuation") return {"fraction of light taken by", kNumber};
  if (part == "length") return {"length of the ray with", kWorldLength};
  if (part == "depth") return {"mean planar depth (NaN = the ray has none) of", kWorldLength};
  if (part == "runs") return {"number of separate runs of", kNumber};
  return {"integral along the ray of the weight of", kWorldLength};
}

}  // namespace

ExportChannel intervalChannel(const IntervalPartition& partition, int channel,
                              const std::string& meaning, const char* units) {
  ExportChannel exported{partition.channelName(channel), meaning, units, {}, {}};
  if (channel == partition.noData()) {
    exported.meaning += " no data";
  } else if (channel == partition.below()) {
    exported.high = partition.low();
    exported.meaning += fmt::format(" values below {}", partition.low());
  } else if (channel == partition.above()) {
    exported.low = partition.high();
    exported.meaning += fmt::format(" values above {}", partition.high());
  } else {
    exported.low = partition.bounds()[std::size_t(channel)];
    exported.high = partition.bounds()[std::size_t(channel) + 1];
    exported.meaning += fmt::format(" values from {} to {}", *exported.low, *exported.high);
  }
  return exported;
}

ExportChannel exportChannel(const ProxyHeader& header, const std::string& part,
                            const std::string& name) {
  if (name.starts_with("distortion_"))
    return {name,
            "distortion of the depth: how far from its place in an undistorted picture",
            kWorldLength,
            {},
            {}};
  if (header.kind == kind::kDepth) return ofDepthLayer(header, part, name);
  if (header.kind == kind::kMip)
    return {name, "largest value along the ray; NaN = no data", header.units, {}, {}};
  if (header.kind == kind::kReference || header.kind == kind::kTraining) return ofLight(name);
  if (header.kind == kind::kLayered) return ofLayered(part, name);
  if (name == "T") return {name, "fraction of light that is left", kNumber, {}, {}};
  if (part == "ends")
    return {name,
            fmt::format("channel, counted from 0, in which the ray {} the domain; -1 = it misses",
                        name == "first" ? "enters" : "leaves"),
            kNumber,
            {},
            {}};
  const Phrase phrase = phraseOf(part);
  const int channel = channelOf(header, name);
  if (channel < 0) return {name, phrase.meaning + " feature " + name, phrase.units, {}, {}};
  return intervalChannel(*header.partition, channel, phrase.meaning, phrase.units);
}

}  // namespace vestige
