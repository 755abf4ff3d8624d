// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/picture/picture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "proxy/transfer/colormap.h"
#include "proxy/base/durable_file.h"
#include "proxy/base/error.h"
#include "proxy/format/exr/exr_file.h"
#include "proxy/base/parallel.h"
#include "proxy/format/exr/png_file.h"

namespace vestige {
namespace {

constexpr const char* kPicturePart = "picture";
constexpr std::array<const char*, 4> kChannelNames{"R", "G", "B", "A"};

/// sRGB bytes of linear [0, 1], tabulated finely enough that every byte is the nearest one.
class SrgbTable {
 public:
  SrgbTable() {
    for (int i = 0; i <= kSteps; ++i) {
      const double linear = double(i) / kSteps;
      bytes_[std::size_t(i)] =
          std::uint8_t(std::lround(255.0 * srgbFromLinear(glm::dvec3(linear)).x));
    }
  }
  std::uint8_t operator()(float linear) const {
    const float clamped = std::clamp(linear, 0.0f, 1.0f);  // NaN becomes 0 by the test below
    return bytes_[clamped == clamped ? std::size_t(clamped * float(kSteps) + 0.5f) : 0];
  }

 private:
  static constexpr int kSteps = 1 << 14;
  std::array<std::uint8_t, kSteps + 1> bytes_{};
};

/// The weights with which source samples make target sample `index` along one axis.
struct Taps {
  int first = 0;
  std::vector<float> weights;
};

/// Of the source's [from, to], its own ends repeated by no more than half a sample.
std::vector<Taps> axisTaps(int source, int target, double from, double to) {
  std::vector<Taps> taps(static_cast<std::size_t>(target));
  const double scale = (to - from) / double(target);
  const double radius = std::max(1.0, scale);  // a tent as wide as the coarser of the two grids
  for (int i = 0; i < target; ++i) {
    const double center = from + (i + 0.5) * scale - 0.5;
    if (center < -0.5 - 1e-9 || center > source - 0.5 + 1e-9) continue;
    const int first = int(std::ceil(center - radius)), last = int(std::floor(center + radius));
    Taps& tap = taps[std::size_t(i)];
    tap.first = std::clamp(first, 0, source - 1);
    tap.weights.assign(std::size_t(std::clamp(last, 0, source - 1) - tap.first + 1), 0.0f);
    double sum = 0.0;
    for (int j = first; j <= last; ++j) sum += std::max(0.0, 1.0 - std::abs(j - center) / radius);
    for (int j = first; j <= last; ++j) {
      const double weight = std::max(0.0, 1.0 - std::abs(j - center) / radius) / sum;
      tap.weights[std::size_t(std::clamp(j, 0, source - 1) - tap.first)] += float(weight);
    }
  }
  return taps;
}

Picture resampled(const Picture& picture, glm::dvec2 low, glm::dvec2 high, ImageSize size) {
  const auto across = axisTaps(picture.size.width, size.width, low.x, high.x);
  const auto down = axisTaps(picture.size.height, size.height, low.y, high.y);
  Picture wide = Picture::blank({size.width, picture.size.height});
  parallelRanges(wide.size.height, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const Taps& tap = across[std::size_t(x)];
        for (std::size_t i = 0; i < tap.weights.size(); ++i) {
          const float* from = picture.pixel(tap.first + int(i), y);
          for (int c = 0; c < 4; ++c) wide.pixel(x, y)[c] += tap.weights[i] * from[c];
        }
      }
    }
  });
  Picture result = Picture::blank(size);
  parallelRanges(size.height, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      const Taps& tap = down[std::size_t(y)];
      for (std::size_t i = 0; i < tap.weights.size(); ++i) {
        const float* from = wide.pixel(0, tap.first + int(i));
        float* to = result.pixel(0, y);
        for (int c = 0; c < 4 * size.width; ++c) to[c] += tap.weights[i] * from[c];
      }
    }
  });
  return result;
}

ProxyImage imageFromPicture(const Picture& picture) {
  ProxyImage image;
  image.header.kind = kPicturePart;
  image.header.field = "picture";
  image.header.view = "picture";
  image.header.size = picture.size;
  ProxyPart part;
  part.name = kPicturePart;
  for (std::size_t c = 0; c < 4; ++c) {
    Channel channel{kChannelNames[c], ChannelStorage::Float, {}};
    channel.values.resize(picture.size.pixels());
    for (std::size_t i = 0; i < channel.values.size(); ++i) {
      channel.values[i] = picture.rgba[4 * i + c];
    }
    part.channels.push_back(std::move(channel));
  }
  image.parts.push_back(std::move(part));
  return image;
}

Picture pictureFromExr(const std::filesystem::path& path) {
  const ExrFile file(path);
  const std::string name = file.has(kPicturePart) ? kPicturePart : std::string(kind::kReference);
  if (!file.has(name)) {
    throw Error(ErrorCode::Format, path.string() + " holds no picture (it is a proxy of kind '" +
                                       file.header().kind + "'); render it first");
  }
  const ProxyPart part = file.part(name);
  Picture picture = Picture::blank(file.header().size);
  for (std::size_t c = 0; c < 4; ++c) {
    const Channel* channel = part.find(kChannelNames[c]);
    if (!channel) {
      throw Error(ErrorCode::Format, path.string() + " has no channel '" + kChannelNames[c] + "'");
    }
    for (std::size_t i = 0; i < channel->values.size(); ++i) {
      picture.rgba[4 * i + c] = channel->values[i];
    }
  }
  return picture;
}

}  // namespace

Picture Picture::blank(ImageSize size) {
  return {size, std::vector<float>(4 * size.pixels(), 0.0f)};
}

void placeOver(Picture& front, const Picture& back) {
  if (front.size != back.size) {
    throw Error(ErrorCode::InvalidArgument, "pictures of different sizes cannot be composited");
  }
  for (std::size_t i = 0; i < front.rgba.size(); i += 4) {
    const float transmittance = 1.0f - front.rgba[i + 3];
    for (std::size_t c = 0; c < 4; ++c) front.rgba[i + c] += transmittance * back.rgba[i + c];
  }
}

void placeOver(Picture& front, glm::dvec3 backgroundLinear) {
  const glm::vec3 back(backgroundLinear);
  parallelRanges(front.size.height, [&](int begin, int end) {
    float* const last = front.pixel(0, end - 1) + 4 * std::size_t(front.size.width);
    for (float* pixel = front.pixel(0, begin); pixel != last; pixel += 4) {
      const float transmittance = 1.0f - pixel[3];
      for (int c = 0; c < 3; ++c) pixel[c] += transmittance * back[c];
      pixel[3] = 1.0f;
    }
  });
}

Picture fitted(const Picture& picture, ImageSize size, double pixelAspect) {
  if (picture.size == size && pixelAspect == 1.0) return picture;
  const double width = picture.size.width * pixelAspect, height = picture.size.height;
  const double scale = std::min(size.width / width, size.height / height);
  const ImageSize inner{std::clamp(int(std::lround(width * scale)), 1, size.width),
                        std::clamp(int(std::lround(height * scale)), 1, size.height)};
  Picture small =
      resampled(picture, glm::dvec2(0.0), {picture.size.width, picture.size.height}, inner);
  if (inner == size) return small;
  Picture result = Picture::blank(size);
  const int x0 = (size.width - inner.width) / 2, y0 = (size.height - inner.height) / 2;
  for (int y = 0; y < inner.height; ++y) {
    std::copy_n(small.pixel(0, y), 4 * std::size_t(inner.width), result.pixel(x0, y + y0));
  }
  return result;
}

Picture windowed(const Picture& picture, glm::dvec2 low, glm::dvec2 high, ImageSize size) {
  return resampled(picture, low, high, size);
}

Raster rasterFromPicture(const Picture& picture) {
  static const SrgbTable srgb;
  Raster raster{picture.size, std::vector<std::uint8_t>(picture.rgba.size())};
  parallelRanges(picture.size.height, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      const float* from = picture.pixel(0, y);
      std::uint8_t* to = raster.rgba.data() + 4 * std::size_t(y) * std::size_t(picture.size.width);
      for (int x = 0; x < picture.size.width; ++x, from += 4, to += 4) {
        const float alpha = from[3];
        const float scale = alpha > 0.0f && alpha < 1.0f ? 1.0f / alpha : 1.0f;
        for (int c = 0; c < 3; ++c) to[c] = srgb(from[c] * scale);
        to[3] = std::uint8_t(std::clamp(alpha, 0.0f, 1.0f) * 255.0f + 0.5f);
      }
    }
  });
  return raster;
}

Picture pictureFromRaster(const Raster& raster) {
  std::array<float, 256> linear;
  for (int i = 0; i < 256; ++i) {
    linear[std::size_t(i)] = float(linearFromSrgb(glm::dvec3(i / 255.0)).x);
  }
  Picture picture = Picture::blank(raster.size);
  for (std::size_t i = 0; i < raster.rgba.size(); i += 4) {
    const float alpha = float(raster.rgba[i + 3]) / 255.0f;
    for (std::size_t c = 0; c < 3; ++c) picture.rgba[i + c] = alpha * linear[raster.rgba[i + c]];
    picture.rgba[i + 3] = alpha;
  }
  return picture;
}

void writePicture(const std::filesystem::path& path, const Picture& picture) {
  const std::string extension = path.extension().string();
  if (extension == ".png") {
    writePng(path, rasterFromPicture(picture));
  } else if (extension == ".exr") {
    writeDurably(path, encodeExr(imageFromPicture(picture)));
  } else {
    throw Error(ErrorCode::InvalidArgument,
                "'" + path.string() + "': pictures are written as .png or .exr");
  }
}

Picture readPicture(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  if (extension == ".png") return pictureFromRaster(readPng(path));
  if (extension == ".exr") return pictureFromExr(path);
  throw Error(ErrorCode::InvalidArgument,
              "'" + path.string() + "': pictures are read from .png or .exr");
}

}  // namespace vestige
