// SPDX-License-Identifier: BSD-3-Clause
#include "synthetic.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <stdexcept>

#include "proxy/camera/view_set.h"

namespace vestige::synthetic {
namespace {

const Box kBox{glm::dvec3(-1.0), glm::dvec3(1.0)};

/// Half the chord of a ray at distance `off` from the middle in a sphere.
double halfChord(double radius, double off) {
  return radius > off ? std::sqrt(radius * radius - off * off) : 0.0;
}

struct RayPlace {
  double off;     ///< distance of the ray from the middle
  double middle;  ///< planar depth of the point nearest to the middle
};

RayPlace placeOf(const ProxyHeader& header, int x, int y) {
  const Ray ray = header.camera.rayThrough({x + 0.5, y + 0.5}, header.size);
  const double along = -glm::dot(ray.origin, ray.direction);
  return {glm::length(ray.origin + along * ray.direction), along};
}

bool insideBox(const ProxyHeader& header, int x, int y) {
  const Ray ray = header.camera.rayThrough({x + 0.5, y + 0.5}, header.size);
  return std::abs(ray.origin.x) <= 1.0 && std::abs(ray.origin.z) <= 1.0;
}

void addChannel(ProxyPart& part, const std::string& name, std::size_t pixels,
                ChannelStorage storage) {
  part.channels.push_back({name, storage, std::vector<float>(pixels, 0.0f)});
}

ProxyPart part(const std::string& name, const ProxyHeader& head) {
  ProxyPart result;
  result.name = name;
  for (int k = 0; k < head.partition->channels(); ++k) {
    addChannel(result, head.partition->channelName(k), head.size.pixels(), ChannelStorage::Half);
  }
  return result;
}

template <typename Work>
void forPixels(ImageSize size, const Work& work) {
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      work(x, y, std::size_t(y) * std::size_t(size.width) + std::size_t(x));
    }
  }
}

}  // namespace

ProxyHeader header(std::string_view kind, ImageSize size) {
  ProxyHeader head;
  head.kind = kind;
  head.field = "density";
  head.units = "kg/m3";
  head.view = "front";
  head.size = size;
  head.domain = kBox;
  head.camera = viewSet("front", kBox, size.aspect()).front().camera;
  head.partition = IntervalPartition::uniform(0.0, 1.0, kIntervals);
  head.base = TransferFunction({{0.0, 0.05}, {0.5, 0.1}, {1.0, 0.3}}, 0.1,
                               Colormap::named("viridis"), 0.0, 1.0);
  head.statistics = {1000, 0, -0.7320508, 1.0, 0.2, 0.3, {1, 2, 3, 4}};
  head.provenance = "tests/explorer";
  return head;
}

std::vector<Segment> trueSegments(const ProxyHeader& head, int x, int y) {
  std::vector<Segment> segments;
  if (!insideBox(head, x, y)) return segments;
  const RayPlace place = placeOf(head, x, y);
  const IntervalPartition& partition = *head.partition;
  // Half chords of the spheres f = b_0 (the widest), b_1 ...; the box's face lies at 1.
  std::vector<double> half{1.0};
  for (int k = 0; k <= partition.intervals(); ++k) {
    half.push_back(halfChord(1.0 - partition.bounds()[std::size_t(k)], place.off));
  }
  std::vector<int> channels{partition.below()};
  for (int k = 0; k < partition.intervals(); ++k) channels.push_back(k);
  std::vector<Segment> back;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const bool innermost = i + 1 == channels.size() || half[i + 1] == 0.0;
    const double length = half[i] - (innermost ? 0.0 : half[i + 1]);
    if (length < 1e-6) continue;  // the ray touches the box where the sphere does
    if (innermost) {
      segments.push_back({channels[i], float(2.0 * length), false});
      break;
    }
    segments.push_back({channels[i], float(length), false});
    back.push_back({channels[i], float(length), false});
  }
  segments.insert(segments.end(), back.rbegin(), back.rend());
  return segments;
}

ProxyImage lengthProxy(ImageSize size) {
  ProxyImage image{header(kind::kLength, size), {}};
  ProxyPart length = part("length", image.header), depth = part("depth", image.header),
            runs = part("runs", image.header), ends{"ends", 1.0, 0.0, 0.0, {}};
  for (const char* name : {"first", "last"}) {
    addChannel(ends, name, size.pixels(), ChannelStorage::Half);
  }
  length.unit = depth.unit = kBox.diagonal();
  forPixels(size, [&](int x, int y, std::size_t i) {
    const auto segments = trueSegments(image.header, x, y);
    if (!segments.empty()) {
      ends.channels[0].values[i] = float(segments.front().channel + 1);
      ends.channels[1].values[i] = float(segments.back().channel + 1);
    }
    for (const Segment& segment : segments) {
      const auto k = std::size_t(segment.channel);
      length.channels[k].values[i] += segment.amount;
      depth.channels[k].values[i] = float(placeOf(image.header, x, y).middle);
      runs.channels[k].values[i] += 1.0f;
    }
  });
  image.parts = {std::move(length), std::move(depth), std::move(runs), std::move(ends)};
  return image;
}

ProxyImage attenuationProxy(ImageSize size) {
  ProxyImage image{header(kind::kAttenuation, size), {}};
  ProxyPart attenuation = part("attenuation", image.header);
  addChannel(attenuation, "T", size.pixels(), ChannelStorage::Half);
  attenuation.error = 0x1p-12;  // half rounding below 1
  const IntervalLook look = image.header.base->onIntervals(*image.header.partition);
  forPixels(size, [&](int x, int y, std::size_t i) {
    double left = 1.0;
    for (const Segment& segment : trueSegments(image.header, x, y)) {
      const auto k = std::size_t(segment.channel);
      const double share = left * -std::expm1(-look.extinction[k] * double(segment.amount));
      attenuation.channels[k].values[i] += float(share);
      left -= share;
    }
    attenuation.channels.back().values[i] = float(left);
  });
  image.parts = {std::move(attenuation)};
  return image;
}

ProxyImage depthProxy(ImageSize size, std::vector<double> isovalues) {
  ProxyImage image{header(kind::kDepth, size), {}};
  image.header.partition.reset();
  image.header.isovalues = isovalues;
  for (std::size_t m = 0; m < isovalues.size(); ++m) {
    ProxyPart layer;
    layer.name = m < 10 ? "layer0" + std::to_string(m) : "layer" + std::to_string(m);
    addChannel(layer, "Z", size.pixels(), ChannelStorage::Float);
    for (const char* name : {"nx", "ny", "nz"}) {
      addChannel(layer, name, size.pixels(), ChannelStorage::Half);
    }
    const double radius = 1.0 - isovalues[m];
    const glm::dmat4 eyeFromWorld = image.header.camera.eyeFromWorld();
    forPixels(size, [&](int x, int y, std::size_t i) {
      const RayPlace place = placeOf(image.header, x, y);
      float& z = layer.channels[0].values[i];
      z = std::numeric_limits<float>::infinity();
      if (place.off >= radius || !insideBox(image.header, x, y)) return;
      const double depth = place.middle - halfChord(radius, place.off);
      z = float(depth);
      const glm::dvec3 world = image.header.camera.unproject({x + 0.5, y + 0.5, depth}, size);
      const glm::dvec3 normal(eyeFromWorld * glm::dvec4(glm::normalize(world), 0.0));
      for (int c = 0; c < 3; ++c) layer.channels[std::size_t(c + 1)].values[i] = float(normal[c]);
    });
    image.parts.push_back(std::move(layer));
  }
  return image;
}

ProxyImage mipProxy(ImageSize size) {
  ProxyImage image{header(kind::kMip, size), {}};
  ProxyPart mip;
  mip.name = "mip";
  addChannel(mip, "value", size.pixels(), ChannelStorage::Float);
  forPixels(size, [&](int x, int y, std::size_t i) {
    mip.channels[0].values[i] = insideBox(image.header, x, y)
                                    ? float(1.0 - placeOf(image.header, x, y).off)
                                    : std::numeric_limits<float>::quiet_NaN();
  });
  image.parts = {std::move(mip)};
  return image;
}

ProxyImage referenceProxy(ImageSize size) {
  ProxyImage image{header(kind::kReference, size), {}};
  ProxyPart part;
  part.name = "reference";
  for (const char* name : {"R", "G", "B", "A"}) {
    addChannel(part, name, size.pixels(), ChannelStorage::Half);
  }
  const ChannelTable table =
      tableForLength(image.header.base->onIntervals(*image.header.partition));
  forPixels(size, [&](int x, int y, std::size_t i) {
    const auto color = composite(trueSegments(image.header, x, y), table);
    for (std::size_t c = 0; c < 4; ++c) part.channels[c].values[i] = float(color[c]);
  });
  image.parts = {std::move(part)};
  return image;
}

std::array<double, 4> composite(const std::vector<Segment>& segments, const ChannelTable& table) {
  std::array<double, 4> color{};
  double left = 1.0, depth = 0.0;
  glm::dvec3 glow(0.0);
  for (const Segment& segment : segments) {
    const auto k = std::size_t(segment.channel);
    depth += table.strength[k] * double(segment.amount);
    glow += table.strength[k] * double(segment.amount) * table.color[k];
    if (segment.mixed) continue;
    if (depth > 0.0) {
      const double share = left * -std::expm1(-depth);
      for (int c = 0; c < 3; ++c) color[std::size_t(c)] += share * glow[c] / depth;
      left -= share;
    }
    depth = 0.0;
    glow = glm::dvec3(0.0);
  }
  color[3] = 1.0 - left;
  return color;
}

IntervalLook someLook(const IntervalPartition& partition) {
  IntervalLook look;
  for (int k = 0; k < partition.channels(); ++k) {
    const bool data = k < partition.intervals();
    look.extinction.push_back(data ? 0.4 + 2.0 * ((k * 3) % 5) : 0.0);
    look.color.push_back({0.2 * (k % 5), 1.0 - 0.15 * (k % 6), 0.3 + 0.1 * (k % 4)});
  }
  return look;
}

void writeArchive(const std::filesystem::path& directory, ImageSize size, int cycles) {
  ArchiveWriter writer(directory, ExistingArchive::Refuse);
  const Raster preview{size, std::vector<std::uint8_t>(4 * size.pixels(), 255)};
  for (int step = 0; step < cycles; ++step) {
    std::vector<ProxyImage> images{lengthProxy(size), attenuationProxy(size),
                                   depthProxy(size, {0.3, 0.5, 0.7}), mipProxy(size),
                                   referenceProxy(size)};
    std::vector<EncodedProxy> proxies;
    for (ProxyImage& image : images) {
      image.header.cycle = 10 * step;
      image.header.time = 0.5 * step;
      proxies.push_back(encodeProxy(image, &preview));
    }
    writer.writeStep(proxies);
  }
}

TemporaryFolder::TemporaryFolder() {
  std::string pattern = (std::filesystem::temp_directory_path() / "vestige-XXXXXX").string();
  if (!mkdtemp(pattern.data())) throw std::runtime_error("no temporary folder");
  path_ = pattern;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace vestige::synthetic
