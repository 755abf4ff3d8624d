// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "adaptor/ingest/block_grid.h"
#include "proxy/camera/camera.h"
#include "proxy/customization/customization.h"
#include "proxy/transfer/interval_partition.h"
#include "proxy/transfer/transfer_function.h"

namespace vestige {

/// Fills samples [z0, z1) x all y x all x (x fastest) of a block, normalised by the partition to be
/// marched with: (f - b_0) / (b_L - b_0); no data = NaN. Called with ascending slabs, on the
/// device's thread (a clean floating-point environment, signals blocked); may throw.
using FillSlab = std::function<void(int z0, int z1, float* out)>;

/// Seconds of the last upload and march, read-back apart.
struct MarchTimes {
  double fill = 0.0, upload = 0.0, march = 0.0, readBack = 0.0;
};

/// What one march is to make (method §2). Scalars are in the field's units; the samples that the
/// marcher holds are normalised by the partition's bounds.
struct MarchRequest {
  Camera camera;
  ImageSize size;
  IntervalPartition partition;
  TransferFunction base;
  Box domain;  ///< the whole domain: anchors the samples, so blocks agree
  /// World depth between samples; 0 = the smallest spacing of the block. Blocks of one domain agree
  /// only when they are marched with the same one.
  double stepLength = 0.0;
  bool attenuation = true;
  bool length = true;  ///< with moment and runs
  bool mip = false;
  bool reference = false;  ///< emission-absorption picture with `base`
  /// Blinn-Phong headlight on the reference: colour (0.3 + 0.7 |n·v|) + 0.2 |n·v|^32.
  bool phong = false;
  std::vector<double> isovalues{};  ///< depth layers; any order
  /// Skip bricks and tiles in which nothing happens. The result is the same; MIP to 2e-7 of
  /// the partition's range.
  bool skipEmptySpace = true;
  /// Position-dependent classification of what the base function makes, and of MIP: gamma at each
  /// sample, factor and shift at the middle of each step. Functions to blend to have no part.
  std::shared_ptr<const CustomVolume> custom{};
};

/// Depths of rays that meet nothing, and their channel.
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();
inline constexpr std::uint8_t kMiss = 255;

/// What the rays of a view gathered in a block, or in several after compositing. Planes are
/// [channel][pixel], pixels row by row from the top; vectors of what was not requested are empty.
struct RayImage {
  ImageSize size;
  int channels = 0;                  ///< of the partition
  std::vector<float> entry, exit;    ///< planar depth of the ray in the block; entry > exit = miss
  std::vector<float> attenuation;    ///< [channels] ∫_{f∈I_k} σ T ds
  std::vector<float> transmittance;  ///< [1] T at the exit; with attenuation or reference
  std::vector<float> length;         ///< [channels] ∫ 1[f∈I_k] ds, world
  std::vector<float> moment;         ///< [channels] ∫ Z 1[f∈I_k] ds / lengthUnitFor(domain)
  std::vector<float> runs;           ///< [channels] separate runs
  std::vector<std::uint8_t> first, last;  ///< [1] channel of the first and last run; kMiss = none
  std::vector<float> depth;               ///< [layers] planar Z of the first crossing, or +inf
  std::vector<float> normal;              ///< [layers * 3] unit, eye space, turned to the viewer
  std::vector<float> mip;                 ///< [1] largest value, held as mipScale says; NaN = none
  std::vector<float> reference;           ///< [3] premultiplied linear RGB
};

/// `front` over `back` (method §2): lengths, moments add; runs add less one where a run goes on
/// through the shared face; attenuation composes as a_front + T_front a_back; first crossings and
/// MIP by min and max. Associative; `front` is nearer to the viewer on every ray. The arguments
/// have the same size, channels and planes.
void compositeUnder(RayImage& front, const RayImage& back);

/// The indices of axis-aligned boxes with disjoint interiors, front to back for this camera: on
/// every ray that meets two of them, the nearer one comes first. Boxes that tile a domain as
/// simulations do always have such an order; where boxes hide one another in a ring, the ring is
/// broken at the box that the fewest others hide. Throws InvalidArgument for a multi-perspective
/// camera, whose rays have no common order: see RaySorter.
std::vector<std::size_t> visibilityOrder(std::span<const Box> boxes, const Camera& camera);

}  // namespace vestige
