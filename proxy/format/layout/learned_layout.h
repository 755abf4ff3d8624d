// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "proxy/format/image/proxy_image.h"

namespace vestige {

/// Training pictures of a view at most ([Tikhonova 2010, §6.2] uses one to four).
inline constexpr int kMostClusters = 256;

/// A colour for every distribution of attenuation [Tikhonova 2010, §6.2, eq. 8-10]: in the
/// cluster whose centroid a0 is nearest to a, c = color + jacobian (a - a0). Distributions are over
/// all channels of a partition; colours are premultiplied linear RGB.
struct LearnedTable {
  int channels = 0, clusters = 0;
  std::vector<float> centroid;  ///< [cluster][channel]
  std::vector<float> jacobian;  ///< [cluster][r, g, b][channel]
  std::vector<float> color;     ///< [cluster][r, g, b]
};

/// A picture's planes: premultiplied linear RGB (three) and T.
struct LightPlanes {
  std::span<const float> rgb, transmittance;
};

/// The training pictures of a view, one for each of header.looks; `kind` of the header is set here.
/// Rounded as referenceImage(). Throws InvalidArgument when there are none, more than
/// kMostTrainingPictures, not as many as looks, or planes have another size than the header.
ProxyImage trainingImage(ProxyHeader header, std::span<const LightPlanes> pictures);

/// The table as a picture whose rows are clusters; `kind` and `size` of the header are set here.
/// Throws InvalidArgument unless it has the channels of header.partition, 1 .. kMostClusters
/// clusters and finite numbers of at most 1e6, and header.learned and header.looks say of what.
ProxyImage learnedImage(ProxyHeader header, const LearnedTable& table);
/// Back. Throws Format naming what is missing or makes no sense.
LearnedTable learnedTable(const ProxyImage& image);

}  // namespace vestige
