// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/ingest/block_set.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "adaptor/common/adaptor_error.h"

namespace vestige {
namespace {

constexpr std::array<char, 3> kAxisNames{'x', 'y', 'z'};

/// Coordinates that differ by less than this share of the domain are the same place.
constexpr double kTolerance = 1e-9;

/// A block is marched in parts of a texture each, of which these make some hundreds.
constexpr int kMostPoints = 1 << 20;                          ///< along an axis
constexpr std::int64_t kMostSamples = std::int64_t(1) << 36;  ///< in all

[[noreturn]] void failGrid(int index, const std::string& what) {
  throw AdaptorError(VESTIGE_ERROR_GRID, fmt::format("block {} {}", index, what));
}

void validateAxis(int index, const GridDescription& grid, int axis) {
  const auto a = std::size_t(axis);
  const char name = kAxisNames[a];
  const int points = grid.points[a], below = grid.ghosts[2 * a], above = grid.ghosts[2 * a + 1];
  if (below < 0 || above < 0) {
    failGrid(index, fmt::format("has {} ghost layers along {}", std::min(below, above), name));
  }
  if (std::int64_t(below) + above >= points) {
    failGrid(index, fmt::format("has {} points along {}, of which {} are ghosts: none is its own",
                                points, name, std::int64_t(below) + above));
  }
  if (grid.axes[a]) return;
  if (!std::isfinite(grid.origin[a])) {
    failGrid(index, fmt::format("has the origin {} along {}", grid.origin[a], name));
  }
  if (!(grid.spacing[a] > 0.0) || !std::isfinite(grid.spacing[a])) {
    failGrid(index, fmt::format("has the spacing {} along {}, which must be positive",
                                grid.spacing[a], name));
  }
}

void validateCoordinates(int index, const std::vector<double>& points, char name) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!std::isfinite(points[i])) {
      failGrid(index, fmt::format("has the {} coordinate {} at point {}", name, points[i], i));
    }
    if (i > 0 && !(points[i] > points[i - 1])) {
      failGrid(index, fmt::format("has {} coordinates that do not increase: {} after {} at point "
                                  "{}",
                                  name, points[i], points[i - 1], i));
    }
  }
}

double volume(const Box& box) {
  const auto size = box.size();
  return size.x * size.y * size.z;
}

/// The smallest extent that two boxes share along an axis; <= 0: they do not overlap.
double overlap(const Box& a, const Box& b) {
  double least = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    least =
        std::min(least, std::min(a.high[axis], b.high[axis]) - std::max(a.low[axis], b.low[axis]));
  }
  return least;
}

/// Appends what of `range` lies outside of `hole`, in up to six ranges.
void subtract(SampleRange range, const SampleRange& hole, std::vector<SampleRange>& out) {
  for (std::size_t a = 0; a < 3; ++a) {
    // What lies below and above the hole along this axis; go on with what lies beside it.
    SampleRange below = range, above = range;
    below.high[a] = std::min(range.high[a], hole.low[a]);
    above.low[a] = std::max(range.low[a], hole.high[a]);
    if (below == range || above == range || range.empty()) {
      if (!range.empty()) out.push_back(range);
      return;
    }
    if (!below.empty()) out.push_back(below);
    if (!above.empty()) out.push_back(above);
    range.low[a] = std::max(range.low[a], hole.low[a]);
    range.high[a] = std::min(range.high[a], hole.high[a]);
  }
}

}  // namespace

void requireSize(int index, const std::array<int, 3>& points) {
  std::int64_t samples = 1;
  bool fits = true;
  for (std::size_t a = 0; a < 3; ++a) {
    if (points[a] < 0)
      failGrid(index, fmt::format("has {} points along {}", points[a], kAxisNames[a]));
    fits = fits && points[a] <= kMostPoints;
    samples *= std::min(points[a], kMostPoints);
  }
  if ((fits && samples <= kMostSamples) || samples == 0) return;
  failGrid(index,
           fmt::format("has {} x {} x {} points, more than a block can have: {} along an axis "
                       "and {} in all",
                       points[0], points[1], points[2], kMostPoints, kMostSamples));
}

const FieldView* Block::find(const std::string& name) const {
  const auto found = std::find_if(fields.begin(), fields.end(),
                                  [&](const FieldView& field) { return field.name == name; });
  return found == fields.end() ? nullptr : &*found;
}

std::array<int, 3> Block::samples(Location location) const {
  if (grid.empty()) return {0, 0, 0};
  if (location == Location::Point) return grid.points;
  std::array<int, 3> cells{};
  for (std::size_t a = 0; a < 3; ++a) cells[a] = std::max(1, grid.points[a] - 1);
  return cells;
}

std::array<std::vector<double>, 3> Block::nodes(Location location) const {
  if (location == Location::Point) return points;
  std::array<std::vector<double>, 3> centers;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto& axis = points[a];
    if (axis.size() == 1) centers[a] = axis;
    for (std::size_t i = 1; i < axis.size(); ++i) {
      centers[a].push_back(axis[i - 1] + 0.5 * (axis[i] - axis[i - 1]));
    }
  }
  return centers;
}

void BlockSet::describe(int index, GridDescription grid) {
  if (index < 0) {
    throw AdaptorError(VESTIGE_ERROR_ARGUMENT, fmt::format("block index {} is negative", index));
  }
  requireSize(index, grid.points);
  Block block;
  if (!grid.empty()) {
    for (std::size_t a = 0; a < 3; ++a) {
      validateAxis(index, grid, int(a));
      auto& points = block.points[a];
      if (grid.axes[a]) {
        points = *grid.axes[a];
      } else {
        points.resize(std::size_t(grid.points[a]));
        for (int i = 0; i < grid.points[a]; ++i) {
          points[std::size_t(i)] =
              grid.origin[a] + double(std::int64_t(grid.first[a]) + i) * grid.spacing[a];
        }
      }
      validateCoordinates(index, points, kAxisNames[a]);
    }
  }
  block.grid = std::move(grid);
  blocks_[index] = std::move(block);
}

Block& BlockSet::edit(int index) {
  const auto found = blocks_.find(index);
  if (found == blocks_.end()) {
    throw AdaptorError(VESTIGE_ERROR_NO_BLOCK, fmt::format("block {} is not described", index));
  }
  return found->second;
}

const Block& BlockSet::at(int index) const { return const_cast<BlockSet*>(this)->edit(index); }

void BlockSet::share(int index, FieldView field) {
  Block& block = edit(index);
  field.size = block.samples(field.location);
  const auto same = std::find_if(block.fields.begin(), block.fields.end(),
                                 [&](const FieldView& other) { return other.name == field.name; });
  if (same != block.fields.end() && same->location != field.location) {
    throw AdaptorError(
        VESTIGE_ERROR_FIELD,
        fmt::format("field '{}' of block {} is shared at {}s already: share the one at {}s under "
                    "another name",
                    field.name, index, nameOf(same->location), nameOf(field.location)));
  }
  if (same == block.fields.end()) {
    block.fields.push_back(std::move(field));
  } else {
    *same = std::move(field);
  }
}

void BlockSet::shareMask(int index, Location location, std::optional<MaskView> mask) {
  edit(index).masks[std::size_t(location)] = mask;
}

void BlockSet::forgetShared() {
  for (auto& [index, block] : blocks_) {
    block.fields.clear();
    block.masks = {};
  }
}

std::optional<Box> BlockSet::ownPoints(const Block& block) const {
  if (block.grid.empty()) return std::nullopt;
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = std::size_t(axis);
    const auto& points = block.points[a];
    box.low[axis] = points[std::size_t(block.grid.ghosts[2 * a])];
    box.high[axis] = points[points.size() - 1 - std::size_t(block.grid.ghosts[2 * a + 1])];
  }
  return box;
}

std::array<double, 3> BlockSet::thickness() const {
  std::array<double, 3> thickness{};
  std::optional<Box> all = statedDomain_;
  for (const auto& [index, block] : blocks_) {
    if (all) break;
    all = ownPoints(block);
  }
  for (int axis = 0; axis < 3 && all; ++axis) {
    const auto inPlane = [&, all = *all](const auto& entry) {
      const auto own = ownPoints(entry.second);
      return !own || (own->low[axis] == all.low[axis] && own->high[axis] == all.low[axis]);
    };
    if (all->low[axis] == all->high[axis] && std::all_of(blocks_.begin(), blocks_.end(), inPlane)) {
      thickness[std::size_t(axis)] = cellThickness(axis);
    }
  }
  return thickness;
}

double BlockSet::cellThickness(int axis) const {
  double spacing = std::numeric_limits<double>::infinity();
  for (const auto& [index, block] : blocks_) {
    if (!block.grid.empty() && !block.grid.axes[std::size_t(axis)]) {
      spacing = std::min(spacing, block.grid.spacing[std::size_t(axis)]);
    }
  }
  return std::isfinite(spacing) ? spacing : smallestSpacing();
}

double BlockSet::smallestSpacing() const {
  double smallest = std::numeric_limits<double>::infinity();
  for (const auto& [index, block] : blocks_) {
    for (std::size_t a = 0; a < 3; ++a) {
      const auto& points = block.points[a];
      if (points.size() < 2) continue;
      if (!block.grid.axes[a]) {
        // As stated: differences of coordinates would differ by rounding from block to block.
        smallest = std::min(smallest, block.grid.spacing[a]);
        continue;
      }
      for (std::size_t i = 1; i < points.size(); ++i) {
        smallest = std::min(smallest, points[i] - points[i - 1]);
      }
    }
  }
  return std::isfinite(smallest) ? smallest : 1.0;
}

Box BlockSet::owned(int index) const {
  const auto own = ownPoints(at(index));
  if (!own) failGrid(index, "is empty and has no extent");
  const auto thick = thickness();
  Box box = *own;
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] -= 0.5 * thick[std::size_t(axis)];
    box.high[axis] += 0.5 * thick[std::size_t(axis)];
  }
  return box;
}

Box BlockSet::domain() const {
  std::optional<Box> all = statedDomain_;
  const auto thick = thickness();
  if (!all) {
    for (const auto& [index, block] : blocks_) {
      const auto own = ownPoints(block);
      if (!own) continue;
      if (!all) all = own;
      all->low = glm::min(all->low, own->low);
      all->high = glm::max(all->high, own->high);
    }
  }
  if (!all) throw AdaptorError(VESTIGE_ERROR_GRID, "no block has any points: nothing to show");
  for (int axis = 0; axis < 3; ++axis) {
    all->low[axis] -= 0.5 * thick[std::size_t(axis)];
    all->high[axis] += 0.5 * thick[std::size_t(axis)];
  }
  return *all;
}

void BlockSet::validate() const {
  const Box all = domain();
  const double tolerance = kTolerance * all.diagonal();
  std::vector<std::pair<int, Box>> boxes;
  for (const auto& [index, block] : blocks_) {
    if (!block.grid.empty()) boxes.emplace_back(index, owned(index));
  }
  if (boxes.empty()) {
    throw AdaptorError(VESTIGE_ERROR_GRID, "no block has any points: nothing to show");
  }
  for (const auto& [index, box] : boxes) {
    for (int axis = 0; axis < 3; ++axis) {
      if (box.low[axis] < all.low[axis] - tolerance ||
          box.high[axis] > all.high[axis] + tolerance) {
        failGrid(index, fmt::format("reaches from {} to {} along {}, beyond the domain's {} to {}",
                                    box.low[axis], box.high[axis], kAxisNames[std::size_t(axis)],
                                    all.low[axis], all.high[axis]));
      }
    }
  }
  // Sorted along x, only neighbours in x need comparing.
  std::sort(boxes.begin(), boxes.end(),
            [](const auto& a, const auto& b) { return a.second.low.x < b.second.low.x; });
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (std::size_t j = i + 1; j < boxes.size(); ++j) {
      if (boxes[j].second.low.x >= boxes[i].second.high.x) break;
      if (overlap(boxes[i].second, boxes[j].second) > tolerance) {
        failGrid(std::max(boxes[i].first, boxes[j].first),
                 fmt::format("overlaps block {}", std::min(boxes[i].first, boxes[j].first)));
      }
    }
  }
}

double BlockSet::coverage() const {
  const double all = volume(domain());
  double covered = 0.0;
  for (const auto& [index, block] : blocks_) {
    if (!block.grid.empty()) covered += volume(owned(index));
  }
  return all > 0.0 ? covered / all : 1.0;
}

std::vector<SampleRange> BlockSet::ownSamples(int index, Location location) const {
  const Block& block = at(index);
  const auto own = ownPoints(block);
  if (!own) return {};
  SampleRange all;
  const auto samples = block.samples(location);
  for (std::size_t a = 0; a < 3; ++a) {
    all.low[a] = block.grid.ghosts[2 * a];
    all.high[a] = std::max(samples[a] - block.grid.ghosts[2 * a + 1], all.low[a]);
  }
  std::vector<SampleRange> ranges{all};
  if (location == Location::Cell) return ranges;
  const double tolerance = kTolerance * domain().diagonal();
  for (const auto& [other, neighbour] : blocks_) {
    if (other >= index) break;
    const auto theirs = ownPoints(neighbour);
    if (!theirs || overlap(*own, *theirs) < -tolerance) continue;
    SampleRange shared;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto& points = block.points[a];
      const double low = theirs->low[int(a)] - tolerance, high = theirs->high[int(a)] + tolerance;
      shared.low[a] = int(std::lower_bound(points.begin(), points.end(), low) - points.begin());
      shared.high[a] = int(std::upper_bound(points.begin(), points.end(), high) - points.begin());
    }
    std::vector<SampleRange> left;
    for (const auto& range : ranges) subtract(range, shared, left);
    ranges = std::move(left);
  }
  return ranges;
}

std::array<std::vector<SamplePlace>, 3> BlockSet::facePlaces(int index, Location location) const {
  std::array<std::vector<SamplePlace>, 3> places;
  const Block& block = at(index);
  const auto own = ownPoints(block);
  if (!own) return places;
  const auto nodes = block.nodes(location);
  for (std::size_t a = 0; a < 3; ++a) {
    const auto between = [&](int below, double place) {
      if (below < 0 || below + 1 >= int(nodes[a].size())) return;
      const double low = nodes[a][std::size_t(below)], high = nodes[a][std::size_t(below) + 1];
      if (low < place && place < high) places[a].push_back({below, (place - low) / (high - low)});
    };
    between(block.grid.ghosts[2 * a] - 1, own->low[int(a)]);
    between(int(nodes[a].size()) - 1 - block.grid.ghosts[2 * a + 1], own->high[int(a)]);
  }
  return places;
}

}  // namespace vestige
