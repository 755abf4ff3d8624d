// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "adaptor/compositing/march_types.h"

namespace vestige {

/// Composites the blocks of a view in each pixel's own order of depth, for cameras whose rays meet
/// blocks in different orders ([Tikhonova 2010, §4]: multi-perspective). Of every block only
/// the pixels that meet it are kept, so memory follows the blocks that a ray meets, not all blocks.
class RaySorter {
 public:
  /// Images of one size with the same planes (InvalidArgument), in any order.
  void add(RayImage rays);
  /// Their composite; a pixel that met nothing is as in the first image. Empty afterwards. Throws
  /// InvalidArgument when nothing was added.
  RayImage take();

 private:
  /// What a pixel met in one image: its values in `values_`, plane by plane.
  struct Hit {
    std::uint32_t pixel;
    float entry;
    std::size_t values;
  };

  RayImage first_;  ///< the first image; the sizes of planes are those of all
  std::vector<Hit> hits_;
  std::vector<float> values_;
  bool any_ = false;
};

}  // namespace vestige
