// SPDX-License-Identifier: BSD-3-Clause
#include "tests/bench/layered_storage.h"

#include <Imath/half.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "proxy/format/layout/proxy_layout.h"

namespace vestige::test {
namespace {

/// One plane: stored = (value - zero) / unit.
struct PlaneStore {
  std::string name;
  float* values;
  double unit, zero;
  bool isFloat;
  std::vector<Imath::half> halves{};
  std::vector<float> floats{};
};

constexpr double kQuantum = 0x1p-24;

std::vector<PlaneStore> planesOf(const ProxyHeader& header, AnalyticLayerPlanes& planes,
                                 const LayeredStorage& storage) {
  const std::size_t pixels = header.size.pixels();
  std::vector<PlaneStore> stores;
  // Steps of 2^-12, which the values already are multiples of, as the product's integers or as what
  // they are.
  const double unit = storage.integers ? 0x1p-12 / kQuantum : 1.0;
  const DepthRange range = depthRange(header.camera, header.domain);
  const double depthStep = (range.high - range.low) / 2046.0;
  for (int i = 0; i < planes.layers; ++i) {
    const auto layer = std::size_t(i);
    for (std::size_t c = 0; c < 3; ++c) {
      stores.push_back({fmt::format("layer{:02d}.{}", i, "RGB"[c]),
                        planes.color.data() + (3 * layer + c) * pixels, unit, 0.0, storage.floats});
    }
    stores.push_back({fmt::format("tau.t{:02d}", i), planes.tau.data() + layer * pixels, unit, 0.0,
                      storage.floats});
  }
  for (int i = 0; i <= planes.layers; ++i) {
    stores.push_back(
        {fmt::format("boundaries.z{:02d}", i), planes.boundary.data() + std::size_t(i) * pixels,
         storage.integers ? depthStep / kQuantum : depthStep, range.low - depthStep, false});
  }
  return stores;
}

}  // namespace

const std::vector<LayeredStorage>& layeredStorages() {
  using enum LayeredStorage::Compression;
  static const std::vector<LayeredStorage> storages{
      {"zip3", Zip, 3},
      {"zip9", Zip, 9},
      {"zip9_plain", Zip, 9, false, false},
      {"zip9_float", Zip, 9, true, false},
      {"piz", Piz, 0},
      {"piz_plain", Piz, 0, false, false},
      {"dwaa5", Dwaa, 5, false, false},
      {"dwaa15", Dwaa, 15, false, false},
      {"dwaa45", Dwaa, 45, false, false},
      {"dwaa100", Dwaa, 100, false, false},
      {"dwaa200", Dwaa, 200, false, false},
  };
  return storages;
}

StoredAs storeLayers(const ProxyHeader& header, const AnalyticLayerPlanes& planes,
                     const LayeredStorage& storage) {
  StoredAs result{planes, 0};
  const int width = header.size.width, height = header.size.height;
  const std::size_t pixels = header.size.pixels();
  std::vector<PlaneStore> stores = planesOf(header, result.planes, storage);
  // The state is small and is stored in the depths' own way; it does not change here.
  Imf::Header exr(width, height);
  switch (storage.compression) {
    case LayeredStorage::Compression::Zip:
      exr.compression() = Imf::ZIP_COMPRESSION;
      exr.zipCompressionLevel() = int(storage.level);
      break;
    case LayeredStorage::Compression::Piz:
      exr.compression() = Imf::PIZ_COMPRESSION;
      break;
    case LayeredStorage::Compression::Dwaa:
      exr.compression() = Imf::DWAA_COMPRESSION;
      exr.dwaCompressionLevel() = storage.level;
      break;
  }
  Imf::FrameBuffer frame;
  for (PlaneStore& store : stores) {
    exr.channels().insert(store.name, Imf::Channel(store.isFloat ? Imf::FLOAT : Imf::HALF));
    for (std::size_t p = 0; p < pixels; ++p) {
      const bool empty = planes.state[p] == AnalyticLayerState::Empty;
      const float stored =
          empty ? 0.0f : float((double(store.values[p]) - store.zero) / store.unit);
      store.isFloat ? store.floats.push_back(stored) : store.halves.push_back(Imath::half(stored));
    }
    char* data = store.isFloat ? reinterpret_cast<char*>(store.floats.data())
                               : reinterpret_cast<char*>(store.halves.data());
    const std::size_t word = store.isFloat ? sizeof(float) : sizeof(Imath::half);
    frame.insert(store.name, Imf::Slice(store.isFloat ? Imf::FLOAT : Imf::HALF, data, word,
                                        word * std::size_t(width)));
  }
  const auto path = std::filesystem::temp_directory_path() /
                    fmt::format("vestige-layered-{}-{}.exr", ::getpid(), storage.name);
  {
    Imf::OutputFile file(path.c_str(), exr);
    file.setFrameBuffer(frame);
    file.writePixels(height);
  }
  result.bytes = std::filesystem::file_size(path);
  {
    Imf::InputFile file(path.c_str());
    file.setFrameBuffer(frame);
    file.readPixels(0, height - 1);
  }
  std::filesystem::remove(path);
  for (PlaneStore& store : stores) {
    for (std::size_t p = 0; p < pixels; ++p) {
      if (planes.state[p] == AnalyticLayerState::Empty) continue;
      const double stored = store.isFloat ? store.floats[p] : float(store.halves[p]);
      store.values[p] = float(std::max(stored * store.unit + store.zero,
                                       store.name.starts_with("boundaries") ? -HUGE_VAL : 0.0));
    }
  }
  return result;
}

}  // namespace vestige::test
