// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/volume/feature_bricks.h"

#include <algorithm>
#include <limits>

namespace vestige {
namespace {

/// The box of values that some samples span; low > high: none of them has data.
struct ValueBox {
  FieldSample low, high;

  ValueBox() {
    low.values.fill(kInfinity);
    high.values.fill(-kInfinity);
    low.gradient = kInfinity;
    high.gradient = -kInfinity;
  }
  void add(const ValueBox& other) {
    for (std::size_t f = 0; f < Classifier::kMaxFields; ++f) {
      low.values[f] = std::min(low.values[f], other.low.values[f]);
      high.values[f] = std::max(high.values[f], other.high.values[f]);
    }
    low.gradient = std::min(low.gradient, other.low.gradient);
    high.gradient = std::max(high.gradient, other.high.gradient);
  }
};

std::vector<ValueBox> boxesOf(const Classifier& classifier,
                              std::span<const BrickGrid* const> fields) {
  const std::size_t count = classifier.fields().size();
  std::vector<ValueBox> boxes;
  for (std::size_t f = 0; f < fields.size(); ++f) {
    const std::vector<glm::vec2> ranges = fields[f]->ranges();
    boxes.resize(ranges.size());
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      (f < count ? boxes[i].low.values[f] : boxes[i].low.gradient) = double(ranges[i].x);
      (f < count ? boxes[i].high.values[f] : boxes[i].high.gradient) = double(ranges[i].y);
    }
  }
  return boxes;
}

bool vanishes(const Classifier& classifier, ValueBox box) {
  const std::size_t count = classifier.fields().size();
  for (std::size_t f = 0; f < Classifier::kMaxFields; ++f) {
    if (f >= count) {
      box.low.values[f] = box.high.values[f] = 0.0;
    } else if (box.low.values[f] > box.high.values[f]) {
      return true;  // no data in one field weighs nothing
    }
  }
  if (!classifier.needsGradient()) {
    box.low.gradient = box.high.gradient = 0.0;
  } else if (box.low.gradient > box.high.gradient) {
    return true;
  }
  return classifier.vanishes(box.low, box.high);
}

}  // namespace

std::vector<glm::vec4> vanishingBricks(const Classifier& classifier,
                                       std::span<const BrickGrid* const> fields,
                                       bool withNeighbours) {
  const std::vector<ValueBox> boxes = boxesOf(classifier, fields);
  const auto [nx, ny, nz] = fields.front()->size();
  const auto at = [nx = nx, ny = ny](int x, int y, int z) {
    return (std::size_t(z) * std::size_t(ny) + std::size_t(y)) * std::size_t(nx) + std::size_t(x);
  };
  std::vector<glm::vec4> texels;
  texels.reserve(boxes.size());
  for (int z = 0; z < nz; ++z) {
    for (int y = 0; y < ny; ++y) {
      for (int x = 0; x < nx; ++x) {
        ValueBox box = boxes[at(x, y, z)];
        const int reach = withNeighbours ? 1 : 0;
        for (int k = std::max(0, z - reach); k <= std::min(nz - 1, z + reach); ++k)
          for (int j = std::max(0, y - reach); j <= std::min(ny - 1, y + reach); ++j)
            for (int i = std::max(0, x - reach); i <= std::min(nx - 1, x + reach); ++i)
              box.add(boxes[at(i, j, k)]);
        texels.emplace_back(vanishes(classifier, box) ? 0.0f : -1.0f, 0.0f, 0.0f, 0.0f);
      }
    }
  }
  return texels;
}

}  // namespace vestige
