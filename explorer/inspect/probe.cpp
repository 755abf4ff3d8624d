// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/inspect/probe.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "proxy/base/error.h"

namespace vestige {
namespace {

ProbeShare shareOf(const IntervalPartition& partition, int rank, double length) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const int channel = partition.channelAt(rank);
  const auto bounds = partition.bounds();
  const double low = rank == 0 ? -kInfinity : bounds[std::size_t(rank) - 1];
  const double high = channel == partition.above() ? kInfinity : bounds[std::size_t(rank)];
  return {partition.channelName(channel), low, high, length};
}

}  // namespace

std::vector<ProbeCell> probe(const SlicedStack& stack, int x, int y, std::optional<double> depth) {
  const ProxyHeader& header = stack.header;
  if (x < 0 || y < 0 || x >= header.size.width || y >= header.size.height)
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("pixel {},{} is outside of the stack's {} x {}", x, y,
                            header.size.width, header.size.height));
  const auto& depths = header.slabDepths;
  if (depth && !(*depth >= depths.front() && *depth <= depths.back()))
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("depth {} is outside of the slabs' {:.6g} .. {:.6g}", *depth,
                            depths.front(), depths.back()));
  const std::size_t pixel = std::size_t(y) * std::size_t(header.size.width) + std::size_t(x);
  const SlabChords chords(header);
  std::vector<ProbeCell> cells;
  for (std::size_t s = 0; s < stack.slabs.size(); ++s) {
    const bool last = s + 1 == stack.slabs.size();
    if (depth && (*depth < depths[s] || (*depth >= depths[s + 1] && !last))) continue;
    const StackCell& cell = stack.slabs[s].cells[pixel];
    const double perLevel = chords.chord(int(s), pixel) / stack.levels;
    if (cell.count == 0 && cell.noData == 0) continue;
    ProbeCell& found =
        cells.emplace_back(ProbeCell{int(s), depths[s], depths[s + 1], {}, cell.noData * perLevel});
    const auto levels = stack.slabs[s].levelsOf(cell);
    for (std::size_t i = 0; i < levels.size(); ++i)
      if (levels[i] > 0)
        found.shares.push_back(
            shareOf(*header.partition, cell.lowest + int(i), levels[i] * perLevel));
  }
  return cells;
}

nlohmann::json toJson(const std::vector<ProbeCell>& cells) {
  nlohmann::json list = nlohmann::json::array();
  for (const ProbeCell& cell : cells) {
    nlohmann::json shares = nlohmann::json::array();
    for (const ProbeShare& share : cell.shares) {
      // JSON has no infinity: an open end is null.
      const auto bound = [](double value) {
        return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json();
      };
      shares.push_back({{"channel", share.channel},
                        {"low", bound(share.low)},
                        {"high", bound(share.high)},
                        {"length", share.length}});
    }
    list.push_back({{"slab", cell.slab},
                    {"near", cell.nearDepth},
                    {"far", cell.farDepth},
                    {"noData", cell.noData},
                    {"shares", std::move(shares)}});
  }
  return list;
}

int digitsOf(double low, double high) {
  const double most = std::max(std::abs(low), std::abs(high)), width = high - low;
  if (!(width > 0.0) || !std::isfinite(width)) return 6;
  return int(std::clamp(std::ceil(std::log10(most / width)) + 4.0, 6.0, 17.0));
}

std::string probeText(const std::vector<ProbeCell>& cells) {
  if (cells.empty()) return "the ray meets nothing there\n";
  double least = HUGE_VAL, most = -HUGE_VAL;
  for (const ProbeCell& cell : cells)
    for (const ProbeShare& share : cell.shares)
      for (const double bound : {share.low, share.high}) {
        if (!std::isfinite(bound)) continue;
        least = std::min(least, bound);
        most = std::max(most, bound);
      }
  const int digits = digitsOf(least, most), wide = std::max(12, digits + 6);
  std::string text = fmt::format("{:>4} {:>12} {:>12}  {:<7} {:>{}} {:>{}} {:>12}\n", "slab",
                                 "near", "far", "channel", "from", wide, "to", wide, "length");
  for (const ProbeCell& cell : cells) {
    const auto line = [&](const std::string& channel, double low, double high, double length) {
      text += fmt::format("{:>4} {:>12.6g} {:>12.6g}  {:<7} {:>{}.{}g} {:>{}.{}g} {:>12.6g}\n",
                          cell.slab, cell.nearDepth, cell.farDepth, channel, low, wide, digits,
                          high, wide, digits, length);
    };
    for (const ProbeShare& share : cell.shares)
      line(share.channel, share.low, share.high, share.length);
    const double none = std::numeric_limits<double>::quiet_NaN();
    if (cell.noData > 0.0) line("nodata", none, none, cell.noData);
  }
  return text;
}

}  // namespace vestige
