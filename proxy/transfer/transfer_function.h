// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <glm/vec3.hpp>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "proxy/transfer/colormap.h"
#include "proxy/transfer/interval_partition.h"

namespace vestige {

/// A control point: opacity in [0, 1] per reference length at a value in the field's units.
/// Opacity 1 means an extinction of kMaxOpticalDepth per reference length.
struct OpacityPoint {
  double value;
  double opacity;
  friend bool operator==(const OpacityPoint&, const OpacityPoint&) = default;
};

/// What a transfer function is on each channel of a partition: the means over the interval.
struct IntervalLook {
  std::vector<double> extinction;  ///< [channels], 1 / world unit; noData is 0
  std::vector<glm::dvec3> color;   ///< [channels], linear RGB, extinction-weighted mean
};

/// Opacity and colour of a scalar, in the field's units (method §1). Piecewise-linear in opacity
/// per reference length; constant beyond the first and last point; no point at all = transparent.
/// Two points that share a value are a jump, which belongs to the second. NaN is transparent.
/// Constructor and setters sort the points and throw InvalidArgument naming the value unless all
/// are finite, opacities are in [0, 1], no three points share a value, points are at most
/// kMaxOpacityPoints, the reference length is positive, colorLow <= colorHigh and factors >= 0.
class TransferFunction {
 public:
  static constexpr double kMaxOpticalDepth = 20.0;
  static constexpr std::size_t kMaxOpacityPoints = 10000;

  TransferFunction(std::vector<OpacityPoint> opacity, double referenceLength, Colormap colormap,
                   double colorLow, double colorHigh);
  /// The default look of data in [low, high]: a ramp that hides the lower quarter.
  static TransferFunction ramp(double low, double high, double referenceLength,
                               const std::string& colormap = "viridis");

  /// -ln(1 - opacity) / referenceLength, 1 / world unit, clamped as stated above.
  double extinction(double value) const;
  double opacity(double value) const;
  /// Linear RGB.
  glm::dvec3 color(double value) const;
  /// Interval means of the extinction (exact), times `factors` (empty = all 1; else one >= 0 for
  /// each interval, method §2 "opacity change"); below and above take the value at the outer
  /// bounds, without a factor. The colour of a transparent interval is its plain mean. Throws
  /// InvalidArgument when there are factors, but not one for each interval.
  IntervalLook onIntervals(const IntervalPartition& partition) const;
  /// The values where opacity peaks: local maxima of the control points (method §2, depth
  /// proxies); the middle of a plateau. The first and last point count when they are highest.
  std::vector<double> opacityPeaks() const;

  const std::vector<OpacityPoint>& opacityPoints() const { return opacity_; }
  double referenceLength() const { return referenceLength_; }
  const Colormap& colormap() const { return colormap_; }
  double colorLow() const { return colorLow_; }
  double colorHigh() const { return colorHigh_; }
  const std::vector<double>& factors() const { return factors_; }
  void setFactors(std::vector<double> factors);
  void setOpacity(std::vector<OpacityPoint> opacity);
  void setColormap(Colormap colormap) { colormap_ = std::move(colormap); }
  void setColorRange(double low, double high);

 private:
  std::vector<OpacityPoint> opacity_;  ///< sorted by value
  double referenceLength_;
  Colormap colormap_;
  double colorLow_, colorHigh_;
  std::vector<double> factors_;
};

/// {"opacity": [[value, opacity], ...], "referenceLength": d, "colormap": name or [[r,g,b], ...],
///  "colorRange": [low, high], "factors": [...]}; "factors" is optional, a colour list is sRGB.
/// Reading throws Config naming the key that is missing, unknown or makes no sense.
nlohmann::json toJson(const TransferFunction& function);
TransferFunction transferFunctionFromJson(const nlohmann::json& json);
/// "v:o,v:o,..." as on command lines; throws Config naming the piece that does not parse.
std::vector<OpacityPoint> opacityFromText(const std::string& text);

/// Of an opacity in [0, 1] per reference length: -ln(1 - opacity) / referenceLength, 1 / world
/// unit, at most TransferFunction::kMaxOpticalDepth / referenceLength.
double extinctionOf(double opacity, double referenceLength);

}  // namespace vestige
