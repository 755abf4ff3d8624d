// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "proxy/format/exr/exr_file.h"
#include "proxy/format/image/feature_origin.h"
#include "proxy/format/image/proxy_image.h"

namespace vestige {

// Integrals of a classifier's weights along rays ([Kniss 2003, §5], method §5, classification §4):
// extinction is Σ w_i σ_i, so ∫ w_i ds knows neither opacity nor colour, and each feature is edited
// on its own. Channels are Classifier::channels() of header.features, in that order; planes are
// [channel][pixel], pixels row by row from the top.

/// What a channel's attenuation is counted by: its extinction under the run's look or, where it has
/// none, the greatest component of its emission; 1 / world unit.
double attenuationRate(const ChannelOptics& optics);

/// The rays of a view as wholes.
struct FeatureImage {
  ProxyHeader header;
  std::vector<float> attenuation;  ///< [channels] attenuationRate() ∫ w T ds under the run's look
  std::vector<float> transmittance;  ///< [1] T at the exit
  std::vector<float> integral;       ///< [channels] ∫ w ds, world
  std::vector<float> depth;  ///< [channels] planar ∫ Z w ds / ∫ w ds; 0 where the integral is 0
};

/// The proxy `features`; `kind` of the header is set here. `moment`: [channels] ∫ Z w ds. Fractions
/// in steps of 2^-12 (2^-11 above one half), integrals to a relative 2^-9 and 2^-25 of the domain's
/// diagonal, depths in 2046 steps over the domain's. Throws InvalidArgument when a span has another
/// size than the header asks for.
ProxyImage featureProxy(ProxyHeader header, std::span<const float> attenuation,
                        std::span<const float> transmittance, std::span<const float> integral,
                        std::span<const float> moment);
/// Back. Throws NotFound or Format naming what is missing; values are those of problemsOf().
FeatureImage featureImage(const ProxyImage& proxy);

/// The rays of an orthographic view slab by slab: slab s lies between the planar depths
/// header.slabDepths[s] and [s + 1].
struct FeatureStack {
  static constexpr int kMostSlabs = 64;
  ProxyHeader header;
  std::vector<std::vector<float>> slabs;  ///< [slab][channel][pixel] ∫ w ds, world
};

/// A share of a ray's stretch, in [0, 1], as stacks store it: in steps of 2^-12, of 2^-11 above one
/// half. Of a slab's optical depth at weight 1, no more than 2^-13 (2^-12) is lost.
float storedShare(double share);
/// Rounds all integrals to what encodeFeatureStack() stores.
void roundToStored(FeatureStack& stack);
/// The file of a stack, kind `sliced-features`; parts are made one after another. Throws
/// InvalidArgument naming what of the stack makes no sense.
std::vector<std::byte> encodeFeatureStack(const FeatureStack& stack);
/// Reads part after part. Throws Format naming file, part, pixel and value where they make no
/// sense, NotFound naming a part that is missing.
FeatureStack readFeatureStack(const ExrFile& file);

/// The features of a header; throws Format where it has none.
const FeatureOrigin& featuresOf(const ProxyHeader& header);

}  // namespace vestige
