// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/march/ray_planes.h"
#include "proxy/format/layout/proxy_layout.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

namespace vestige {
namespace {

/// Hands out the planes of a band of rows, one after another.
class BandReader {
 public:
  BandReader(const float* planes, ImageSize size, int firstRow, int rows)
      : next_(planes),
        first_(std::size_t(firstRow) * std::size_t(size.width)),
        count_(std::size_t(rows) * std::size_t(size.width)),
        pixels_(size.pixels()) {}

  template <typename Convert>
  void take(std::size_t plane, auto& to, const Convert& convert) {
    auto* out = to.data() + plane * pixels_ + first_;
    for (std::size_t i = 0; i < count_; ++i) out[i] = convert(next_[i]);
    next_ += count_;
  }
  void take(std::vector<float>& to) {
    for (std::size_t plane = 0; plane * pixels_ < to.size(); ++plane) {
      std::memcpy(to.data() + plane * pixels_ + first_, next_, count_ * sizeof(float));
      next_ += count_;
    }
  }

 private:
  const float* next_;
  std::size_t first_, count_, pixels_;
};

}  // namespace

RayImage emptyImage(const MarchRequest& request) {
  const std::size_t pixels = request.size.pixels();
  const std::size_t channels = std::size_t(request.partition.channels());
  RayImage image;
  image.size = request.size;
  image.channels = int(channels);
  image.entry.assign(pixels, kInfinity);
  image.exit.assign(pixels, -kInfinity);
  if (request.length || request.attenuation) {
    image.first.assign(pixels, 255);
    image.last.assign(pixels, 255);
  }
  if (request.length) {
    image.length.resize(channels * pixels);
    image.moment.resize(channels * pixels);
    image.runs.resize(channels * pixels);
  }
  if (request.attenuation) {
    image.attenuation.resize(channels * pixels);
  }
  if (request.attenuation || request.reference) image.transmittance.assign(pixels, 1.0f);
  image.depth.assign(request.isovalues.size() * pixels, kInfinity);
  image.normal.resize(request.isovalues.size() * 3 * pixels);
  if (request.mip) image.mip.assign(pixels, std::numeric_limits<float>::quiet_NaN());
  if (request.reference) image.reference.resize(3 * pixels);
  return image;
}

std::size_t planeCount(const MarchRequest& request) {
  const std::size_t channels = std::size_t(request.partition.channels());
  std::size_t count = 2 + 4 * request.isovalues.size();
  if (request.length || request.attenuation) count += 2;
  if (request.length) count += 3 * channels;
  if (request.attenuation) count += channels;
  if (request.attenuation || request.reference) count += 1;
  if (request.mip) count += 1;
  if (request.reference) count += 3;
  return count;
}

void takePlanes(const float* planes, const MarchRequest& request, int firstRow, int rows,
                RayImage& image) {
  BandReader reader(planes, request.size, firstRow, rows);
  reader.take(image.entry);
  reader.take(image.exit);
  if (!image.first.empty()) {
    const auto channel = [](float c) { return std::uint8_t(c); };
    reader.take(0, image.first, channel);
    reader.take(0, image.last, channel);
  }
  reader.take(image.length);
  reader.take(image.moment);
  reader.take(image.runs);
  reader.take(image.attenuation);
  reader.take(image.transmittance);
  for (std::size_t m = 0; m < request.isovalues.size(); ++m) {
    reader.take(m, image.depth,
                [](float z) { return z == 0.0f ? std::numeric_limits<float>::infinity() : z; });
  }
  reader.take(image.normal);
  if (!image.mip.empty()) {
    const StorageScale scale = mipScale(request.partition);
    reader.take(0, image.mip, [&](float v) {
      return std::isinf(v)
                 ? std::numeric_limits<float>::quiet_NaN()
                 : float((request.partition.denormalised(double(v)) - scale.zero) / scale.unit);
    });
  }
  reader.take(image.reference);
}

}  // namespace vestige
