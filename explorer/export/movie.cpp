// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/export/movie.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>

#include "explorer/export/subprocess.h"
#include "proxy/base/error.h"

namespace vestige {
namespace {

std::vector<std::string> encoderArguments(const std::filesystem::path& path, ImageSize size,
                                          double framesPerSecond) {
  char rate[32];
  std::snprintf(rate, sizeof rate, "%d/1000", int(std::lround(1000.0 * framesPerSecond)));
  std::vector<std::string> arguments{"ffmpeg",
                                     "-y",
                                     "-nostdin",
                                     "-loglevel",
                                     "error",
                                     "-f",
                                     "rawvideo",
                                     "-pix_fmt",
                                     "rgb24",
                                     "-s",
                                     std::to_string(size.width) + "x" + std::to_string(size.height),
                                     "-r",
                                     rate,
                                     "-i",
                                     "pipe:0",
                                     "-an"};
  const std::string extension = path.extension().string();
  if (extension == ".mp4" || extension == ".mkv" || extension == ".mov") {
    // Chroma is subsampled, so both sides must be even.
    for (const char* argument : {"-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-c:v", "libx264", "-crf",
                                 "18", "-pix_fmt", "yuv420p"}) {
      arguments.emplace_back(argument);
    }
    if (extension == ".mp4") arguments.insert(arguments.end(), {"-movflags", "+faststart"});
  }
  // A name that starts with '-' must not be taken for an option.
  arguments.push_back("file:" + path.string());
  return arguments;
}

std::vector<std::byte> rgbOf(const Picture& picture) {
  const Raster raster = rasterFromPicture(picture);
  std::vector<std::byte> rgb(3 * raster.size.pixels());
  for (std::size_t i = 0; i < raster.size.pixels(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) rgb[3 * i + c] = std::byte(raster.rgba[4 * i + c]);
  }
  return rgb;
}

/// The warnings of frames, each kind in the words of the first.
class MovieWarnings {
 public:
  explicit MovieWarnings(int frames) : frames_(frames) {}
  void add(const std::vector<Warning>& warnings) {
    for (const Warning& each : warnings) {
      const auto same = std::find_if(found_.begin(), found_.end(),
                                     [&](const auto& of) { return of.first.key == each.key; });
      if (same == found_.end()) {
        found_.emplace_back(each, 1);
      } else {
        ++same->second;
      }
    }
  }
  std::vector<Warning> all() const {
    std::vector<Warning> result;
    for (const auto& [warning, count] : found_) {
      result.push_back({warning.key, count == frames_ ? warning.text
                                                      : fmt::format("{} (in {} of {} frames)",
                                                                    warning.text, count, frames_)});
    }
    return result;
  }

 private:
  int frames_;
  std::vector<std::pair<Warning, int>> found_;
};

}  // namespace

std::vector<Look> looksOverTime(const Look& look, const Archive& archive) {
  std::vector<Look> looks;
  for (long cycle : archive.cycles()) {
    looks.push_back(look);
    looks.back().cycle = cycle;
    looks.back().time.reset();
  }
  return looks;
}

Look lookForAllSteps(Renderer& renderer, const Look& look, const Archive& archive) {
  if (!look.classifier.empty()) return look;
  std::vector<Look> each;
  for (const Look& step : looksOverTime(look, archive)) {
    each.push_back(renderer.resolved(step));
    if (!each.back().colorRange || !each.back().opacity) return look;  // features
  }
  const auto differs = [&](const auto key) {
    return std::any_of(each.begin(), each.end(),
                       [&](const Look& one) { return one.*key != each.front().*key; });
  };
  if (!differs(&Look::opacity) && !differs(&Look::colorRange)) return look;
  const auto width = [](const Look& one) { return one.colorRange->second - one.colorRange->first; };
  const Look& widest = *std::max_element(
      each.begin(), each.end(), [&](const Look& a, const Look& b) { return width(a) < width(b); });
  auto [low, high] = *widest.colorRange;
  for (const Look& one : each) {
    low = std::min(low, one.colorRange->first);
    high = std::max(high, one.colorRange->second);
  }
  Look result = look;
  result.colorRange = {low, high};
  result.opacity = widest.opacity;
  result.referenceLength = widest.referenceLength;
  if (differs(&Look::opacity) && width(widest) > 0.0) {
    for (OpacityPoint& point : *result.opacity) {
      const double place = (point.value - widest.colorRange->first) / width(widest);
      point.value = low + place * (high - low);
    }
  }
  return result;
}

std::vector<Look> looksOfTurn(const Look& look, double degrees, int frames) {
  if (frames < 2 || frames > 100000) {
    throw Error(ErrorCode::InvalidArgument,
                "a turn of " + std::to_string(frames) + " frames: 2 to 100000 are possible");
  }
  if (!std::isfinite(degrees) || degrees == 0.0) {
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("a turn of {:g} degrees: it must be finite and not 0", degrees));
  }
  std::vector<Look> looks;
  std::vector<Rotation> rotations;
  for (int i = 0; i < frames; ++i) {
    const double phase = double(i) / frames;
    const double azimuth = std::abs(degrees) >= 360.0
                               ? std::copysign(360.0, degrees) * phase
                               : 0.5 * degrees * std::sin(2.0 * std::numbers::pi * phase);
    looks.push_back(look);
    looks.back().rotate.azimuth = std::remainder(look.rotate.azimuth + azimuth, 360.0);
    // What draws turned views draws the one between as well: else a frame would stand out.
    if (looks.back().rotate.isZero()) looks.back().rotate.azimuth = 1e-6;
    rotations.push_back(looks.back().rotate);
  }
  // One frame for all, so that nothing pulsates.
  for (Look& each : looks) each.frameFor = rotations;
  return looks;
}

std::vector<Warning> writeMovie(const std::filesystem::path& path, Renderer& renderer,
                                const std::vector<Look>& looks, double framesPerSecond,
                                const std::function<void(int, int)>& progress) {
  if (looks.empty()) throw Error(ErrorCode::NotFound, "a movie needs at least one step");
  if (!(framesPerSecond >= 0.1 && framesPerSecond <= 240.0)) {
    throw Error(
        ErrorCode::InvalidArgument,
        fmt::format("a movie of {:g} frames a second: 0.1 to 240 are possible", framesPerSecond));
  }
  const int total = int(looks.size());
  if (progress) progress(0, total);
  Rendered first = renderer.render(looks.front());
  MovieWarnings warnings(total);
  const ImageSize size = first.picture.size;
  // Beside its place until it is whole, so that a failure leaves an earlier movie alone; ffmpeg
  // goes by the extension.
  auto unfinished = path;
  unfinished.replace_filename(path.stem().string() + ".part" + path.extension().string());
  try {
    Subprocess encoder(encoderArguments(unfinished, size, framesPerSecond));
    for (int i = 0; i < total; ++i) {
      Rendered rendered = i == 0 ? std::move(first) : renderer.render(looks[std::size_t(i)]);
      warnings.add(rendered.warnings);
      Picture picture = std::move(rendered.picture);
      if (picture.size != size) picture = fitted(picture, size);
      placeOver(picture, glm::dvec3(0.0));
      encoder.write(rgbOf(picture));
      if (progress) progress(i + 1, total);
    }
    encoder.finish();
    std::filesystem::rename(unfinished, path);
  } catch (const Error& error) {
    std::error_code ignored;
    std::filesystem::remove(unfinished, ignored);
    throw Error(error.code(), "movie '" + path.string() + "' cannot be made: " + error.what());
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(unfinished, ignored);
    throw;
  }
  return warnings.all();
}

}  // namespace vestige
