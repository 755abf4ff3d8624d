// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "explorer/picture/look.h"
#include "explorer/recomposition/decode.h"

namespace vestige {

/// A stretch of a ray inside one channel of the partition. `amount` is what a look's strength of
/// the channel multiplies to give the stretch's optical depth: a length in world units (strength =
/// extinction), or an optical depth of the base function (strength = factor). `ambiguous`: where
/// the stretch lies is not stored, only likely. `mixed`: this segment and the next fill one stretch
/// of the ray together, as a homogeneous mixture.
struct Segment {
  int channel = 0;
  float amount = 0.0f;
  bool ambiguous = false;
  bool mixed = false;
};

/// For every pixel what its ray met, front to back. This order does not depend on the look, so it
/// is found once, when a proxy is decoded; an edit is then one walk along each list (method §2
/// "opacity change"). Packed as the shaders read it: `first` [pixel] is the index of a pixel's
/// first entry or kNone; an entry holds amount / unit (amountBits) in bits 0-15, the channel in
/// bits 16-28, kMixed, kAmbiguous and, on the last of a list, kLast.
struct SegmentLists {
  static constexpr std::uint32_t kNone = 0xffffffffu;
  static constexpr std::uint32_t kMostChannel = (1u << 13) - 1;
  static constexpr std::uint32_t kMixed = 1u << 29;
  static constexpr std::uint32_t kAmbiguous = 1u << 30;
  static constexpr std::uint32_t kLast = 1u << 31;

  ImageSize size;
  double unit = 1.0;
  std::vector<std::uint32_t> first;
  std::vector<std::uint32_t> entries;

  /// The list of pixel i, unpacked.
  std::vector<Segment> at(std::size_t pixel) const;
};

/// What Order::Auto means for a view of this size.
Order resolvedOrder(Order order, ImageSize size);

/// From opacity lengths: the segments of each ray by increasing mean depth (Order::Mean), or along
/// the runs reconstructed by run_order.h (Order::Runs; Order::Auto: see resolvedOrder).
SegmentLists segmentsFromLength(const LengthPlanes& planes, Order order);

/// From accumulated attenuation, in one global order of channels (nested surfaces, outside first):
/// A_k = a_k / Π(1 - A_j) over the channels before k; the amount is -ln(1 - A_k). Where nothing is
/// left to attenuate (0/0) the channel contributes nothing.
SegmentLists segmentsFromAttenuation(const AttenuationPlanes& planes, std::span<const int> order);
/// The order of increasing value: below, the intervals, above.
std::vector<int> nestedOrder(const IntervalPartition& partition);

/// A value in [2^-25, 2^7) as 16 bits, to 2^-12 of itself, such that a shader gets it back with a
/// shift and an addition; beyond, the nearest value there is. And back.
std::uint32_t amountBits(float value);
float amountValue(std::uint32_t bits);

}  // namespace vestige
