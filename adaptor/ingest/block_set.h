// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>

#include "adaptor/ingest/block_grid.h"
#include "adaptor/ingest/field_view.h"
#include "proxy/camera/box.h"

namespace vestige {

/// A block as the host described it (vestige_grid); axes are copies.
struct GridDescription {
  std::array<int, 3> points{};
  std::array<int, 3> first{};
  std::array<double, 3> origin{};
  std::array<double, 3> spacing{1.0, 1.0, 1.0};
  std::array<std::optional<std::vector<double>>, 3> axes;
  std::array<int, 6> ghosts{};

  bool empty() const { return points[0] == 0 || points[1] == 0 || points[2] == 0; }
};

/// Throws GRID when a block has so many points that no device could march it.
void requireSize(int index, const std::array<int, 3>& points);

struct Block {
  GridDescription grid;
  std::array<std::vector<double>, 3> points;     ///< world coordinates per axis, ghosts included
  std::vector<FieldView> fields;                 ///< in the order in which they were shared
  std::array<std::optional<MaskView>, 2> masks;  ///< by Location

  const FieldView* find(const std::string& name) const;
  /// Samples along each axis of a field at this location; 0 if the block is empty.
  std::array<int, 3> samples(Location location) const;
  /// Their world coordinates per axis.
  std::array<std::vector<double>, 3> nodes(Location location) const;
};

/// A place between two neighbouring samples of an axis: (1 - weight) f[below] + weight f[below +
/// 1].
struct SamplePlace {
  int below = 0;
  double weight = 0.0;
};

/// The blocks of this process and what is shared on them. Errors are AdaptorErrors that name block
/// and value; a call that throws changes nothing.
class BlockSet {
 public:
  void describe(int index, GridDescription grid);
  /// The field's `size` is set here. A field of the same name and location is replaced; one of
  /// the same name at another location is an error.
  void share(int index, FieldView field);
  void shareMask(int index, Location location, std::optional<MaskView> mask);
  void setDomain(const Box& domain) { statedDomain_ = domain; }
  /// Forgets fields and masks, keeps the grids.
  void forgetShared();

  const std::map<int, Block>& blocks() const { return blocks_; }
  const Block& at(int index) const;
  const std::optional<Box>& statedDomain() const { return statedDomain_; }

  /// Throws unless some block has an extent, owned boxes do not overlap and lie in the domain.
  void validate() const;
  /// As stated, or the bounding box of the owned boxes; an axis without extent (one point) gets
  /// the thickness of one cell.
  Box domain() const;
  /// The box between the block's first and last own points, thickened as the domain.
  Box owned(int index) const;
  /// The smallest distance between neighbouring points of any block, > 0.
  double smallestSpacing() const;
  /// The share of the domain that the blocks cover, 0..1.
  double coverage() const;
  /// The samples that this block counts in statistics, in disjoint ranges: each sample of the
  /// domain is in exactly one block's. Points on a face, edge or corner that blocks share are those
  /// of the block with the lowest index; where the two grids differ there, its points alone count.
  std::vector<SampleRange> ownSamples(int index, Location location) const;
  /// Where the faces of the owned box lie between an own sample and a ghost, by axis, low before
  /// high: with cell data, rays see values there that are no sample's.
  std::array<std::vector<SamplePlace>, 3> facePlaces(int index, Location location) const;

 private:
  Block& edit(int index);
  std::optional<Box> ownPoints(const Block& block) const;
  /// What a domain without extent along an axis is thickened by; 0 for the other axes.
  std::array<double, 3> thickness() const;
  /// One uniform spacing along the axis, or smallestSpacing().
  double cellThickness(int axis) const;

  std::map<int, Block> blocks_;
  std::optional<Box> statedDomain_;
};

}  // namespace vestige
