// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "explorer/picture/picture.h"
#include "tests/support/cpu_renderer.h"

namespace vestige::test {

/// What novel views are made of by the methods that [Lochmann 2016] compares itself
/// with (Table 2, Fig. 9): slabs of equal depth, each a picture with a depth a pixel. Baselines of
/// the benches, on the CPU in double; nothing of them is in the product.
struct SlabPictures {
  Camera camera;
  ImageSize size;
  int slabs = 1;
  std::vector<float> rgba;   ///< [slab][pixel] 4: premultiplied, of the slab alone
  std::vector<float> depth;  ///< [slab][pixel] mean planar depth weighted by opacity; 0 = nothing
};

/// The raw field's slabs between the least and the greatest depth of the domain.
SlabPictures renderSlabs(const Scene& scene, const Camera& camera, ImageSize size,
                         const Medium& medium, int slabs, int samplesPerVoxel = 2);

/// [Zellmann 2012]: one slab; each pixel is a point at its mean depth, as large as a pixel,
/// the nearest one covers the others.
Picture warpPoints(const SlabPictures& slabs, const Camera& target);

/// [Mueller 1999]: each slab is a height field of coarse cells of `cell` pixels a side, on
/// which its picture is drawn as a surface; slabs are composited front to back.
Picture warpHeightFields(const SlabPictures& slabs, const Camera& target, int cell = 16);

}  // namespace vestige::test
