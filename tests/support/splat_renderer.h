// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tests/support/classified_renderer.h"

namespace vestige::test {

/// The second reference: object-order splatting [Westover 1990; Bergeron, p. 19-24].
/// Every sample is classified where it stands and thrown at the picture as the projection of a
/// Gaussian kernel of `deviation` grid spacings; the samples of a layer of the grid, most across
/// the view, make a sheet, in which overlapping kernels are normalised by the sum of their weights;
/// and sheets are composited front to back, each as thick as the rays' way through its layer. It
/// shares with renderClassified() neither its rays nor its interpolation: on data that are smooth
/// against the grid both agree. For orthographic cameras with square pixels, unlit, on even grids;
/// looks are optics() of the resolved classifier.
RgbPicture renderSplats(const FieldScenes& scenes, const Classifier& classifier,
                        std::span<const ChannelOptics> look, const ClassifiedView& view,
                        double deviation = 0.5);

}  // namespace vestige::test
