// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/step/field_assembly.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "adaptor/common/adaptor_error.h"
#include "proxy/base/parallel.h"

namespace vestige {
namespace {

/// Coordinates that differ by less than this share of the domain are the same place.
constexpr double kTolerance = 1e-9;
/// An axis is even whose nodes are as far from even places as this share of the spacing.
constexpr double kEven = 1e-6;

constexpr std::array<char, 3> kAxisNames{'x', 'y', 'z'};

/// A block's own coordinates along an axis.
std::span<const double> ownNodes(const Block& block, const std::vector<double>& nodes,
                                 std::size_t axis) {
  const int below = block.grid.ghosts[2 * axis], above = block.grid.ghosts[2 * axis + 1];
  const int count = std::max(0, int(nodes.size()) - below - above);
  return std::span(nodes).subspan(std::size_t(below), std::size_t(count));
}

/// The nodes of all blocks, those at the same place once.
std::vector<double> unionOf(std::vector<double> nodes, double tolerance) {
  std::sort(nodes.begin(), nodes.end());
  std::vector<double> all;
  for (const double node : nodes) {
    if (all.empty() || node > all.back() + tolerance) all.push_back(node);
  }
  return all;
}

std::size_t placeOf(const std::vector<double>& all, double node, double tolerance) {
  return std::size_t(std::lower_bound(all.begin(), all.end(), node - tolerance) - all.begin());
}

FieldAxis axisOf(std::vector<double> nodes) {
  FieldAxis axis;
  axis.count = int(nodes.size());
  axis.first = nodes.front();
  if (nodes.size() == 1) return axis;
  axis.spacing = (nodes.back() - nodes.front()) / double(nodes.size() - 1);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const double even = axis.first + double(i) * axis.spacing;
    if (std::abs(nodes[i] - even) > kEven * axis.spacing) {
      axis.nodes = std::move(nodes);
      break;
    }
  }
  return axis;
}

}  // namespace

FieldSamples assembleField(const PlannedField& field, const BlockSet& blocks,
                           const FieldStatistics& statistics, int threads) {
  const double tolerance = kTolerance * blocks.domain().diagonal();
  std::array<std::vector<double>, 3> all;
  for (const auto& [index, block] : blocks.blocks()) {
    if (block.grid.empty()) continue;
    const auto nodes = block.nodes(field.location);
    for (std::size_t a = 0; a < 3; ++a) {
      const auto own = ownNodes(block, nodes[a], a);
      all[a].insert(all[a].end(), own.begin(), own.end());
    }
  }
  FieldSamples result;
  for (std::size_t a = 0; a < 3; ++a) {
    if (all[a].empty()) throw AdaptorError(VESTIGE_ERROR_GRID, "no block has samples of its own");
    all[a] = unionOf(std::move(all[a]), tolerance);
    result.axes[a] = axisOf(all[a]);
  }
  result.low = statistics.low;
  // A constant field, however large, gets a range as its intervals do.
  result.high = statistics.low < statistics.high
                    ? statistics.high
                    : IntervalPartition::uniform(statistics.low, statistics.low, 1).high();
  const std::size_t nx = all[0].size(), ny = all[1].size();
  result.values.assign(nx * ny * all[2].size(), std::numeric_limits<float>::quiet_NaN());

  for (const auto& [index, block] : blocks.blocks()) {
    if (block.grid.empty()) continue;
    const auto nodes = block.nodes(field.location);
    std::array<std::size_t, 3> first{};  // of the block's sample 0, ghosts included
    for (std::size_t a = 0; a < 3; ++a) {
      const auto own = ownNodes(block, nodes[a], a);
      if (own.empty()) continue;
      const std::size_t place = placeOf(all[a], own.front(), tolerance);
      for (std::size_t i = 0; i < own.size(); ++i) {
        if (place + i < all[a].size() && std::abs(all[a][place + i] - own[i]) <= tolerance)
          continue;
        throw AdaptorError(
            VESTIGE_ERROR_GRID,
            fmt::format("block {} has no samples at {} = {}, where others have: a field is stored "
                        "on one grid for all blocks",
                        index, kAxisNames[a], all[a][std::min(place + i, all[a].size() - 1)]));
      }
      first[a] = place - std::size_t(block.grid.ghosts[2 * a]);
    }
    const auto reader = readerOf(field, block);
    for (const SampleRange& range : blocks.ownSamples(index, field.location)) {
      parallelFor(range.high[2] - range.low[2], threads, [&](int layer) {
        const int z = range.low[2] + layer;
        std::vector<double> row(static_cast<std::size_t>(reader.size()[0]));
        for (int y = range.low[1]; y < range.high[1]; ++y) {
          reader.row(y, z, row.data());
          float* out = result.values.data() +
                       ((first[2] + std::size_t(z)) * ny + first[1] + std::size_t(y)) * nx;
          for (int x = range.low[0]; x < range.high[0]; ++x) {
            out[first[0] + std::size_t(x)] =
                float((row[std::size_t(x)] - result.low) / (result.high - result.low));
          }
        }
      });
    }
  }
  return result;
}

}  // namespace vestige
