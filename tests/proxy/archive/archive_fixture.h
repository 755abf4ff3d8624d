// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <sstream>
#include <string>

#include "proxy/archive/archive.h"
#include "proxy/base/error.h"
#include "proxy/format/layout/analytic_layers_layout.h"
#include "proxy/format/layout/field_layout.h"
#include "proxy/format/layout/proxy_layout.h"
#include "proxy/format/layout/sliced_stack.h"

namespace vestige::test {

namespace fs = std::filesystem;

/// A folder of its own for each test, gone afterwards.
class Folder {
 public:
  Folder() {
    std::string pattern = (fs::temp_directory_path() / "vestige-archive-XXXXXX").string();
    path_ = ::mkdtemp(pattern.data());
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  fs::path operator/(const std::string& name) const { return path_ / name; }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

inline std::string contents(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}
inline void overwrite(const fs::path& path, std::string_view text) {
  fs::remove(
      path);  // a new file: ext4 writes one that is truncated and filled again to disk at once
  std::ofstream(path, std::ios::binary) << text;
}

/// Expects an Error of this code whose sentence has these words.
inline void expectError(ErrorCode code, const std::string& words,
                        const std::function<void()>& act) {
  try {
    act();
    FAIL() << "nothing was thrown; expected a sentence with '" << words << "'";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), code) << e.what();
    EXPECT_NE(std::string(e.what()).find(words), std::string::npos) << e.what();
  }
}

inline ProxyHeader someHeader(ImageSize size = {40, 30}) {
  ProxyHeader h;
  h.kind = kind::kLength;
  h.field = "temperature";
  h.units = "K";
  h.time = 0.1;
  h.cycle = 10;
  h.view = "front";
  h.domain = {{-1.0, 0.25, 1.0 / 3.0}, {1.0, 2.0, 3.7}};
  h.size = size;
  h.camera = frameBox(h.domain, {0.3, 1.0, -0.2}, {0.0, 0.0, 1.0}, size.aspect());
  h.partition = IntervalPartition::uniform(0.1, 0.7, 3);
  h.base = TransferFunction::ramp(0.1, 0.7, h.domain.diagonal() / 100.0);
  h.isovalues = {0.2, 1.0 / 3.0};
  h.statistics = {1000, 3, 0.1, 0.7, 1.0 / 3.0, 0.123456789, {1, 2, 3, 994}};
  h.provenance = "vestige test";
  h.note = "a note, with \"quotes\" and é";
  h.owner = "somebody";
  return h;
}

/// Planes of a round thing in the middle; `phase` shifts values.
struct Planes {
  std::vector<float> attenuation, transmittance, length, moment, runs, depth, normal, mip, rgb;

  Planes(const ProxyHeader& h, double phase = 0.0) {
    const std::size_t n = h.size.pixels(), K = std::size_t(h.partition->channels());
    const double d = h.domain.diagonal();
    const DepthRange range = depthRange(h.camera, h.domain);
    attenuation.resize(K * n), length.resize(K * n), moment.resize(K * n), runs.resize(K * n);
    transmittance.assign(n, 1.0f);
    mip.assign(n, std::numeric_limits<float>::quiet_NaN());
    rgb.resize(3 * n);
    const std::size_t layers = h.isovalues.size();
    depth.assign(layers * n, std::numeric_limits<float>::infinity());
    normal.resize(layers * 3 * n);
    for (int y = 0; y < h.size.height; ++y)
      for (int x = 0; x < h.size.width; ++x) {
        const std::size_t i = std::size_t(y) * std::size_t(h.size.width) + std::size_t(x);
        const double u = 2.4 * (x + 0.5) / h.size.width - 1.2,
                     v = 2.4 * (y + 0.5) / h.size.height - 1.2, r2 = u * u + v * v;
        if (r2 >= 1.0) continue;
        const double chord = std::sqrt(1.0 - r2), wave = 0.5 + 0.4 * std::sin(7 * u + phase);
        double light = 1.0;
        for (std::size_t k = 0; k + 1 < K; ++k) {  // nothing without data
          const double share = (k == 0 ? wave : (1.0 - wave) / double(K - 2));
          length[k * n + i] = float(0.4 * d * chord * share);
          const double z = range.low + (range.high - range.low) * (0.5 + 0.3 * u * v);
          moment[k * n + i] = float(z * length[k * n + i]);
          runs[k * n + i] = float(1 + (x / 7) % 3);
          const double a = light * (1.0 - std::exp(-0.5 * chord * share));
          attenuation[k * n + i] = float(a);
          light -= a;
        }
        transmittance[i] = float(light);
        mip[i] = float(0.1 + 0.6 * wave * chord);
        for (std::size_t c = 0; c < 3; ++c)
          rgb[c * n + i] = float((1 - light) * wave / double(c + 1));
        for (std::size_t m = 0; m < layers; ++m) {
          const double near = range.low + (range.high - range.low) * (0.5 - 0.4 * chord);
          depth[m * n + i] = float(near + 0.01 * d * double(m));
          normal[(m * 3 + 0) * n + i] = float(u);
          normal[(m * 3 + 1) * n + i] = float(-v);
          normal[(m * 3 + 2) * n + i] = float(chord);
        }
      }
  }
};

/// One image of every kind.
inline std::vector<ProxyImage> someImages(ProxyHeader h, double phase = 0.0) {
  Planes p(h, phase);
  std::vector<ProxyImage> images;
  images.push_back(attenuationImage(h, p.attenuation, p.transmittance));
  images.push_back(lengthImage(h, p.length, p.moment, p.runs));
  images.push_back(depthImage(h, p.depth, p.normal));
  images.push_back(mipImage(h, p.mip));
  images.push_back(referenceImage(h, p.rgb, p.transmittance));
  return images;
}

inline Raster someRaster(ImageSize size = {8, 6}) {
  Raster raster{size, std::vector<std::uint8_t>(size.pixels() * 4)};
  for (std::size_t i = 0; i < raster.rgba.size(); ++i)
    raster.rgba[i] = i % 4 == 3 ? 255 : std::uint8_t(i * 7);
  return raster;
}

/// Writes a step of all five kinds.
inline void writeStep(ArchiveWriter& writer, long cycle, double time,
                      const std::string& field = "temperature") {
  ProxyHeader h = someHeader({12, 10});
  h.cycle = cycle;
  h.time = time;
  h.field = field;
  std::vector<ProxyImage> images = someImages(h, double(cycle));
  const Raster preview = someRaster(h.size);
  std::vector<EncodedProxy> proxies;
  for (const ProxyImage& image : images) proxies.push_back(encodeProxy(image, &preview));
  writer.writeStep(proxies);
}

// --- the kinds that are no plain planes ----------------------------------------------------------

/// Three slabs, each ray in one interval.
inline SlicedStack someStack(ProxyHeader h) {
  const DepthRange range = depthRange(h.camera, h.domain);
  for (int s = 0; s <= 3; ++s)
    h.slabDepths.push_back(range.low + (range.high - range.low) * s / 3.0);
  SlicedStack stack;
  stack.levels = 32;
  const SlabChords chords(h);
  const std::size_t pixels = h.size.pixels();
  stack.faces.assign(4, std::vector<std::uint8_t>(pixels, SlicedStack::kOutside));
  for (int s = 0; s < 3; ++s) {
    StackSlab& slab = stack.slabs.emplace_back();
    for (std::size_t i = 0; i < pixels; ++i) {
      StackCell& cell = slab.cells.emplace_back();
      cell.begin = std::uint32_t(slab.levels.size());
      if (!(chords.chord(s, i) > chords.least())) continue;
      cell.lowest = std::uint8_t(1 + i % 3);
      cell.count = 1;
      slab.levels.push_back(32);
      stack.faces[std::size_t(s)][i] = stack.faces[std::size_t(s) + 1][i] = cell.lowest;
    }
  }
  stack.header = std::move(h);
  return stack;
}

/// Two layers in every other pixel.
inline ProxyImage someLayers(ProxyHeader h) {
  const std::size_t pixels = h.size.pixels();
  AnalyticLayerPlanes planes{2, std::vector<float>(3 * pixels), std::vector<float>(6 * pixels),
                             std::vector<float>(2 * pixels),
                             std::vector<AnalyticLayerState>(pixels)};
  const DepthRange range = depthRange(h.camera, h.domain);
  for (std::size_t p = 0; p < pixels; p += 2) {
    planes.state[p] = AnalyticLayerState::Whole;
    for (std::size_t b = 0; b < 3; ++b)
      planes.boundary[b * pixels + p] =
          float(range.low + (range.high - range.low) * (0.2 + 0.3 * double(b)));
    for (std::size_t l = 0; l < 2; ++l) planes.tau[l * pixels + p] = 0.5f + float(l);
    for (std::size_t c = 0; c < 6; ++c) planes.color[c * pixels + p] = 0.1f * float(c + 1);
  }
  h.shading = "unlit";
  return layeredImage(std::move(h), planes);
}

inline ProxyImage someField(ProxyHeader h) {
  FieldSamples field;
  field.low = h.statistics.low;
  field.high = h.statistics.high;
  const std::array<int, 3> size{9, 8, 7};
  for (std::size_t a = 0; a < 3; ++a) field.axes[a] = {size[a], 0.0, 0.25, {}};
  for (int i = 0; i < 9 * 8 * 7; ++i)
    field.values.push_back(0.5f + 0.5f * std::sin(0.1f * float(i)));
  return fieldImage(std::move(h), std::move(field), {1, 1e-3});
}

/// Writes a step of the three.
inline void writeNewerStep(ArchiveWriter& writer, long cycle) {
  ProxyHeader h = someHeader({12, 10});
  h.cycle = cycle;
  const Raster preview = someRaster(h.size);
  writer.writeStep({encodeProxy(someStack(h), &preview), encodeProxy(someLayers(h), &preview),
                    encodeProxy(someField(h))});
}

}  // namespace vestige::test
