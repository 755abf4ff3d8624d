// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/picture/metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "proxy/base/error.h"

namespace vestige {
namespace {

[[noreturn]] void refuse(const std::string& sentence) {
  throw Error(ErrorCode::InvalidArgument, sentence);
}

PixelRect checkedRect(const RgbView& a, const RgbView& b, const std::optional<PixelRect>& rect) {
  if (a.size != b.size)
    refuse(fmt::format("pictures of {} x {} and {} x {} cannot be compared", a.size.width,
                       a.size.height, b.size.width, b.size.height));
  const PixelRect r = rect.value_or(PixelRect{0, 0, a.size.width, a.size.height});
  if (r.x < 0 || r.y < 0 || r.width < 1 || r.height < 1 || r.width > a.size.width - r.x ||
      r.height > a.size.height - r.y)
    refuse(fmt::format("rectangle {} x {} at ({}, {}) does not lie in a picture of {} x {}",
                       r.width, r.height, r.x, r.y, a.size.width, a.size.height));
  return r;
}

/// One row of a channel inside the rectangle, clamped to [0, 1].
void loadRow(const RgbView& picture, int channel, const PixelRect& r, int y, float* out) {
  const float* in =
      picture.channels[channel] + (std::ptrdiff_t(y) * picture.size.width + r.x) * picture.stride;
  for (int i = 0; i < r.width; ++i) {
    const float v = in[i * picture.stride];
    if (std::isnan(v)) refuse(fmt::format("pixel ({}, {}) is not a number", r.x + i, y));
    out[i] = std::clamp(v, 0.0f, 1.0f);
  }
}

/// Half of a normalised Gaussian window: weights of the middle pixel and its neighbours outward.
std::vector<float> windowWeights(int extent) {
  constexpr double kSigma = 1.5;
  const int radius = std::min(5, (extent - 1) / 2);
  std::vector<double> exact(radius + 1);
  double sum = 0.0;
  for (int i = 0; i <= radius; ++i) {
    exact[i] = std::exp(-i * i / (2.0 * kSigma * kSigma));
    sum += i == 0 ? exact[i] : 2.0 * exact[i];
  }
  std::vector<float> weights;
  for (const double w : exact) weights.push_back(float(w / sum));
  return weights;
}

/// Weighted sum of 2 * radius + 1 equally long rows, `in` being the middle one and `step` floats
/// apart. Rows outside, pixels inside, so that the inner loop is a plain vector operation.
void filter(const std::vector<float>& weights, const float* in, std::ptrdiff_t step, int count,
            float* out) {
  for (int i = 0; i < count; ++i) out[i] = weights[0] * in[i];
  for (std::size_t k = 1; k < weights.size(); ++k) {
    const float w = weights[k];
    const float* before = in - std::ptrdiff_t(k) * step;
    const float* after = in + std::ptrdiff_t(k) * step;
    for (int i = 0; i < count; ++i) out[i] += w * (before[i] + after[i]);
  }
}

/// SSIM of one channel. It depends on the two pictures only by the moments of p = a + b and
/// q = a - b: mu_a mu_b = (mu_p^2 - mu_q^2) / 4, mu_a^2 + mu_b^2 = (mu_p^2 + mu_q^2) / 2, and
/// likewise for the variances: four filters instead of five.
class ChannelSsim {
 public:
  explicit ChannelSsim(const PixelRect& r)
      : rect_(r),
        across_(windowWeights(r.width)),
        down_(windowWeights(r.height)),
        windowsX_(r.width - 2 * int(across_.size() - 1)),
        rowLength_(kMoments * std::size_t(windowsX_)),
        source_(kMoments * std::size_t(r.width)),
        moments_(rowLength_) {}

  double mean(const RgbView& a, const RgbView& b, int channel) {
    const int radius = int(down_.size()) - 1;
    // All rows of the rectangle, filtered across; then filtered down as they are needed.
    filtered_.resize(rowLength_ * std::size_t(rect_.height));
    for (int y = 0; y < rect_.height; ++y) filterRow(a, b, channel, y);
    double sum = 0.0;
    for (int y = radius; y < rect_.height - radius; ++y) {
      filter(down_, filtered_.data() + y * rowLength_, std::ptrdiff_t(rowLength_), int(rowLength_),
             moments_.data());
      sum += rowSum();
    }
    return sum / (double(windowsX_) * (rect_.height - 2 * radius));
  }

 private:
  static constexpr int kMoments = 4;  // p, q, p^2, q^2

  void filterRow(const RgbView& a, const RgbView& b, int channel, int y) {
    const int n = rect_.width;
    float* p = source_.data();
    float *q = p + n, *pp = q + n, *qq = pp + n;
    loadRow(a, channel, rect_, rect_.y + y, pp);
    loadRow(b, channel, rect_, rect_.y + y, qq);
    for (int i = 0; i < n; ++i) {
      p[i] = pp[i] + qq[i];
      q[i] = pp[i] - qq[i];
    }
    for (int i = 0; i < n; ++i) {
      pp[i] = p[i] * p[i];
      qq[i] = q[i] * q[i];
    }
    const std::size_t radius = across_.size() - 1;
    for (int m = 0; m < kMoments; ++m)
      filter(across_, source_.data() + m * std::size_t(n) + radius, 1, windowsX_,
             filtered_.data() + y * rowLength_ + m * std::size_t(windowsX_));
  }

  double rowSum() const {
    constexpr float kC1 = 0.01f * 0.01f, kC2 = 0.03f * 0.03f;
    const int n = windowsX_;
    const float* p = moments_.data();
    const float *q = p + n, *pp = q + n, *qq = pp + n;
    double sum = 0.0;
    for (int i = 0; i < n; ++i) {
      const float p2 = p[i] * p[i], q2 = q[i] * q[i];
      const float varP = pp[i] - p2, varQ = qq[i] - q2;
      const float luminance = (0.5f * (p2 - q2) + kC1) / (0.5f * (p2 + q2) + kC1);
      const float structure = (0.5f * (varP - varQ) + kC2) / (0.5f * (varP + varQ) + kC2);
      sum += double(luminance * structure);
    }
    return sum;
  }

  PixelRect rect_;
  std::vector<float> across_, down_;
  int windowsX_;
  std::size_t rowLength_;
  std::vector<float> source_, moments_, filtered_;
};

}  // namespace

RgbView RgbView::interleaved(ImageSize size, std::span<const float> values, int floatsPerPixel) {
  if (size.width < 1 || size.height < 1 || floatsPerPixel < 3 ||
      values.size() != size.pixels() * std::size_t(floatsPerPixel))
    refuse(fmt::format("{} floats are no picture of {} x {} pixels of {} floats", values.size(),
                       size.width, size.height, floatsPerPixel));
  return {size, {values.data(), values.data() + 1, values.data() + 2}, floatsPerPixel};
}

RgbView RgbView::planar(ImageSize size, std::span<const float> red, std::span<const float> green,
                        std::span<const float> blue) {
  for (const auto& plane : {red, green, blue})
    if (size.width < 1 || size.height < 1 || plane.size() != size.pixels())
      refuse(fmt::format("a plane of {} floats is no picture of {} x {}", plane.size(), size.width,
                         size.height));
  return {size, {red.data(), green.data(), blue.data()}, 1};
}

double psnr(const RgbView& a, const RgbView& b, const std::optional<PixelRect>& rect) {
  const PixelRect r = checkedRect(a, b, rect);
  std::vector<float> rowA(r.width), rowB(r.width);
  double squares = 0.0;
  for (int channel = 0; channel < 3; ++channel)
    for (int y = r.y; y < r.y + r.height; ++y) {
      loadRow(a, channel, r, y, rowA.data());
      loadRow(b, channel, r, y, rowB.data());
      for (int i = 0; i < r.width; ++i) {
        const double difference = double(rowA[i]) - double(rowB[i]);
        squares += difference * difference;
      }
    }
  if (squares == 0.0) return std::numeric_limits<double>::infinity();
  return -10.0 * std::log10(squares / (3.0 * r.width * r.height));
}

double ssim(const RgbView& a, const RgbView& b, const std::optional<PixelRect>& rect) {
  ChannelSsim channel(checkedRect(a, b, rect));
  return (channel.mean(a, b, 0) + channel.mean(a, b, 1) + channel.mean(a, b, 2)) / 3.0;
}

double dssim(const RgbView& a, const RgbView& b, const std::optional<PixelRect>& rect) {
  return 0.5 * (1.0 - ssim(a, b, rect));
}

std::optional<PixelRect> projectedRect(const Camera& camera, const Box& box, ImageSize size) {
  glm::dvec2 low(std::numeric_limits<double>::infinity()), high(-low);
  for (int i = 0; i < 8; ++i) {
    const glm::dvec2 pixel(camera.project(box.corner(i), size));
    low = {std::min(low.x, pixel.x), std::min(low.y, pixel.y)};
    high = {std::max(high.x, pixel.x), std::max(high.y, pixel.y)};
  }
  // Clamp as doubles: a far camera's pixels need not fit an int.
  const auto edge = [](double v, int extent) { return int(std::clamp(v, 0.0, double(extent))); };
  const int x0 = edge(std::floor(low.x), size.width), x1 = edge(std::ceil(high.x), size.width);
  const int y0 = edge(std::floor(low.y), size.height), y1 = edge(std::ceil(high.y), size.height);
  if (x0 >= x1 || y0 >= y1) return {};
  return PixelRect{x0, y0, x1 - x0, y1 - y0};
}

}  // namespace vestige
