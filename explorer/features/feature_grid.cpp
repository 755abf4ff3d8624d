// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/features/feature_grid.h"

#include <algorithm>
#include <cmath>

#include "proxy/base/error.h"
#include "proxy/base/parallel.h"
#include "proxy/format/layout/sliced_stack.h"

namespace vestige {
namespace {

/// Turns of scaling through all stacks: more change nothing that shows.
constexpr int kTurns = 6;

glm::ivec3 sizeOf(const ProxyHeader& header, std::size_t channels) {
  const std::size_t most = FeatureGrid::kMostWeights / channels / header.size.pixels();
  const std::size_t slabs = header.slabDepths.size() - 1;
  if (most < slabs) {
    throw Error(ErrorCode::InvalidArgument,
                "a grid of the features in view '" + header.view + "' needs more than " +
                    std::to_string(FeatureGrid::kMostWeights) + " weights");
  }
  const double depth = header.slabDepths.back() - header.slabDepths.front();
  const double pixel =
      header.camera.viewHeight / header.size.height * std::min(header.camera.pixelAspect, 1.0);
  const double wanted = std::clamp(std::round(depth / pixel), double(slabs), 1024.0);
  // A whole number of cells a slab, so that slabs of equal depth end between cells.
  const double perSlab = std::max(1.0, std::round(wanted / double(slabs)));
  return {header.size.width, header.size.height,
          int(std::min(perSlab, std::floor(double(most) / double(slabs))) * double(slabs))};
}

/// Where the cells of a grid lie in a stack.
class StackBins {
 public:
  static constexpr std::size_t kNone = ~std::size_t(0);

  StackBins(const ProxyHeader& header, const FeatureGrid& grid)
      : size_(header.size), depths_(header.slabDepths) {
    const auto cell = [&](glm::dvec3 at) {
      const glm::dvec3 world(grid.worldFromGrid *
                             glm::dvec4((at + 0.5) / glm::dvec3(grid.size), 1.0));
      const auto seen = header.camera.project(world, header.size);
      return glm::dvec3(seen);
    };
    start_ = cell({0, 0, 0});
    for (int a = 0; a < 3; ++a) {
      glm::dvec3 step(0.0);
      step[a] = 1.0;
      way_[a] = cell(step) - start_;
    }
  }

  /// slab * pixels + pixel of a cell.
  std::size_t of(int x, int y, int z) const {
    const glm::dvec3 at = start_ + double(x) * way_[0] + double(y) * way_[1] + double(z) * way_[2];
    const int px = int(std::floor(at.x)), py = int(std::floor(at.y));
    if (px < 0 || py < 0 || px >= size_.width || py >= size_.height) return kNone;
    if (!(at.z >= depths_.front() && at.z < depths_.back())) return kNone;
    const auto behind = std::upper_bound(depths_.begin(), depths_.end(), at.z);
    const auto slab = std::size_t(behind - depths_.begin()) - 1;
    return slab * size_.pixels() + std::size_t(py) * std::size_t(size_.width) + std::size_t(px);
  }

 private:
  ImageSize size_;
  std::vector<double> depths_;
  glm::dvec3 start_{0.0}, way_[3];
};

/// [slab * pixels + pixel][channel] mean weights over the rays' stretches.
std::vector<float> storedMeans(const FeatureStack& stack, std::size_t channels) {
  const std::size_t pixels = stack.header.size.pixels();
  const SlabChords chords(stack.header);
  std::vector<float> means(stack.slabs.size() * pixels * channels);
  parallelRanges(int(stack.slabs.size()), [&](int begin, int end) {
    for (int s = begin; s < end; ++s) {
      for (std::size_t p = 0; p < pixels; ++p) {
        const double chord = chords.chord(s, p);
        if (!(chord > chords.least())) continue;
        for (std::size_t i = 0; i < channels; ++i) {
          means[(std::size_t(s) * pixels + p) * channels + i] =
              float(double(stack.slabs[std::size_t(s)][i * pixels + p]) / chord);
        }
      }
    }
  });
  return means;
}

template <typename Visit>
void forCells(glm::ivec3 size, int zBegin, int zEnd, const Visit& visit) {
  for (int z = zBegin; z < zEnd; ++z) {
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x) {
        visit((std::size_t(z) * std::size_t(size.y) + std::size_t(y)) * std::size_t(size.x) +
                  std::size_t(x),
              x, y, z);
      }
    }
  }
}

/// Scales the weights so that their means over a stack's cells are the stored ones.
void agreeWith(const StackBins& bins, const std::vector<float>& stored, FeatureGrid& grid) {
  const std::size_t n = grid.channels;
  std::vector<float> sums(stored.size(), 0.0f);
  std::vector<std::uint32_t> counts(stored.size() / n, 0);
  forCells(grid.size, 0, grid.size.z, [&](std::size_t cell, int x, int y, int z) {
    const std::size_t bin = bins.of(x, y, z);
    if (bin == StackBins::kNone) return;
    ++counts[bin];
    for (std::size_t i = 0; i < n; ++i) sums[bin * n + i] += grid.weights[cell * n + i];
  });
  // Factors in place of sums.
  for (std::size_t b = 0; b < counts.size(); ++b) {
    for (std::size_t i = 0; i < n; ++i) {
      float& sum = sums[b * n + i];
      sum = sum > 0.0f ? stored[b * n + i] * float(counts[b]) / sum : 0.0f;
    }
  }
  parallelRanges(grid.size.z, [&](int begin, int end) {
    forCells(grid.size, begin, end, [&](std::size_t cell, int x, int y, int z) {
      const std::size_t bin = bins.of(x, y, z);
      if (bin == StackBins::kNone) return;
      for (std::size_t i = 0; i < n; ++i) grid.weights[cell * n + i] *= sums[bin * n + i];
    });
  });
}

/// A single stack's slabs, each channel linear between the slabs' middles.
void spread(const StackBins& bins, const std::vector<float>& stored, std::size_t pixels,
            FeatureGrid& grid) {
  const std::size_t n = grid.channels, slabs = stored.size() / n / pixels;
  const double perSlab = double(grid.size.z) / double(slabs);
  parallelRanges(grid.size.z, [&](int begin, int end) {
    forCells(grid.size, begin, end, [&](std::size_t cell, int x, int y, int z) {
      const std::size_t bin = bins.of(x, y, z);
      if (bin == StackBins::kNone) return;
      const std::size_t slab = bin / pixels;
      const double place = (z + 0.5) / perSlab - (double(slab) + 0.5);
      const std::size_t other =
          place < 0.0 ? (slab > 0 ? bin - pixels : bin) : (slab + 1 < slabs ? bin + pixels : bin);
      const auto share = float(std::min(std::abs(place), 1.0));
      for (std::size_t i = 0; i < n; ++i) {
        grid.weights[cell * n + i] =
            (1.0f - share) * stored[bin * n + i] + share * stored[other * n + i];
      }
    });
  });
}

/// Within a slab a stack places nothing: there a weight may be as far from the slab's mean as those
/// of the slabs beside it are, halfway.
void boundBy(const StackBins& bins, const std::vector<float>& stored, std::size_t pixels,
             FeatureGrid& grid) {
  const std::size_t n = grid.channels, slabs = stored.size() / n / pixels;
  parallelRanges(grid.size.z, [&](int begin, int end) {
    forCells(grid.size, begin, end, [&](std::size_t cell, int x, int y, int z) {
      const std::size_t bin = bins.of(x, y, z);
      if (bin == StackBins::kNone) return;
      const std::size_t slab = bin / pixels;
      const std::size_t before = slab > 0 ? bin - pixels : bin;
      const std::size_t after = slab + 1 < slabs ? bin + pixels : bin;
      for (std::size_t i = 0; i < n; ++i) {
        const float own = stored[bin * n + i];
        const float change = 0.5f * std::max(std::abs(stored[before * n + i] - own),
                                             std::abs(stored[after * n + i] - own));
        std::uint8_t& wrong = grid.wrong[cell * n + i];
        wrong = std::min(wrong, std::uint8_t(std::lround(std::min(change, 1.0f) * 255.0f)));
      }
    });
  });
}

}  // namespace

FeatureGrid fusedFeatures(std::span<const FeatureStack> stacks) {
  const ProxyHeader& header = stacks.front().header;
  FeatureGrid grid;
  grid.channels = featuresOf(header).channels();
  grid.size = sizeOf(header, grid.channels);
  const auto corner = [&](double x, double y, double z) {
    return header.camera.unproject({x * header.size.width, y * header.size.height, z}, header.size);
  };
  const double near = header.slabDepths.front(), far = header.slabDepths.back();
  const glm::dvec3 origin = corner(0, 0, near);
  grid.worldFromGrid = glm::dmat4(
      glm::dvec4(corner(1, 0, near) - origin, 0.0), glm::dvec4(corner(0, 1, near) - origin, 0.0),
      glm::dvec4(corner(0, 0, far) - origin, 0.0), glm::dvec4(origin, 1.0));
  grid.weights.assign(grid.channels * std::size_t(grid.size.x) * std::size_t(grid.size.y) *
                          std::size_t(grid.size.z),
                      0.0f);
  std::vector<StackBins> bins;
  std::vector<std::vector<float>> stored;
  for (const FeatureStack& stack : stacks) {
    bins.emplace_back(stack.header, grid);
    stored.push_back(storedMeans(stack, grid.channels));
  }
  grid.wrong.assign(grid.weights.size(), 255);
  for (std::size_t s = 0; s < stacks.size(); ++s)
    boundBy(bins[s], stored[s], stacks[s].header.size.pixels(), grid);
  spread(bins.front(), stored.front(), header.size.pixels(), grid);
  // What one stack sees nothing of, the others' scaling would leave empty for good: where a slab is
  // all empty it is so truly.
  if (stacks.size() == 1) {
    agreeWith(bins.front(), stored.front(), grid);
    return grid;
  }
  for (int turn = 0; turn < kTurns; ++turn) {
    // The first last, so that its own view is as true as its stack.
    for (std::size_t s = stacks.size(); s-- > 0;) agreeWith(bins[s], stored[s], grid);
  }
  return grid;
}

LookGrid FeatureGrid::optics(std::span<const ChannelOptics> look, double doubt) const {
  std::vector<float> rgba(weights.size() / channels * 4, 0.0f);
  std::vector<glm::vec4> each;
  for (const ChannelOptics& channel : look) {
    each.push_back(glm::vec4(glm::dvec4(channel.emission, channel.extinction)));
  }
  parallelRanges(size.z, [&](int begin, int end) {
    forCells(size, begin, end, [&](std::size_t cell, int, int, int) {
      glm::vec4 sum(0.0f);
      for (std::size_t i = 0; i < channels; ++i) {
        const std::size_t at = cell * channels + i;
        const float moved = weights[at] + float(doubt / 255.0) * float(wrong[at]);
        sum += (doubt == 0.0 ? weights[at] : std::clamp(moved, 0.0f, 1.0f)) * each[i];
      }
      for (int c = 0; c < 4; ++c) rgba[4 * cell + std::size_t(c)] = sum[c];
    });
  });
  return LookGrid::optics(size, worldFromGrid, rgba);
}

}  // namespace vestige
