// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/recomposition/decode.h"

#include <fmt/format.h>

#include <array>
#include <future>

#include "proxy/base/error.h"
#include "proxy/format/layout/proxy_check.h"

namespace vestige {
namespace {

void requireHeader(const ProxyHeader& header, std::string_view kind, bool partition) {
  if (header.kind != kind) {
    throw Error(ErrorCode::Format, "a proxy of kind '" + header.kind + "' was given where '" +
                                       std::string(kind) + "' is needed");
  }
  if (partition && !header.partition) {
    throw Error(ErrorCode::Format,
                "the " + header.kind + " proxy of '" + header.field + "' has no interval bounds");
  }
}

ProxyPart takePart(ProxyImage& image, std::string_view name) {
  for (ProxyPart& part : image.parts) {
    if (part.name == name) return std::move(part);
  }
  throw Error(ErrorCode::NotFound,
              "the " + image.header.kind + " proxy has no part '" + std::string(name) + "'");
}

/// The part, unless a value is out of its range.
ProxyPart inRange(const ProxyHeader& header, ProxyPart part) {
  const auto problems = outOfRange(header, part);
  if (!problems.empty()) throw Error(ErrorCode::Format, problems.front());
  return part;
}

/// The channels of a part in the partition's order; those that are absent are empty planes.
std::vector<Plane> planesOf(ProxyPart part, const ProxyHeader& header) {
  const IntervalPartition& partition = *header.partition;
  std::vector<Plane> planes(std::size_t(partition.channels()));
  for (Channel& channel : part.channels) {
    if (channel.values.size() != header.size.pixels()) {
      throw Error(ErrorCode::Format, "channel '" + channel.name + "' of part '" + part.name +
                                         "' has " + std::to_string(channel.values.size()) +
                                         " values, the picture " +
                                         std::to_string(header.size.pixels()) + " pixels");
    }
    for (int k = 0; k < partition.channels(); ++k) {
      if (channel.name == partition.channelName(k)) {
        planes[std::size_t(k)] = std::move(channel.values);
        break;
      }
    }
  }
  return planes;
}

/// The ends of rays, which archives may lack.
void takeEnds(LengthPlanes& planes, ProxyPart part) {
  for (Channel& channel : part.channels) {
    if (channel.values.size() != planes.header.size.pixels()) {
      throw Error(ErrorCode::Format,
                  "channel '" + channel.name + "' of part 'ends' does not have the picture's size");
    }
    if (channel.name == "first") planes.first = std::move(channel.values);
    if (channel.name == "last") planes.last = std::move(channel.values);
  }
}

Error namingFile(const Error& error, const ExrFile& file) {
  const std::string name = file.path().string(), text = error.what();
  return {error.code(), text.find(name) != text.npos ? text : "'" + name + "': " + text};
}

/// Archives store lengths as subnormal halves (docs/archive-format.md, "Values"), which a GPU may
/// flush to zero; 2^12 times as large they are normal halves, and exactly the same numbers.
double normalHalfUnit(double unit) { return unit * 0x1p-12; }

}  // namespace

LengthPlanes lengthPlanes(ProxyImage image) {
  requireHeader(image.header, kind::kLength, true);
  LengthPlanes planes;
  planes.header = image.header;
  ProxyPart length = takePart(image, "length");
  planes.unit = normalHalfUnit(length.unit);
  planes.length = planesOf(std::move(length), planes.header);
  planes.depth = planesOf(takePart(image, "depth"), planes.header);
  planes.runs = planesOf(takePart(image, "runs"), planes.header);
  if (image.find("ends")) takeEnds(planes, takePart(image, "ends"));
  return planes;
}

LengthPlanes readLengthPlanes(const ExrFile& file) try {
  LengthPlanes planes;
  planes.header = file.header();
  requireHeader(planes.header, kind::kLength, true);
  // A file handle serves one reader; the second part gets a handle of its own.
  auto depth = std::async(std::launch::async, [&] {
    return planesOf(inRange(planes.header, ExrFile(file.path(), file.lengthUnit()).part("depth")),
                    planes.header);
  });
  ProxyPart length = inRange(planes.header, file.part("length"));
  planes.unit = normalHalfUnit(length.unit);
  planes.length = planesOf(std::move(length), planes.header);
  planes.runs = planesOf(inRange(planes.header, file.part("runs")), planes.header);
  if (file.has("ends")) takeEnds(planes, inRange(planes.header, file.part("ends")));
  planes.depth = depth.get();
  return planes;
} catch (const Error& error) {
  throw namingFile(error, file);
}

ProxyImage readImage(const ExrFile& file) try {
  ProxyImage image = file.image();
  for (ProxyPart& part : image.parts) part = inRange(image.header, std::move(part));
  return image;
} catch (const Error& error) {
  throw namingFile(error, file);
}

AttenuationPlanes attenuationPlanes(ProxyImage image) {
  requireHeader(image.header, kind::kAttenuation, true);
  AttenuationPlanes planes;
  planes.header = image.header;
  planes.attenuation = planesOf(takePart(image, "attenuation"), planes.header);
  return planes;
}

DepthLayers depthLayers(ProxyImage image) {
  requireHeader(image.header, kind::kDepth, false);
  DepthLayers layers;
  layers.header = image.header;
  const std::size_t pixels = image.header.size.pixels();
  for (std::size_t m = 0; m < image.header.isovalues.size(); ++m) {
    const std::string name = fmt::format("layer{:02}", m);
    const ProxyPart part = takePart(image, name);
    const auto plane = [&](const char* channel) -> const Plane* {
      const Channel* found = part.find(channel);
      if (found && found->values.size() != pixels) {
        throw Error(ErrorCode::Format,
                    fmt::format("channel '{}' of part '{}' does not have the picture's size",
                                channel, name));
      }
      return found ? &found->values : nullptr;
    };
    const Plane* depth = plane("Z");
    if (!depth) {
      throw Error(ErrorCode::NotFound, "depth part '" + name + "' has no channel 'Z'");
    }
    layers.depth.push_back(*depth);
    const std::array<const Plane*, 3> axes{plane("nx"), plane("ny"), plane("nz")};
    Plane normal;
    if (axes[0] && axes[1] && axes[2]) {
      normal.resize(3 * pixels);
      for (std::size_t i = 0; i < pixels; ++i) {
        for (std::size_t c = 0; c < 3; ++c) normal[3 * i + c] = (*axes[c])[i];
      }
    }
    layers.normal.push_back(std::move(normal));
  }
  return layers;
}

}  // namespace vestige
