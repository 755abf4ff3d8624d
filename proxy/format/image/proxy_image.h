// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proxy/camera/camera.h"
#include "proxy/customization/customization.h"
#include "proxy/format/image/feature_origin.h"
#include "proxy/format/image/field_grid.h"
#include "proxy/format/image/learned_origin.h"
#include "proxy/transfer/interval_partition.h"
#include "proxy/transfer/statistics.h"
#include "proxy/transfer/transfer_function.h"

namespace vestige {

inline constexpr int kSchemaVersion = 1;

/// The proxies of method §2 and §5, by the name they have in archives.
namespace kind {
inline constexpr std::string_view kAttenuation = "attenuation";
inline constexpr std::string_view kLength = "length";
inline constexpr std::string_view kDepth = "depth";
inline constexpr std::string_view kMip = "mip";
inline constexpr std::string_view kReference = "reference";
inline constexpr std::string_view kTraining = "training";
inline constexpr std::string_view kLearned = "learned";
inline constexpr std::string_view kLayered = "layered";
inline constexpr std::string_view kSliced = "sliced";
inline constexpr std::string_view kField = "field";
inline constexpr std::string_view kFeatures = "features";
inline constexpr std::string_view kSlicedFeatures = "sliced-features";
}  // namespace kind

/// Everything that a proxy says of itself; the EXR attributes of docs/archive-format.md.
struct ProxyHeader {
  std::string kind;
  std::string field;
  std::string units;  ///< of the field, may be empty
  double time = 0.0;
  long cycle = 0;
  std::string view;
  Camera camera;
  ImageSize size;
  Box domain;                                  ///< the whole domain, world units
  std::optional<IntervalPartition> partition;  ///< attenuation, length
  std::optional<TransferFunction> base;        ///< the run's base transfer function
  /// attenuation, mip, reference, layered: by position; not neutral, its seeds in the domain.
  std::optional<Customization> customization;
  std::vector<double> isovalues;   ///< depth: one per layer
  std::vector<double> slabDepths;  ///< sliced, sliced-features: planar, rising; one more than slabs
  std::optional<FieldGrid> grid;   ///< field
  std::string shading;  ///< reference, training, learned, layered: the light of their colours
  std::vector<TransferFunction> looks;    ///< training, learned: of each training picture
  std::optional<LearnedOrigin> learned;   ///< learned
  std::optional<FeatureOrigin> features;  ///< features, sliced-features; `field` is their name
  FieldStatistics statistics;
  std::string provenance;  ///< "vestige 0.1.0; ..." free text
  std::string note;        ///< what the user's config says about the run
  std::string owner;       ///< whose run it is, may be empty
};

enum class ChannelStorage { Half, Float };

/// A named plane of width x height values, row by row from the top. Missing = +infinity in depth
/// layers, 0 elsewhere.
struct Channel {
  std::string name;
  ChannelStorage storage = ChannelStorage::Float;
  std::vector<float> values;
};

/// Channels that are read together: one part of the EXR file.
///
/// kind         part           channels (names of IntervalPartition::channelName = K)
/// attenuation  attenuation    K..., T: fractions of light (method §2), Σ + T = 1;       half
/// length       length         K...: ℓ / unit;                                           half
///              depth          K...: mean depth (z̄ - zero) / unit, 0 where ℓ = 0;        half
///              runs           K...: number of separate runs;                            half
///              ends           first, last: 1 + the channel in which the ray enters and
///                             leaves the domain, 0 = miss; may be absent;               half
/// depth        layerMM        Z (world units, +inf = no hit; float), nx, ny, nz (unit, eye
///                             space, turned to the viewer; half), MM = 00..
/// mip          mip            value: in the field's units, NaN where no data;            float
/// reference    reference      R, G, B (linear, premultiplied, over nothing), A;          half
/// training     pictureMM      R, G, B, A as of `reference`, under header.looks[MM];           half
/// learned      table          value: a row a cluster: centroid [K], Jacobian of r, g and b
///                             [3 K], colour [3] (learned_layout.h);                     float
/// layered      layerMM        R, G, B: premultiplied linear light of layer MM alone;        half
///              tau            tMM: its optical depth along the ray;                     half
///              boundaries     zMM: planar depth of its near face; the last one is the
///                             far face of the last layer; 0 = the ray is empty;         half
///              state          state: AnalyticLayerState;                                      half
/// sliced       faces          fSS: 1 + rank (IntervalPartition::rankOf) in which the ray
///                             passes the face in front of slab SS, 0 = outside;         half
///              slabSS         below, i00 ...: share of the ray's stretch in slab SS with
///                             values under the upper bound of that channel; nodata: share
///                             without data; low, high: place of the lowest and highest
///                             rank's mean depth in the slab, 0 = at a face;             half
/// field        zfp            byte: the compressed samples, one byte a pixel, row by row;   half
///              nodata         byte: a bit a sample, low bits first, 1 = no data; absent
///                             where every sample has data;                              half
/// features     attenuation    the classifier's channels F...: fraction of light under the run's
/// look
///                             (feature_layout.h);                                       half
///              transmittance  T: what is left;                                          half
///              integral       F...: ∫ w ds;                                             half
///              depth          F...: mean depth as of `length`, 0 where ∫ w ds = 0;      half
/// sliced-      slabSS         F...: ∫ w ds over the ray's stretch in slab SS, as a share
/// features                    of that stretch;                                          half
/// A part's values are stored divided by `unit` after subtracting `zero`; readers undo it, so
/// in memory every channel is in the unit that the table gives and ℓ, z̄ are world units. Where
/// zero != 0 a stored 0 means missing and is 0 in memory. proxy_layout.h makes parts whose values
/// survive storage bit for bit.
struct ProxyPart {
  std::string name;
  double unit = 1.0;
  double zero = 0.0;
  double error = 0.0;  ///< largest absolute error of storage, in-memory unit; 0 = half rounding
  std::vector<Channel> channels;

  const Channel* find(std::string_view channel) const;
};

struct ProxyImage {
  ProxyHeader header;
  std::vector<ProxyPart> parts;

  const ProxyPart* find(std::string_view part) const;
  /// Throw NotFound naming the part or channel.
  const ProxyPart& part(std::string_view name) const;
  const Channel& channel(std::string_view part, std::string_view name) const;
};

}  // namespace vestige
