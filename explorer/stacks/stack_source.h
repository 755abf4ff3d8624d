// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include "explorer/picture/stretch.h"
#include "explorer/stacks/stack_grid.h"
#include "explorer/volume/grid_painter.h"
#include "proxy/archive/archive.h"

namespace vestige {

/// The stacks of one cycle and field as a grid of values on the GPU: any view, any look. Of many
/// stacks the kMost that look along the most different axes are fused (stack_grid.h). Made, used
/// and destroyed in Device::run.
class StackSource {
 public:
  static constexpr std::size_t kMost = 3;

  /// The views of a step that have a stack of the field, by name.
  static std::vector<std::string> viewsOf(const Archive& archive, long cycle,
                                          const std::string& field);

  /// Throws NotFound when there is none.
  StackSource(const Archive& archive, long cycle, std::string field);

  bool is(long cycle, const std::string& field) const { return cycle == cycle_ && field == field_; }
  /// Of the first stack.
  const ProxyHeader& header() const { return headers_.front(); }
  /// What is drawn ends at the domain. `guess`: the share of each ray's way through the domain that
  /// no stack saw.
  VolumeView draw(const Look& look, const TransferFunction& function, const Camera& camera,
                  ImageSize size);
  /// Which stacks they are and how true, in a sentence.
  std::string note(const Camera& camera) const;

 private:
  std::vector<float> unseen(const Camera& camera, ImageSize size, const Stretch& stretch) const;

  long cycle_;
  std::string field_;
  std::vector<ProxyHeader> headers_;
  LookGrid grid_;
  GridPainter painter_;
};

/// The field that up to kMost of a step's stacks give together, and the headers of these.
/// Throws NotFound when there is none.
StackSamples samplesOfStacks(const Archive& archive, long cycle, const std::string& field,
                             std::vector<ProxyHeader>& fused);

/// Indices of stacks to fuse, by the directions they look in (unit vectors): the first, then
/// whichever looks most across those chosen, at most StackSource::kMost; none that looks along
/// another's axis.
std::vector<std::size_t> mostDifferent(std::span<const glm::dvec3> ways);

/// What bounds the error of a stack, in a sentence: widths of intervals, thickness of slabs,
/// levels.
std::string errorOfStack(const ProxyHeader& header, int levels);
/// Into how many levels the file of a stack divides a ray's stretch in a slab.
int levelsOfStack(const ExrFile& file);

}  // namespace vestige
