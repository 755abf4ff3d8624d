// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/compositing/slab_rays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "proxy/base/error.h"
#include "proxy/format/image/length_unit.h"

namespace vestige {
namespace {

constexpr std::size_t kMostRanks = IntervalPartition::kMaxIntervals + 3;

[[noreturn]] void refuse(const std::string& reason) {
  throw Error(ErrorCode::InvalidArgument, "a sliced stack: " + reason);
}

/// The moment that two parts of a slab have in common over the outermost rank of both.
float jointMoment(std::uint8_t outermost, std::uint8_t a, float momentA, std::uint8_t b,
                  float momentB) {
  return (a == outermost ? momentA : 0.0f) + (b == outermost ? momentB : 0.0f);
}

SlabCell joined(const SlabRays& front, const SlabCell& a, const SlabRays& back, const SlabCell& b,
                std::vector<float>& lengths) {
  SlabCell cell;
  cell.begin = std::uint32_t(lengths.size());
  cell.first = a.first != SlabCell::kNone ? a.first : b.first;
  cell.last = b.last != SlabCell::kNone ? b.last : a.last;
  cell.noData = a.noData + b.noData;
  if (a.lowest == SlabCell::kNone && b.lowest == SlabCell::kNone) return cell;
  const bool both = a.lowest != SlabCell::kNone && b.lowest != SlabCell::kNone;
  const SlabCell& some = a.lowest != SlabCell::kNone ? a : b;
  cell.lowest = both ? std::min(a.lowest, b.lowest) : some.lowest;
  cell.highest = both ? std::max(a.highest, b.highest) : some.highest;
  cell.lowMoment = jointMoment(cell.lowest, a.lowest, a.lowMoment, b.lowest, b.lowMoment);
  cell.highMoment = jointMoment(cell.highest, a.highest, a.highMoment, b.highest, b.highMoment);
  lengths.resize(lengths.size() + std::size_t(cell.highest - cell.lowest) + 1);
  for (const auto& [rays, part] : {std::pair{&front, &a}, std::pair{&back, &b}}) {
    const auto from = rays->lengthsOf(*part);
    for (std::size_t i = 0; i < from.size(); ++i)
      lengths[cell.begin + std::size_t(part->lowest - cell.lowest) + i] += from[i];
  }
  return cell;
}

/// Shares of `total`, as whole levels that add up to `levels`: rounded down, then those with the
/// largest remainders up. Stable: of equal ones, the first.
void roundToLevels(std::span<const double> lengths, double total, int levels,
                   std::span<std::uint8_t> rounded) {
  std::array<double, kMostRanks> rest{};
  int sum = 0;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const double share = std::min(lengths[i] / total * levels, double(levels));
    rounded[i] = std::uint8_t(share);
    rest[i] = share - rounded[i];
    sum += rounded[i];
  }
  for (; sum < levels; ++sum) {
    const auto most = std::max_element(rest.begin(), rest.begin() + std::ptrdiff_t(lengths.size()));
    ++rounded[std::size_t(most - rest.begin())];
    *most -= 1.0;
  }
}

}  // namespace

void compositeSlabs(SlabRays& front, const SlabRays& back) {
  if (front.cells.size() != back.cells.size())
    refuse(std::to_string(front.cells.size()) + " rays meet " + std::to_string(back.cells.size()));
  SlabRays all;
  all.cells.reserve(front.cells.size());
  all.lengths.reserve(front.lengths.size() + back.lengths.size());
  for (std::size_t i = 0; i < front.cells.size(); ++i)
    all.cells.push_back(joined(front, front.cells[i], back, back.cells[i], all.lengths));
  front = std::move(all);
}

StackBuilder::StackBuilder(ProxyHeader header, int levels) {
  stack_.header = std::move(header);
  stack_.levels = levels;
  const ProxyHeader& h = stack_.header;
  if (h.camera.projection != Projection::Orthographic)
    refuse("view '" + h.view + "' is perspective; slabs need an orthographic one");
  const int slabs = int(h.slabDepths.size()) - 1;
  if (slabs < 1 || slabs > SlicedStack::kMostSlabs)
    refuse(std::to_string(slabs) + " slabs, not 1 to " + std::to_string(SlicedStack::kMostSlabs));
  if (!SlicedStack::allowsLevels(levels))
    refuse(std::to_string(levels) + " levels, not 16, 32, 64 or 128");
  if (!h.partition) refuse("field '" + h.field + "' has no intervals");
  chords_.emplace(h);
  stack_.faces.assign(std::size_t(slabs) + 1,
                      std::vector<std::uint8_t>(h.size.pixels(), SlicedStack::kOutside));
}

void StackBuilder::add(const SlabRays& rays) {
  const ProxyHeader& header = stack_.header;
  const std::size_t number = stack_.slabs.size(), pixels = header.size.pixels();
  if (number + 1 >= header.slabDepths.size())
    refuse("more slabs than the " + std::to_string(number) + " that it has");
  if (rays.cells.size() != pixels)
    refuse("a slab of " + std::to_string(rays.cells.size()) + " rays for " +
           std::to_string(pixels) + " pixels");
  const SlabChords& chords = *chords_;
  const double least = chords.least(), from = header.slabDepths[number];
  const double momentUnit = lengthUnitFor(header.domain);
  const double perDepth = SlicedStack::kTurns / (header.slabDepths[number + 1] - from);
  const int noDataRank = header.partition->channels() - 1;
  auto &enters = stack_.faces[number], &leaves = stack_.faces[number + 1];

  StackSlab slab;
  slab.cells.resize(pixels);
  slab.levels.reserve(rays.lengths.size());
  std::array<double, kMostRanks> lengths{};
  std::array<std::uint8_t, kMostRanks> rounded{};
  for (std::size_t i = 0; i < pixels; ++i) {
    const SlabCell& was = rays.cells[i];
    StackCell& cell = slab.cells[i];
    cell.begin = std::uint32_t(slab.levels.size());
    const double chord = chords.chord(int(number), i);
    if (!(chord > least)) continue;
    // The last one is without data.
    const auto known = rays.lengthsOf(was);
    std::copy(known.begin(), known.end(), lengths.begin());
    const std::size_t count = known.size();
    double total = 0.0;
    for (std::size_t k = 0; k < count; ++k) total += lengths[k];
    const double uncovered = chord - total - double(was.noData);
    lengths[count] = double(was.noData) + (uncovered > 1e-3 * chord ? uncovered : 0.0);
    total += lengths[count];
    roundToLevels({lengths.data(), count + 1}, total, stack_.levels, {rounded.data(), count + 1});
    cell.noData = rounded[count];

    if (enters[i] == SlicedStack::kOutside)
      enters[i] = was.first != SlabCell::kNone ? was.first : std::uint8_t(noDataRank);
    leaves[i] = was.last != SlabCell::kNone ? was.last : std::uint8_t(noDataRank);
    std::size_t first = 0, end = count;
    while (first < end && rounded[first] == 0) ++first;
    while (end > first && rounded[end - 1] == 0) --end;
    if (first == end) continue;
    cell.lowest = std::uint8_t(was.lowest + first);
    cell.count = std::uint8_t(end - first);
    slab.levels.insert(slab.levels.end(), rounded.begin() + std::ptrdiff_t(first),
                       rounded.begin() + std::ptrdiff_t(end));

    // The ray turns at an outermost rank that it does not leave through a face.
    const int highest = cell.lowest + cell.count - 1;
    const auto belowNoData = [&](int rank) { return rank == noDataRank ? -1 : rank; };
    const bool low = cell.lowest < std::min(enters[i], leaves[i]);
    const bool high = highest > std::max(belowNoData(enters[i]), belowNoData(leaves[i]));
    const auto turn = [&](bool turns, float moment, double length) {
      if (!turns) return 0;
      return 1 + std::clamp(int((double(moment) / length * momentUnit - from) * perDepth), 0,
                            SlicedStack::kTurns - 1);
    };
    cell.setTurns(turn(low, was.lowMoment, lengths[0]),
                  turn(high, was.highMoment, lengths[count - 1]));
  }
  stack_.slabs.push_back(std::move(slab));
}

SlicedStack StackBuilder::take() {
  if (stack_.slabs.size() + 1 != stack_.header.slabDepths.size())
    refuse(std::to_string(stack_.slabs.size()) + " of " +
           std::to_string(stack_.header.slabDepths.size() - 1) + " slabs were added");
  return std::move(stack_);
}

}  // namespace vestige
