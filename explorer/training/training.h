// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "explorer/training/learned_color.h"
#include "proxy/archive/archive.h"
#include "proxy/gl/device.h"

namespace vestige {

/// What to learn colours from. Empty or default: what the archive has.
struct TrainingRequest {
  long cycle = 0;
  std::string view, field;
  std::string from;  ///< length, attenuation or sliced; empty: the truest that the view stores
  int pictures = kMostTrainingPictures;  ///< the first so many, at most
  int clusters = 24;
};

/// The views of a step and field that store pictures to learn from: `training`, or `reference`.
std::vector<std::string> trainableViews(const Archive& archive, long cycle,
                                        const std::string& field);

/// Pixels of the view's first training pictures: attenuations recomposed from what is stored under
/// each picture's own look, and its colours. `header` gets looks, shading, partition and what the
/// samples were made from. Runs on the device.
LearningSamples learningSamples(gl::Device& device, const Archive& archive,
                                const TrainingRequest& request, ProxyHeader& header);

/// The table of learned colours of a view [Tikhonova 2010, §6.2], ready to be stored. Throws
/// NotFound when the view stores no picture, or nothing that attenuation can be recomposed from,
/// Format when the two have not the same size or camera.
ProxyImage trainColors(gl::Device& device, const Archive& archive, const TrainingRequest& request);

}  // namespace vestige
