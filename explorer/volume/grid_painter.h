// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "explorer/picture/look.h"
#include "explorer/picture/stretch.h"
#include "explorer/volume/volume_pass.h"
#include "proxy/transfer/transfer_function.h"

namespace vestige {

/// The optics of values under a transfer function, its factors on the partition's intervals
/// included: (σ·c, σ).
OpticsTable::Optics opticsOf(const TransferFunction& function,
                             const IntervalPartition* partition = nullptr);

/// Draws a grid as a look says: volume, isosurfaces, MIP or a slice, cut by its clip box, stretched
/// by its scale, lit and occluded. Whatever source makes grids (fields, stacks) is drawn by it.
/// Keeps tables and occlusion of the look that it drew last. Made, used and destroyed in
/// Device::run.
class GridPainter {
 public:
  /// `grid` belongs to the painter's caller, is always the same, and is left in the scene of the
  /// look's scale, where `camera` is; `domain` is in the world. `function` and `partition` are for
  /// scalar grids. Throws Config naming the look's key when optics cannot be drawn so.
  VolumeView draw(LookGrid& grid, const Look& look, const TransferFunction& function,
                  const IntervalPartition* partition, const Box& domain, const Camera& camera,
                  ImageSize size);
  /// To be called when the texels of an optics grid have changed.
  void forget();
  VolumePass& pass() { return pass_; }

 private:
  void prepareScalar(LookGrid& grid, const Look& look, const TransferFunction& function,
                     const IntervalPartition* partition, VolumeSetup& setup);
  void prepareCustom(const LookGrid& grid, const Look& look, const TransferFunction& function,
                     const IntervalPartition* partition, const Box& domain);
  /// The picture drawn twice more, with all values as far below and above as they may be.
  std::vector<float> doubtOf(const LookGrid& grid, VolumeSetup setup, const Picture& likely);

  /// Places the grid in the scene of a look.
  void place(LookGrid& grid, const Stretch& stretch);

  VolumePass pass_;
  Stretch stretch_;
  std::optional<glm::dmat4> worldFromGrid_;  ///< before it is stretched
  std::string tableKey_, occlusionKey_;
  std::optional<OpticsTable> table_;
  std::optional<double> step_;  ///< of the table
  std::optional<OcclusionGrid> occlusion_;
  std::optional<CustomTextures> customTextures_;
  std::vector<OpticsTable> customTables_;
  std::optional<CustomDrawing> custom_;  ///< of the two above; none where the look changes nothing
};

}  // namespace vestige
