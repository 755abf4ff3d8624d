// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "explorer/picture/picture.h"
#include "proxy/format/layout/feature_layout.h"

namespace vestige {

/// A picture and by how much an order that is not stored could change it.
struct RecomposedFeatures {
  Picture picture;
  std::vector<float> doubt;  ///< [pixel] largest change of a linear colour; empty unless asked for
};

/// The picture of a stack's own view under any optics of its channels (method §5): the optical
/// depth of each slab is exact. Inside a slab each channel's density is a straight line that keeps
/// its integral and leans toward its neighbours' in the slabs before and behind, no farther than to
/// 0. [channel] optics as Classifier::optics().
RecomposedFeatures recomposed(const FeatureStack& stack, std::span<const ChannelOptics> optics,
                              bool doubt = false);

/// The picture of whole rays: channels one after another by mean depth.
RecomposedFeatures recomposed(const FeatureImage& image, std::span<const ChannelOptics> optics,
                              bool doubt = false);

}  // namespace vestige
