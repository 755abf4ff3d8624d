// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/transfer/transfer_function.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "proxy/base/error.h"

namespace vestige {
namespace {

[[noreturn]] void refuseFunction(const std::string& sentence) {
  throw Error(ErrorCode::InvalidArgument, sentence);
}

void checkOpacity(const std::vector<OpacityPoint>& points) {
  if (points.size() > TransferFunction::kMaxOpacityPoints)
    refuseFunction(fmt::format("opacity has {} points, more than {}", points.size(),
                               TransferFunction::kMaxOpacityPoints));
  for (const OpacityPoint& p : points) {
    if (!std::isfinite(p.value))
      refuseFunction(fmt::format("opacity has a point at value {}", p.value));
    if (!(p.opacity >= 0.0 && p.opacity <= 1.0))
      refuseFunction(fmt::format("opacity {} at value {} is not in [0, 1]", p.opacity, p.value));
  }
}

void checkColorRange(double low, double high) {
  if (!std::isfinite(low) || !std::isfinite(high) || low > high)
    refuseFunction(fmt::format("colorRange [{}, {}] is not finite and ordered", low, high));
}

/// (value - low) / (high - low) for low < high; halves keep huge ranges from overflowing.
double share(double value, double low, double high) {
  return (0.5 * value - 0.5 * low) / (0.5 * high - 0.5 * low);
}

/// Optical depth per reference length of a transparency u = 1 - opacity.
double opticalDepth(double u) { return std::min(-std::log(u), TransferFunction::kMaxOpticalDepth); }

// Five-point Gauss-Legendre rule on [0, 1].
constexpr int kNodes = 5;
constexpr double kNode[kNodes] = {0.046910077030668004, 0.23076534494715845, 0.5,
                                  0.76923465505284155, 0.953089922969332};
constexpr double kWeight[kNodes] = {0.11846344252809454, 0.23931433524968324, 0.28444444444444444,
                                    0.23931433524968324, 0.11846344252809454};

/// The mean of min(-ln u, kMaxOpticalDepth) while u runs linearly from u1 to u2, both in [0, 1].
double meanOpticalDepth(double u1, double u2) {
  const double clamp = std::exp(-TransferFunction::kMaxOpticalDepth);
  const double low = std::min(u1, u2), high = std::max(u1, u2);
  if (high <= clamp) return TransferFunction::kMaxOpticalDepth;
  if (high - low < 0.1 * high) {
    // Nearly constant: the closed form would cancel, and the rule is exact to rounding here.
    double mean = 0.0;
    for (int i = 0; i < kNodes; ++i)
      mean += kWeight[i] * opticalDepth(low + kNode[i] * (high - low));
    return mean;
  }
  // Closed form: the antiderivative of -ln u is u - u ln u; below `clamp` the integrand is flat.
  const double start = std::max(low, clamp);
  const auto antiderivative = [](double u) { return u - u * std::log(u); };
  const double flat = (start - low) * TransferFunction::kMaxOpticalDepth;
  return (flat + antiderivative(high) - antiderivative(start)) / (high - low);
}

/// Sum over pieces of an interval: extinction and extinction-weighted colour.
struct Accumulated {
  double width = 0.0, depth = 0.0;
  glm::dvec3 depthColor{0.0}, plainColor{0.0};
};

}  // namespace

TransferFunction::TransferFunction(std::vector<OpacityPoint> opacity, double referenceLength,
                                   Colormap colormap, double colorLow, double colorHigh)
    : referenceLength_(referenceLength), colormap_(std::move(colormap)) {
  if (!std::isfinite(referenceLength) || referenceLength <= 0.0)
    refuseFunction(fmt::format("referenceLength {} is not positive and finite", referenceLength));
  setOpacity(std::move(opacity));
  setColorRange(colorLow, colorHigh);
}

TransferFunction TransferFunction::ramp(double low, double high, double referenceLength,
                                        const std::string& colormap) {
  // A constant field gets the range that its partition has.
  const IntervalPartition range = IntervalPartition::uniform(low, high, 1);
  return TransferFunction({{range.denormalised(0.25), 0.0}, {range.high(), 0.5}}, referenceLength,
                          Colormap::named(colormap), range.low(), range.high());
}

void TransferFunction::setOpacity(std::vector<OpacityPoint> opacity) {
  checkOpacity(opacity);
  std::stable_sort(opacity.begin(), opacity.end(),
                   [](const auto& a, const auto& b) { return a.value < b.value; });
  opacity.erase(std::unique(opacity.begin(), opacity.end()), opacity.end());
  for (std::size_t i = 2; i < opacity.size(); ++i)
    if (opacity[i].value == opacity[i - 2].value)
      refuseFunction(fmt::format("opacity has more than two points at value {}", opacity[i].value));
  opacity_ = std::move(opacity);
}

void TransferFunction::setColorRange(double low, double high) {
  checkColorRange(low, high);
  colorLow_ = low;
  colorHigh_ = high;
}

void TransferFunction::setFactors(std::vector<double> factors) {
  if (factors.size() > std::size_t(IntervalPartition::kMaxIntervals))
    refuseFunction(fmt::format("factors are {}, more than {}", factors.size(),
                               IntervalPartition::kMaxIntervals));
  for (const double f : factors)
    if (!std::isfinite(f) || f < 0.0)
      refuseFunction(fmt::format("factors contain {}, not >= 0 and finite", f));
  factors_ = std::move(factors);
}

double TransferFunction::opacity(double value) const {
  if (opacity_.empty() || std::isnan(value)) return 0.0;
  const auto after =
      std::upper_bound(opacity_.begin(), opacity_.end(), value,
                       [](double v, const OpacityPoint& point) { return v < point.value; });
  if (after == opacity_.begin()) return opacity_.front().opacity;
  if (after == opacity_.end()) return opacity_.back().opacity;
  const OpacityPoint& before = *(after - 1);
  return std::lerp(before.opacity, after->opacity, share(value, before.value, after->value));
}

double extinctionOf(double opacity, double referenceLength) {
  return std::min(-std::log1p(-opacity), TransferFunction::kMaxOpticalDepth) / referenceLength;
}

double TransferFunction::extinction(double value) const {
  return extinctionOf(opacity(value), referenceLength_);
}

glm::dvec3 TransferFunction::color(double value) const {
  if (std::isnan(value)) return glm::dvec3(0.0);
  if (colorLow_ == colorHigh_)
    return colormap_.at(value < colorLow_ ? 0.0 : value > colorLow_ ? 1.0 : 0.5);
  return colormap_.at(share(value, colorLow_, colorHigh_));
}

namespace {

/// The values in (low, high) where opacity or colour bends, with both ends, increasing.
std::vector<double> breakpoints(const TransferFunction& f, double low, double high) {
  std::vector<double> values{low, high};
  const auto add = [&](double v) {
    if (v > low && v < high) values.push_back(v);
  };
  for (const OpacityPoint& point : f.opacityPoints()) add(point.value);
  const int knots = int(f.colormap().srgbColors().size());
  add(f.colorLow());
  for (int i = 1; i < knots; ++i)
    add(std::lerp(f.colorLow(), f.colorHigh(), double(i) / (knots - 1)));
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

/// Opacity just inside both ends of a piece [low, high] without a breakpoint in its inside.
std::pair<double, double> opacityAtEnds(const TransferFunction& f, double low, double high) {
  const auto& points = f.opacityPoints();
  // The first point at `high` is the left limit of a jump there.
  const auto at =
      std::lower_bound(points.begin(), points.end(), high,
                       [](const OpacityPoint& point, double v) { return point.value < v; });
  const bool onPoint = at != points.end() && at->value == high;
  return {f.opacity(low), onPoint ? at->opacity : f.opacity(high)};
}

Accumulated accumulate(const TransferFunction& f, double low, double high) {
  Accumulated sum;
  const std::vector<double> values = breakpoints(f, low, high);
  for (std::size_t i = 0; i + 1 < values.size(); ++i) {
    const double a = values[i], b = values[i + 1],
                 width = share(b, low, high) - share(a, low, high);
    const auto [opacityA, opacityB] = opacityAtEnds(f, a, b);
    const double depth = width * meanOpticalDepth(1.0 - opacityA, 1.0 - opacityB);
    // Colours are smooth within a piece: the rule gives their means, the closed form the weight.
    double weights = 0.0;
    glm::dvec3 weighted(0.0), plain(0.0);
    for (int n = 0; n < kNodes; ++n) {
      const glm::dvec3 color = f.color(std::lerp(a, b, kNode[n]));
      const double weight =
          kWeight[n] * opticalDepth(1.0 - std::lerp(opacityA, opacityB, kNode[n]));
      weights += weight;
      weighted += weight * color;
      plain += kWeight[n] * color;
    }
    sum.width += width;
    sum.depth += depth;
    sum.plainColor += width * plain;
    sum.depthColor += depth * (weights > 0.0 ? weighted / weights : plain);
  }
  return sum;
}

}  // namespace

IntervalLook TransferFunction::onIntervals(const IntervalPartition& partition) const {
  const int intervals = partition.intervals();
  if (!factors_.empty() && int(factors_.size()) != intervals)
    refuseFunction(
        fmt::format("factors are {}, the partition has {} intervals", factors_.size(), intervals));
  IntervalLook look;
  look.extinction.assign(partition.channels(), 0.0);
  look.color.assign(partition.channels(), glm::dvec3(0.0));
  for (int k = 0; k < intervals; ++k) {
    const Accumulated sum = accumulate(*this, partition.bounds()[k], partition.bounds()[k + 1]);
    const double factor = factors_.empty() ? 1.0 : factors_[k];
    look.extinction[k] = factor * sum.depth / sum.width / referenceLength_;
    look.color[k] = sum.depth > 0.0 ? sum.depthColor / sum.depth : sum.plainColor / sum.width;
  }
  look.extinction[partition.below()] = extinction(partition.low());
  look.extinction[partition.above()] = extinction(partition.high());
  look.color[partition.below()] = color(partition.low());
  look.color[partition.above()] = color(partition.high());
  return look;
}

std::vector<double> TransferFunction::opacityPeaks() const {
  std::vector<double> peaks;
  for (std::size_t first = 0; first < opacity_.size();) {
    const double height = opacity_[first].opacity;
    std::size_t last = first;
    while (last + 1 < opacity_.size() && opacity_[last + 1].opacity == height) ++last;
    const bool rises = first == 0 || opacity_[first - 1].opacity < height;
    const bool falls = last + 1 == opacity_.size() || opacity_[last + 1].opacity < height;
    if (height > 0.0 && rises && falls)
      peaks.push_back(std::lerp(opacity_[first].value, opacity_[last].value, 0.5));
    first = last + 1;
  }
  return peaks;
}

}  // namespace vestige
