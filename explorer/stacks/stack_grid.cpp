// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/stacks/stack_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>

#include "explorer/stacks/run_profile.h"
#include "proxy/base/error.h"
#include "proxy/base/parallel.h"

namespace vestige {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

glm::ivec3 sizeOf(const ProxyHeader& header) {
  const ImageSize size = header.size;
  if (size.pixels() > StackSamples::kMostCells) {
    throw Error(ErrorCode::InvalidArgument,
                "a grid of the stack in view '" + header.view + "' needs more than " +
                    std::to_string(StackSamples::kMostCells) + " cells for its " +
                    std::to_string(size.width) + " x " + std::to_string(size.height) + " pixels");
  }
  const double depth = header.slabDepths.back() - header.slabDepths.front();
  const double pixel =
      header.camera.viewHeight / size.height * std::min(header.camera.pixelAspect, 1.0);
  const double most = double(StackSamples::kMostCells / size.pixels());
  const double slabs = double(header.slabDepths.size());
  const double wanted = std::clamp(std::round(depth / pixel) + 1.0, slabs, 2048.0);
  return {size.width, size.height, int(std::max(std::min(most, wanted), 2.0))};
}

/// Distance of the samples along a ray.
double stepOf(const ProxyHeader& header, int count) {
  return (header.slabDepths.back() - header.slabDepths.front()) / (count - 1);
}

/// The columns of one row of pixels, [z][x].
class RowSampler {
 public:
  RowSampler(const ProxyHeader& header, const RunLists& runs, glm::ivec3 size, double zero,
             double unit)
      : runs_(runs),
        profile_(*header.partition, header.statistics),
        size_(size),
        step_(float(stepOf(header, size.z))),
        zero_(zero),
        unit_(unit),
        doubt_(std::size_t(size.z)) {
    // Crossings may lie an eighth of a slab away.
    const float blur = float((size.z - 1) / double(header.slabDepths.size() - 1) / 8.0);
    window_ = std::max(1, int(std::lround(blur)));
    perWindow_ = blur / float(window_);
  }

  void sample(int y, float* out, std::uint8_t* wrong) {
    const auto width = std::size_t(size_.x);
    for (std::size_t x = 0; x < width; ++x) column(std::size_t(y) * width + x, out + x, wrong + x);
  }

 private:
  float value(const ProfileSegment& segment, float t) const {
    if (segment.rank == profile_.noData()) return kNone;
    return float((profile_.value(segment.rank, segment.at(t)) - zero_) / unit_);
  }

  void column(std::size_t pixel, float* out, std::uint8_t* wrong) {
    const auto& segments = profile_.of(runs_, pixel);
    const auto stride = std::size_t(size_.x);
    if (segments.empty()) {
      for (int z = 0; z < size_.z; ++z) {
        out[std::size_t(z) * stride] = kNone;
        wrong[std::size_t(z) * stride] = 0;
      }
      return;
    }
    std::size_t at = 0;
    float begin = runs_.enter[pixel];
    for (int z = 0; z < size_.z; ++z) {
      const float depth = float(z) * step_;
      while (at + 1 < segments.size() && depth >= begin + segments[at].length) {
        begin += segments[at++].length;
      }
      const ProfileSegment& segment = segments[at];
      const float t =
          segment.length > 0.0f ? std::clamp((depth - begin) / segment.length, 0.0f, 1.0f) : 0.5f;
      out[std::size_t(z) * stride] = value(segment, t);
      doubt_[std::size_t(z)] = segment.doubt() * float(profile_.width(segment.rank) / unit_);
    }
    for (int z = 0; z < size_.z; ++z) {
      float least = HUGE_VALF, most = -HUGE_VALF;
      for (int k = std::max(z - window_, 0); k <= std::min(z + window_, size_.z - 1); ++k) {
        const float v = out[std::size_t(k) * stride];
        least = std::min(least, v);
        most = std::max(most, v);
      }
      const float change = perWindow_ * std::max(most - least, 0.0f);
      const float both = std::hypot(change, doubt_[std::size_t(z)]);
      wrong[std::size_t(z) * stride] =
          std::uint8_t(std::min(both / StackSamples::kWrongUnit, 255.0f));
    }
  }

  const RunLists& runs_;
  RunProfile profile_;
  glm::ivec3 size_;
  float step_;
  double zero_, unit_;
  int window_ = 1;  ///< cells
  float perWindow_ = 1.0f;
  std::vector<float> doubt_;
};

/// Gives rays that miss the values of their neighbours that do not.
void extend(const RunLists& runs, StackSamples& samples) {
  const glm::ivec3 size = samples.size;
  const auto hits = [&](int x, int y) {
    const auto i = std::size_t(y) * std::size_t(size.x) + std::size_t(x);
    return runs.first[i] < runs.first[i + 1];
  };
  const auto plane = std::size_t(size.x) * std::size_t(size.y);
  for (int y = 0; y < size.y; ++y) {
    for (int x = 0; x < size.x; ++x) {
      if (hits(x, y)) continue;
      std::vector<std::size_t> from;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const int nx = x + dx, ny = y + dy;
          if (nx < 0 || ny < 0 || nx >= size.x || ny >= size.y || !hits(nx, ny)) continue;
          from.push_back(std::size_t(ny) * std::size_t(size.x) + std::size_t(nx));
        }
      }
      if (from.empty()) continue;
      const auto own = std::size_t(y) * std::size_t(size.x) + std::size_t(x);
      for (std::size_t z = 0; z < std::size_t(size.z); ++z) {
        float sum = 0.0f;
        std::uint8_t wrong = 0;
        int known = 0;
        for (const std::size_t i : from) {
          const float value = samples.values[z * plane + i];
          if (!std::isfinite(value)) continue;
          sum += value;
          wrong = std::max(wrong, samples.wrong[z * plane + i]);
          ++known;
        }
        samples.values[z * plane + own] = known > 0 ? sum / float(known) : kNone;
        samples.wrong[z * plane + own] = wrong;
      }
    }
  }
}

}  // namespace

StackSamples sampledStack(const ProxyHeader& header, const RunLists& runs) {
  StackSamples samples;
  samples.size = sizeOf(header);
  const ImageSize size = header.size;
  // The first and the last cell have their middles on the outer faces.
  const double half = 0.5 * stepOf(header, samples.size.z);
  const double near = header.slabDepths.front() - half, far = header.slabDepths.back() + half;
  const auto corner = [&](double x, double y, double z) {
    return header.camera.unproject({x * size.width, y * size.height, z}, size);
  };
  const glm::dvec3 origin = corner(0, 0, near);
  samples.worldFromGrid = glm::dmat4(
      glm::dvec4(corner(1, 0, near) - origin, 0.0), glm::dvec4(corner(0, 1, near) - origin, 0.0),
      glm::dvec4(corner(0, 0, far) - origin, 0.0), glm::dvec4(origin, 1.0));
  samples.zero = header.partition->low();
  samples.unit = header.partition->high() - header.partition->low();
  const auto row = std::size_t(samples.size.x);
  const std::size_t plane = row * std::size_t(samples.size.y);
  samples.values.resize(plane * std::size_t(samples.size.z));
  samples.wrong.resize(samples.values.size());
  parallelRanges(samples.size.y, [&](int begin, int end) {
    RowSampler sampler(header, runs, samples.size, samples.zero, samples.unit);
    std::vector<float> columns(row * std::size_t(samples.size.z));
    std::vector<std::uint8_t> wrongs(columns.size());
    for (int y = begin; y < end; ++y) {
      sampler.sample(y, columns.data(), wrongs.data());
      for (std::size_t z = 0; z < std::size_t(samples.size.z); ++z) {
        const auto from = std::ptrdiff_t(z * row);
        const auto to = std::ptrdiff_t(z * plane + std::size_t(y) * row);
        std::copy_n(columns.begin() + from, row, samples.values.begin() + to);
        std::copy_n(wrongs.begin() + from, row, samples.wrong.begin() + to);
      }
    }
  });
  extend(runs, samples);
  return samples;
}

namespace {

/// Looks a stack's samples up in the cells of another grid: trilinear between those with data,
/// which weigh by their shares; NaN where the nearest has none (method §1).
class Resampler {
 public:
  Resampler(const StackSamples& from, const StackSamples& to) : from_(from) {
    // Cells of `to` to cells of `from`, centres at whole numbers.
    const glm::dmat4 m = glm::inverse(from.worldFromGrid) * to.worldFromGrid;
    const auto cell = [&](glm::dvec3 at) {
      const glm::dvec3 grid = (at + 0.5) / glm::dvec3(to.size);
      return glm::dvec3(m * glm::dvec4(grid, 1.0)) * glm::dvec3(from.size) - 0.5;
    };
    start_ = cell({0, 0, 0});
    x_ = cell({1, 0, 0}) - start_;
    y_ = cell({0, 1, 0}) - start_;
    z_ = cell({0, 0, 1}) - start_;
    plane_ = std::size_t(from.size.x) * std::size_t(from.size.y);
  }

  struct Value {
    float value, wrong;  ///< wrong: squared
  };
  Value at(int x, int y, int z) const {
    const glm::dvec3 cell = start_ + double(x) * x_ + double(y) * y_ + double(z) * z_;
    glm::ivec3 low;
    glm::vec3 t;
    std::size_t next[3];
    const std::size_t strides[3] = {1, std::size_t(from_.size.x), plane_};
    std::size_t index = 0, nearest = 0;
    for (int a = 0; a < 3; ++a) {
      const double v = std::clamp(cell[a], 0.0, double(from_.size[a] - 1));
      low[a] = int(v);
      t[a] = float(v - low[a]);
      next[a] = low[a] + 1 < from_.size[a] ? strides[a] : 0;
      index += std::size_t(low[a]) * strides[a];
      if (a < 2) nearest += std::size_t(v + 0.5) * strides[a];
    }
    const float* p = from_.values.data() + index;
    const auto along = [&](const float* q) {
      const float a = q[0] + t.x * (q[next[0]] - q[0]);
      const float b = q[next[1]] + t.x * (q[next[1] + next[0]] - q[next[1]]);
      return a + t.y * (b - a);
    };
    const float near = along(p), far = along(p + next[2]);
    float value = near + t.z * (far - near);
    if (!std::isfinite(value)) value = besideGaps(p, next, t);
    const int middle = int(std::clamp(cell.z, 0.0, double(from_.size.z - 1)) + 0.5);
    const float wrong =
        from_.wrong.empty()
            ? 0.0f
            : float(from_.wrong[std::size_t(middle) * plane_ + nearest]) * StackSamples::kWrongUnit;
    return {value, wrong * wrong};
  }

 private:
  static float besideGaps(const float* first, const std::size_t (&next)[3], glm::vec3 t) {
    const auto corner = [&](bool x, bool y, bool z) {
      return first[(x ? next[0] : 0) + (y ? next[1] : 0) + (z ? next[2] : 0)];
    };
    if (!std::isfinite(corner(t.x >= 0.5f, t.y >= 0.5f, t.z >= 0.5f))) return kNone;
    float sum = 0.0f, weights = 0.0f;
    for (int i = 0; i < 8; ++i) {
      const bool x = i & 1, y = i & 2, z = i & 4;
      const float value = corner(x, y, z);
      if (!std::isfinite(value)) continue;
      const float weight = (x ? t.x : 1.0f - t.x) * (y ? t.y : 1.0f - t.y) * (z ? t.z : 1.0f - t.z);
      sum += weight * value;
      weights += weight;
    }
    return sum / weights;
  }

  const StackSamples& from_;
  glm::dvec3 start_{0.0}, x_{0.0}, y_{0.0}, z_{0.0};
  std::size_t plane_ = 0;
};

/// No stack is surer of a value than this share of the range.
constexpr float kLeast = 1.0f / 128.0f;

/// How far a value of several may be wrong: as far as the surest stack's, and as they disagree.
std::uint8_t wrongOf(std::span<const std::pair<float, float>> valueAndWeight, float value) {
  float sum = 0.0f, squares = 0.0f, most = 0.0f;
  for (const auto& [other, weight] : valueAndWeight) {
    sum += weight;
    squares += weight * (other - value) * (other - value);
    most = std::max(most, weight);
  }
  const float surest = std::max(1.0f / most - kLeast * kLeast, 0.0f);
  const float wrong = std::sqrt(surest + squares / sum);
  return std::uint8_t(std::min(wrong / StackSamples::kWrongUnit, 255.0f));
}

/// The value at half of the weights, each of which is spread evenly around its value's place.
float weightedMedian(std::span<std::pair<float, float>> valueAndWeight) {
  std::sort(valueAndWeight.begin(), valueAndWeight.end());
  float sum = 0.0f;
  for (const auto& [value, weight] : valueAndWeight) sum += weight;
  float before = 0.0f, placeBefore = 0.0f;
  for (std::size_t i = 0; i < valueAndWeight.size(); ++i) {
    const auto [value, weight] = valueAndWeight[i];
    const float place = before + 0.5f * weight;
    if (place >= 0.5f * sum) {
      if (i == 0) return value;
      const float last = valueAndWeight[i - 1].first;
      return last + (value - last) * (0.5f * sum - placeBefore) / (place - placeBefore);
    }
    placeBefore = place;
    before += weight;
  }
  return valueAndWeight.back().first;
}

}  // namespace

StackSamples fusedStacks(std::vector<StackSamples> stacks) {
  if (stacks.size() == 1) return std::move(stacks.front());
  const StackSamples& first = stacks.front();
  StackSamples result{first.size, first.worldFromGrid, first.unit, first.zero, {}, {}};
  result.values.resize(first.values.size());
  result.wrong.resize(first.values.size());
  std::vector<Resampler> resamplers;
  for (const StackSamples& stack : stacks) resamplers.emplace_back(stack, first);
  const glm::ivec3 size = first.size;
  const auto fuse = [&](glm::ivec3 at, std::vector<std::pair<float, float>>& known) {
    known.clear();
    for (std::size_t s = 0; s < stacks.size(); ++s) {
      auto [value, wrong] = resamplers[s].at(at.x, at.y, at.z);
      if (!std::isfinite(value)) continue;
      // All stacks of a field have its partition's unit, or it is brought to the first's.
      value = float((double(value) * stacks[s].unit + stacks[s].zero - first.zero) / first.unit);
      known.emplace_back(value, 1.0f / (wrong + kLeast * kLeast));
    }
    // What most stacks have no data for has none.
    const bool enough = 2 * known.size() > stacks.size() || known.size() == stacks.size();
    const std::size_t cell =
        (std::size_t(at.z) * std::size_t(size.y) + std::size_t(at.y)) * std::size_t(size.x) +
        std::size_t(at.x);
    result.values[cell] = enough ? weightedMedian(known) : kNone;
    result.wrong[cell] = enough ? wrongOf(known, result.values[cell]) : 0;
  };
  // Block by block: rows of one stack are columns of another, and would miss the cache.
  constexpr int kBlock = 16;
  parallelRanges(size.z, [&](int begin, int end) {
    std::vector<std::pair<float, float>> known;
    for (int z0 = begin; z0 < end; z0 += kBlock) {
      for (int y0 = 0; y0 < size.y; y0 += kBlock) {
        for (int x0 = 0; x0 < size.x; x0 += kBlock) {
          for (int z = z0; z < std::min(z0 + kBlock, end); ++z) {
            for (int y = y0; y < std::min(y0 + kBlock, size.y); ++y) {
              for (int x = x0; x < std::min(x0 + kBlock, size.x); ++x) fuse({x, y, z}, known);
            }
          }
        }
      }
    }
  });
  return result;
}

LookGrid StackSamples::upload() const {
  LookGrid grid = LookGrid::scalar(size, worldFromGrid, values);
  if (!wrong.empty()) grid.setWrong(wrong, double(kWrongUnit) / grid.valueUnit);
  grid.valueZero = grid.valueZero * unit + zero;
  grid.valueUnit *= unit;
  return grid;
}

}  // namespace vestige
