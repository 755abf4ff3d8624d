// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "explorer/layers/depth_layer_pass.h"
#include "explorer/recomposition/decode.h"

namespace vestige {

/// The depth layer that stands for each channel of a partition, by index into `isovalues`: the
/// isovalue nearest to the middle of the interval, which bounds it or lies in it when layers are
/// dense [Tikhonova 2010, Fig. 1d]. -1 for no data, and everywhere without isovalues.
std::vector<int> layerOfChannels(const IntervalPartition& partition,
                                 const std::vector<double>& isovalues);

/// Layers as they will be drawn. Where a layer was not hit but one of its channels was passed
/// through (`lengths` may be null), the depth at which that channel starts is put in, so that no
/// segment is left out: exact where it has one run or the order along the ray tells, else where it
/// would start as one run, which is too deep and marked as likely.
LayerPlanes completedLayers(DepthLayers layers, const LengthPlanes* lengths,
                            const std::vector<int>& layerOf);

/// Without depth proxies: every interval that occurs is a layer at the depth where it starts,
/// found in the same way. `layerOf` receives the layer of each channel.
LayerPlanes layersFromLengths(const LengthPlanes& lengths, std::vector<int>& layerOf);

}  // namespace vestige
