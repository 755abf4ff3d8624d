// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/format/layout/sliced_stack.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "proxy/base/error.h"
#include "proxy/format/image/storage_quantiser.h"
#include "proxy/format/layout/stored_planes.h"

namespace vestige {
namespace {

/// Deflate gives a seventh less at this level than at the other proxies' 3, for twice the time; the
/// planes are few and small (docs/archive-format.md "Compression").
constexpr int kStackZipLevel = 7;

constexpr const char* kFacesPart = "faces";
std::string faceName(int face) { return fmt::format("f{:02d}", face); }

/// Cumulative channels of a slab: below, then the intervals. `above` and the rest follow from them.
int cumulativeCount(const IntervalPartition& partition) { return partition.intervals() + 1; }

std::vector<std::string> slabChannels(const IntervalPartition& partition) {
  std::vector<std::string> names;
  for (int rank = 0; rank < cumulativeCount(partition); ++rank)
    names.push_back(partition.channelName(partition.channelAt(rank)));
  names.insert(names.end(), {"nodata", "low", "high"});
  return names;
}

ProxyPart emptyPart(std::string name, double step, const std::vector<std::string>& channels,
                    std::size_t pixels) {
  ProxyPart part{std::move(name), step / kHalfQuantum, 0.0, 0.0, {}};
  for (const std::string& channel : channels)
    part.channels.push_back({channel, ChannelStorage::Half, std::vector<float>(pixels)});
  return part;
}

ProxyPart facesPart(const SlicedStack& stack) {
  const std::size_t pixels = stack.header.size.pixels();
  std::vector<std::string> names;
  for (std::size_t face = 0; face < stack.faces.size(); ++face)
    names.push_back(faceName(int(face)));
  ProxyPart part = emptyPart(kFacesPart, 1.0, names, pixels);
  for (std::size_t face = 0; face < stack.faces.size(); ++face)
    for (std::size_t i = 0; i < pixels; ++i) {
      const std::uint8_t rank = stack.faces[face][i];
      part.channels[face].values[i] = rank == SlicedStack::kOutside ? 0.0f : float(rank) + 1.0f;
    }
  return part;
}

/// The middle of the part of the slab that a turn names.
float placeOfTurn(int turn) { return turn == 0 ? 0.0f : float((turn - 0.5) / SlicedStack::kTurns); }

ProxyPart slabPart(const SlicedStack& stack, int number) {
  const IntervalPartition& partition = partitionOf(stack.header);
  const std::size_t pixels = stack.header.size.pixels();
  const StackSlab& slab = stack.slabs[std::size_t(number)];
  const double step = 1.0 / stack.levels;
  const int ranks = cumulativeCount(partition);
  ProxyPart part = emptyPart(slabName(number), step, slabChannels(partition), pixels);
  part.error = step;
  for (std::size_t i = 0; i < pixels; ++i) {
    const StackCell& cell = slab.cells[i];
    const auto levels = slab.levelsOf(cell);
    int sum = 0;
    for (int rank = cell.lowest; rank < ranks && cell.count > 0; ++rank) {
      const int at = rank - cell.lowest;
      if (at < cell.count) sum += levels[std::size_t(at)];
      part.channels[std::size_t(rank)].values[i] = float(sum * step);
    }
    part.channels[std::size_t(ranks)].values[i] = float(cell.noData * step);
    part.channels[std::size_t(ranks) + 1].values[i] = placeOfTurn(cell.low());
    part.channels[std::size_t(ranks) + 2].values[i] = placeOfTurn(cell.high());
  }
  return part;
}

void validate(const SlicedStack& stack) {
  const auto refuse = [&](const std::string& reason) {
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("the sliced proxy of field '{}': {}", stack.header.field, reason));
  };
  partitionOf(stack.header);
  const std::size_t slabs = stack.slabs.size();
  if (slabs < 1 || slabs > std::size_t(SlicedStack::kMostSlabs))
    refuse(fmt::format("{} slabs, not 1 to {}", slabs, SlicedStack::kMostSlabs));
  if (!SlicedStack::allowsLevels(stack.levels))
    refuse(fmt::format("{} levels, not 16, 32, 64 or 128", stack.levels));
  if (stack.header.slabDepths.size() != slabs + 1 || stack.faces.size() != slabs + 1)
    refuse(fmt::format("{} slabs have {} depths and {} faces", slabs,
                       stack.header.slabDepths.size(), stack.faces.size()));
}

/// Reads one slab's part into cells, checking every number.
class SlabReader {
 public:
  SlabReader(const ExrFile& file, const SlicedStack& stack, const SlabChords& chords, int number)
      : file_(file),
        stack_(stack),
        chords_(chords),
        number_(number),
        part_(file.part(slabName(number))) {
    const IntervalPartition& partition = *stack.header.partition;
    ranks_ = cumulativeCount(partition);
    const auto wanted = slabChannels(partition);
    const auto named = [](const Channel& channel, const std::string& name) {
      return channel.name == name;
    };
    if (!std::equal(part_.channels.begin(), part_.channels.end(), wanted.begin(), wanted.end(),
                    named))
      throw Error(ErrorCode::Format,
                  fmt::format("'{}': part '{}' has other channels than a slab of {} intervals",
                              file.path().string(), part_.name, partition.intervals()));
  }

  StackSlab read() {
    const double least = chords_.least();
    const std::size_t pixels = stack_.header.size.pixels();
    StackSlab slab;
    slab.cells.resize(pixels);
    for (std::size_t i = 0; i < pixels; ++i)
      slab.cells[i] = cell(i, chords_.chord(number_, i) > least, slab.levels);
    return slab;
  }

 private:
  [[noreturn]] void refuse(std::size_t channel, std::size_t pixel, const char* wanted) const {
    const std::size_t width = std::size_t(stack_.header.size.width);
    throw Error(
        ErrorCode::Format,
        fmt::format("'{}': channel '{}' of part '{}' is {} at pixel ({}, {}); it must be "
                    "{}",
                    file_.path().string(), part_.channels[channel].name, part_.name,
                    part_.channels[channel].values[pixel], pixel % width, pixel / width, wanted));
  }

  int level(std::size_t channel, std::size_t pixel) const {
    const float scaled = part_.channels[channel].values[pixel] * float(stack_.levels);
    if (!(scaled >= 0.0f && scaled <= float(stack_.levels)) || scaled != std::floor(scaled))
      refuse(channel, pixel, "a whole number of levels 0 .. 1");
    return int(scaled);
  }

  int turn(std::size_t channel, std::size_t pixel) const {
    const float value = part_.channels[channel].values[pixel];
    if (value == 0.0f) return 0;
    const float turn = value * SlicedStack::kTurns + 0.5f;
    if (!(turn >= 1.0f && turn <= float(SlicedStack::kTurns)) || turn != std::floor(turn))
      refuse(channel, pixel, "0 or the middle of an eighth of the slab");
    return int(turn);
  }

  StackCell cell(std::size_t pixel, bool hit, std::vector<std::uint8_t>& levels) const {
    StackCell cell;
    cell.begin = std::uint32_t(levels.size());
    const auto count = std::size_t(ranks_);
    const int noData = level(count, pixel), all = stack_.levels - noData;
    const int low = turn(count + 1, pixel), high = turn(count + 2, pixel);
    int before = 0;
    std::array<std::uint8_t, IntervalPartition::kMaxIntervals + 2> lengths{};
    for (std::size_t rank = 0; rank < count; ++rank) {
      const int sum = level(rank, pixel);
      if (sum < before || sum > all) refuse(rank, pixel, "no less than the one before, nodata out");
      lengths[rank] = std::uint8_t(sum - before);
      before = sum;
    }
    if (!hit) return cell;
    lengths[count] = std::uint8_t(all - before);
    cell.noData = std::uint8_t(noData);
    cell.setTurns(low, high);
    std::size_t first = 0, end = count + 1;
    while (first < end && lengths[first] == 0) ++first;
    while (end > first && lengths[end - 1] == 0) --end;
    cell.lowest = std::uint8_t(first < end ? first : 0);
    cell.count = std::uint8_t(end - first);
    levels.insert(levels.end(), lengths.begin() + std::ptrdiff_t(first),
                  lengths.begin() + std::ptrdiff_t(end));
    return cell;
  }

  const ExrFile& file_;
  const SlicedStack& stack_;
  const SlabChords& chords_;
  int number_;
  ProxyPart part_;
  int ranks_ = 0;
};

}  // namespace

std::vector<std::byte> encodeStack(const SlicedStack& stack) {
  validate(stack);
  ProxyHeader header = stack.header;
  header.kind = kind::kSliced;
  return encodeExr(
      header, int(stack.slabs.size()) + 1,
      [&](int part) { return part == 0 ? facesPart(stack) : slabPart(stack, part - 1); },
      kStackZipLevel);
}

SlicedStack readStack(const ExrFile& file) {
  const auto refuse = [&](const std::string& reason) {
    throw Error(ErrorCode::Format, fmt::format("'{}': {}", file.path().string(), reason));
  };
  SlicedStack stack;
  stack.header = file.header();
  const ProxyHeader& header = stack.header;
  if (header.kind != kind::kSliced)
    refuse(fmt::format("it is a {} proxy, not a sliced one", header.kind));
  if (!header.partition) refuse("it has no intervals");
  if (header.camera.projection != Projection::Orthographic)
    refuse("its camera is perspective; slabs need an orthographic one");
  const int slabs = int(header.slabDepths.size()) - 1;
  if (slabs < 1 || slabs > SlicedStack::kMostSlabs)
    refuse(fmt::format("it has {} slabs, not 1 to {}", slabs, SlicedStack::kMostSlabs));
  if (int(file.partNames().size()) != slabs + 1)
    refuse(fmt::format("it has {} parts, {} slabs need {}", file.partNames().size(), slabs,
                       slabs + 1));
  if (!std::is_sorted(header.slabDepths.begin(), header.slabDepths.end(), std::less_equal<>()))
    refuse("its slabs' depths do not rise");

  const ProxyPart faces = file.part(kFacesPart);
  const std::size_t pixels = header.size.pixels();
  if (int(faces.channels.size()) != slabs + 1)
    refuse(fmt::format("part '{}' has {} channels, {} slabs need {}", kFacesPart,
                       faces.channels.size(), slabs, slabs + 1));
  const float most = float(header.partition->channels());
  for (const Channel& channel : faces.channels) {
    auto& ranks = stack.faces.emplace_back(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
      const float value = channel.values[i];
      if (!(value >= 0.0f && value <= most) || value != std::floor(value))
        refuse(
            fmt::format("channel '{}' of part '{}' is {} at pixel {}; it must be 1 + a rank, "
                        "or 0",
                        channel.name, kFacesPart, value, i));
      ranks[i] = value == 0.0f ? SlicedStack::kOutside : std::uint8_t(value - 1.0f);
    }
  }
  const double levels = 1.0 / (file.unitOf(slabName(0)) * kHalfQuantum);
  if (!(levels >= 1.0 && levels <= 128.0) || !SlicedStack::allowsLevels(int(levels)) ||
      levels != std::floor(levels))
    refuse(fmt::format("it has {} levels, not 16, 32, 64 or 128", levels));
  stack.levels = int(levels);
  const SlabChords chords(header);
  for (int s = 0; s < slabs; ++s) {
    if (file.unitOf(slabName(s)) != file.unitOf(slabName(0)))
      refuse(fmt::format("part '{}' has other levels than '{}'", slabName(s), slabName(0)));
    stack.slabs.push_back(SlabReader(file, stack, chords, s).read());
  }
  return stack;
}

SlabChords::SlabChords(const ProxyHeader& header) : depths_(header.slabDepths) {
  const std::size_t width = std::size_t(header.size.width);
  inDomain_.reserve(header.size.pixels());
  for (std::size_t pixel = 0; pixel < header.size.pixels(); ++pixel) {
    const Ray ray = header.camera.rayThrough(
        {double(pixel % width) + 0.5, double(pixel / width) + 0.5}, header.size);
    // Orthographic rays start on the camera plane: length along the ray is planar depth.
    double enters = -std::numeric_limits<double>::infinity(), leaves = -enters;
    for (int axis = 0; axis < 3; ++axis) {
      const double d = ray.direction[axis], o = ray.origin[axis];
      const double low = header.domain.low[axis], high = header.domain.high[axis];
      if (std::abs(d) < 1e-12) {
        if (o < low || o > high) leaves = -std::numeric_limits<double>::infinity();
        continue;
      }
      const double a = (low - o) / d, b = (high - o) / d;
      enters = std::max(enters, std::min(a, b));
      leaves = std::min(leaves, std::max(a, b));
    }
    inDomain_.emplace_back(enters, leaves);
  }
}

double SlabChords::least() const {
  double thickest = 0.0;
  for (std::size_t s = 0; s + 1 < depths_.size(); ++s)
    thickest = std::max(thickest, depths_[s + 1] - depths_[s]);
  return 1e-6 * thickest;
}

}  // namespace vestige
