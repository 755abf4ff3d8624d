// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/compositing/ray_sorter.h"

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

#include "proxy/base/error.h"

namespace vestige {
namespace {

/// Calls use(plane vector, value that stands for a miss) for every vector of planes.
void forPlanes(auto& image, const auto& use) {
  use(image.entry, kInfinity);
  use(image.exit, -kInfinity);
  use(image.attenuation, 0.0f);
  use(image.transmittance, 1.0f);
  use(image.length, 0.0f);
  use(image.moment, 0.0f);
  use(image.runs, 0.0f);
  use(image.first, kMiss);
  use(image.last, kMiss);
  use(image.depth, kInfinity);
  use(image.normal, 0.0f);
  use(image.mip, std::numeric_limits<float>::quiet_NaN());
  use(image.reference, 0.0f);
}

RayImage missing(const RayImage& like) {
  RayImage image = like;
  forPlanes(image, [](auto& plane, auto miss) {
    using Value = typename std::remove_reference_t<decltype(plane)>::value_type;
    std::fill(plane.begin(), plane.end(), Value(miss));
  });
  return image;
}

}  // namespace

void RaySorter::add(RayImage rays) {
  const std::size_t pixels = rays.size.pixels();
  if (any_) {
    bool same = rays.size == first_.size && rays.channels == first_.channels;
    std::vector<std::size_t> sizes;
    forPlanes(first_, [&](const auto& plane, auto) { sizes.push_back(plane.size()); });
    std::size_t at = 0;
    forPlanes(rays, [&](const auto& plane, auto) { same = same && plane.size() == sizes[at++]; });
    if (!same) {
      throw Error(ErrorCode::InvalidArgument,
                  "ray images of " + std::to_string(first_.size.width) + " x " +
                      std::to_string(first_.size.height) + " and of " +
                      std::to_string(rays.size.width) + " x " + std::to_string(rays.size.height) +
                      " pixels, or of different planes, cannot be composited");
    }
  }
  for (std::size_t i = 0; i < pixels; ++i) {
    if (!(rays.entry[i] <= rays.exit[i])) continue;
    hits_.push_back({std::uint32_t(i), rays.entry[i], values_.size()});
    forPlanes(rays, [&](const auto& plane, auto) {
      for (std::size_t at = i; at < plane.size(); at += pixels) {
        values_.push_back(float(plane[at]));
      }
    });
  }
  if (!any_) first_ = missing(rays);
  any_ = true;
}

RayImage RaySorter::take() {
  if (!any_) throw Error(ErrorCode::InvalidArgument, "no ray images to composite");
  std::sort(hits_.begin(), hits_.end(), [](const Hit& a, const Hit& b) {
    return std::tie(a.pixel, a.entry) < std::tie(b.pixel, b.entry);
  });
  RayImage all = std::exchange(first_, {});
  const std::size_t pixels = all.size.pixels();
  // Round by round what each pixel meets next is one image.
  const RayImage nothing = all;
  std::vector<std::size_t> next;  // per pixel that has any hits left, its next one
  for (std::size_t h = 0; h < hits_.size(); ++h) {
    if (h == 0 || hits_[h].pixel != hits_[h - 1].pixel) next.push_back(h);
  }
  while (!next.empty()) {
    RayImage round = nothing;
    std::vector<std::size_t> left;
    for (const std::size_t h : next) {
      const Hit& hit = hits_[h];
      std::size_t value = hit.values;
      forPlanes(round, [&](auto& plane, auto) {
        using Value = typename std::remove_reference_t<decltype(plane)>::value_type;
        for (std::size_t at = hit.pixel; at < plane.size(); at += pixels) {
          plane[at] = Value(values_[value++]);
        }
      });
      if (h + 1 < hits_.size() && hits_[h + 1].pixel == hit.pixel) left.push_back(h + 1);
    }
    compositeUnder(all, round);
    next = std::move(left);
  }
  hits_.clear();
  values_.clear();
  any_ = false;
  return all;
}

}  // namespace vestige
