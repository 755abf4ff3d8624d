// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/format/layout/learned_layout.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "proxy/base/error.h"
#include "proxy/format/layout/proxy_layout.h"

namespace vestige {
namespace {

/// A row of the picture: centroid, three rows of the Jacobian, colour.
std::size_t rowLength(int channels) { return 4 * std::size_t(channels) + 3; }

[[noreturn]] void refuse(const std::string& reason) {
  throw Error(ErrorCode::Format, "the table of learned colours " + reason);
}

/// What is wrong with the header of a table; empty = nothing.
std::string problemOf(const ProxyHeader& header) {
  if (!header.partition) return "has no interval bounds";
  if (!header.learned) return "does not say how it was made";
  if (header.looks.empty()) return "does not say of which looks its training pictures were";
  return {};
}

}  // namespace

nlohmann::json toJson(const LearnedOrigin& origin) {
  return {{"error", origin.error},
          {"from", origin.from},
          {"size", {origin.size.width, origin.size.height}}};
}

LearnedOrigin learnedOriginFromJson(const nlohmann::json& json) try {
  constexpr int kLargest = 1 << 16;
  LearnedOrigin origin{json.at("from").get<std::string>(), {}, json.at("error").get<double>()};
  const auto size = json.at("size").get<std::vector<double>>();
  if (size.size() != 2) refuse("has a size of " + std::to_string(size.size()) + " numbers");
  for (const double side : size) {
    if (!(side >= 1.0 && side <= kLargest) || side != std::floor(side))
      refuse(fmt::format("was fitted to pictures of {} pixels a side", side));
  }
  origin.size = {int(size[0]), int(size[1])};
  if (origin.from != kind::kLength && origin.from != kind::kAttenuation &&
      origin.from != kind::kSliced)
    refuse("was made from '" + origin.from + "', not length, attenuation or sliced");
  if (!std::isfinite(origin.error) || origin.error < 0.0)
    refuse(fmt::format("has an error of {}", origin.error));
  return origin;
} catch (const nlohmann::json::exception& e) {
  refuse(std::string("has an attribute 'vestige:learned' that makes no sense: ") + e.what());
}

ProxyImage trainingImage(ProxyHeader header, std::span<const LightPlanes> pictures) {
  if (pictures.empty() || pictures.size() > std::size_t(kMostTrainingPictures) ||
      pictures.size() != header.looks.size())
    throw Error(
        ErrorCode::InvalidArgument,
        fmt::format("field '{}' has {} training pictures of {} looks; 1 to {} are stored",
                    header.field, pictures.size(), header.looks.size(), kMostTrainingPictures));
  ProxyImage image;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    ProxyImage one = referenceImage(header, pictures[i].rgb, pictures[i].transmittance);
    one.parts[0].name = fmt::format("picture{:02d}", i);
    image.parts.push_back(std::move(one.parts[0]));
  }
  image.header = std::move(header);
  image.header.kind = kind::kTraining;
  return image;
}

ProxyImage learnedImage(ProxyHeader header, const LearnedTable& table) {
  header.kind = kind::kLearned;
  const auto channels = std::size_t(table.channels), clusters = std::size_t(table.clusters);
  if (const std::string problem = problemOf(header); !problem.empty())
    throw Error(ErrorCode::InvalidArgument, "the table of learned colours " + problem);
  if (table.channels != header.partition->channels() || table.clusters < 1 ||
      table.clusters > kMostClusters || table.centroid.size() != clusters * channels ||
      table.jacobian.size() != 3 * clusters * channels || table.color.size() != 3 * clusters)
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("a table of learned colours has {} clusters of {} channels; field '{}' "
                            "needs 1 to {} of {}",
                            table.clusters, table.channels, header.field, kMostClusters,
                            header.partition->channels()));
  const std::size_t width = rowLength(table.channels);
  header.size = {int(width), table.clusters};
  Channel channel{"value", ChannelStorage::Float, {}};
  channel.values.reserve(width * clusters);
  const auto append = [&](const std::vector<float>& values, std::size_t row, std::size_t count) {
    const auto first = values.begin() + std::ptrdiff_t(row * count);
    channel.values.insert(channel.values.end(), first, first + std::ptrdiff_t(count));
  };
  for (std::size_t k = 0; k < clusters; ++k) {
    append(table.centroid, k, channels);
    append(table.jacobian, k, 3 * channels);
    append(table.color, k, 3);
  }
  for (const float value : channel.values)
    if (!(std::abs(value) <= 1e6f))
      throw Error(ErrorCode::InvalidArgument,
                  fmt::format("a table of learned colours holds {}", value));
  return {std::move(header), {{"table", 1.0, 0.0, 0.0, {std::move(channel)}}}};
}

LearnedTable learnedTable(const ProxyImage& image) {
  const ProxyHeader& header = image.header;
  if (const std::string problem = problemOf(header); !problem.empty()) refuse(problem);
  LearnedTable table{header.partition->channels(), header.size.height, {}, {}, {}};
  if (std::size_t(header.size.width) != rowLength(table.channels) || table.clusters > kMostClusters)
    refuse(fmt::format("is {} x {}; {} channels need {} x at most {}", header.size.width,
                       header.size.height, table.channels, rowLength(table.channels),
                       kMostClusters));
  const ProxyPart* part = image.find("table");
  const Channel* channel = part ? part->find("value") : nullptr;
  if (!channel || channel->values.size() != header.size.pixels()) refuse("has no values");
  const auto channels = std::ptrdiff_t(table.channels);
  for (auto at = channel->values.begin(); at != channel->values.end();) {
    const auto take = [&](std::vector<float>& to, std::ptrdiff_t count) {
      to.insert(to.end(), at, at + count);
      at += count;
    };
    take(table.centroid, channels);
    take(table.jacobian, 3 * channels);
    take(table.color, 3);
  }
  return table;
}

}  // namespace vestige
