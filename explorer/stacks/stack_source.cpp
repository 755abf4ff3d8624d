// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/stacks/stack_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "explorer/stacks/stack_grid.h"
#include "proxy/base/error.h"
#include "proxy/format/image/storage_quantiser.h"
#include "proxy/format/layout/sliced_stack.h"

namespace vestige {
namespace {

/// Where a ray is inside [low, high], as lengths along it, not before its origin.
std::array<double, 2> inside(glm::dvec3 origin, glm::dvec3 way, glm::dvec3 low, glm::dvec3 high,
                             bool fromOrigin) {
  double from = fromOrigin ? 0.0 : -HUGE_VAL, to = HUGE_VAL;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(way[axis]) < 1e-12) {
      if (origin[axis] < low[axis] || origin[axis] > high[axis]) return {0.0, -1.0};
      continue;
    }
    const double a = (low[axis] - origin[axis]) / way[axis];
    const double b = (high[axis] - origin[axis]) / way[axis];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  return {from, to};
}

}  // namespace

std::vector<std::size_t> mostDifferent(std::span<const glm::dvec3> ways) {
  std::vector<std::size_t> chosen{0};
  while (chosen.size() < std::min(ways.size(), StackSource::kMost)) {
    std::size_t best = 0;
    double least = HUGE_VAL;
    for (std::size_t i = 0; i < ways.size(); ++i) {
      double nearest = 0.0;
      for (const std::size_t j : chosen)
        nearest = std::max(nearest, std::abs(glm::dot(ways[i], ways[j])));
      if (nearest < least - 1e-9) {
        least = nearest;
        best = i;
      }
    }
    if (least > 0.99) break;
    chosen.push_back(best);
  }
  return chosen;
}

std::vector<std::string> StackSource::viewsOf(const Archive& archive, long cycle,
                                              const std::string& field) {
  std::vector<std::string> names;
  for (const std::string& view : archive.views()) {
    if (archive.find(cycle, view, field, kind::kSliced)) names.push_back(view);
  }
  return names;
}

StackSamples samplesOfStacks(const Archive& archive, long cycle, const std::string& field,
                             std::vector<ProxyHeader>& fused) {
  std::vector<const ArchiveRow*> rows;
  std::vector<glm::dvec3> ways;
  for (const std::string& view : StackSource::viewsOf(archive, cycle, field)) {
    rows.push_back(archive.find(cycle, view, field, kind::kSliced));
    ways.push_back(archive.open(*rows.back()).header().camera.forward);
  }
  if (rows.empty()) {
    throw Error(ErrorCode::NotFound,
                fmt::format("cycle {} has no sliced proxy of field '{}'", cycle, field));
  }
  std::vector<StackSamples> samples;
  for (const std::size_t i : mostDifferent(ways)) {
    const SlicedStack stack = readStack(archive.open(*rows[i]));
    samples.push_back(sampledStack(stack.header, runsOfStack(stack)));
    fused.push_back(stack.header);
  }
  return fusedStacks(std::move(samples));
}

StackSource::StackSource(const Archive& archive, long cycle, std::string field)
    : cycle_(cycle), field_(std::move(field)) {
  grid_ = samplesOfStacks(archive, cycle_, field_, headers_).upload();
}

VolumeView StackSource::draw(const Look& look, const TransferFunction& function,
                             const Camera& camera, ImageSize size) {
  const Box& domain = header().domain;
  Look clipped = look;
  clipped.clip = domain;
  if (look.clip) {
    clipped.clip->low = glm::max(domain.low, look.clip->low);
    clipped.clip->high = glm::max(clipped.clip->low, glm::min(domain.high, look.clip->high));
  }
  VolumeView view =
      painter_.draw(grid_, clipped, function, &*header().partition, domain, camera, size);
  if (look.trust) {
    const std::vector<float> unseen = this->unseen(camera, size, Stretch(look.scale, domain));
    for (std::size_t i = 0; i < unseen.size(); ++i) {
      view.guess[i] = std::max(view.guess[i], unseen[i]);
    }
  }
  return view;
}

std::vector<float> StackSource::unseen(const Camera& camera, ImageSize size,
                                       const Stretch& stretch) const {
  const Box domain = stretch.box(header().domain);
  const glm::dmat4 gridFromWorld = glm::inverse(grid_.worldFromGrid);
  constexpr double kRim = 1e-3;  // stacks end a hair before the domain
  std::vector<float> share(size.pixels(), 0.0f);
  for (std::size_t i = 0; i < share.size(); ++i) {
    const auto width = std::size_t(size.width);
    const Ray ray = camera.rayThrough({double(i % width) + 0.5, double(i / width) + 0.5}, size);
    const bool perspective = camera.projection == Projection::Perspective;
    const auto whole = inside(ray.origin, ray.direction, domain.low, domain.high, perspective);
    if (!(whole[0] < whole[1])) continue;
    const glm::dvec3 origin(gridFromWorld * glm::dvec4(ray.origin, 1.0));
    const glm::dvec3 way(gridFromWorld * glm::dvec4(ray.direction, 0.0));
    const auto seen = inside(origin, way, glm::dvec3(-kRim), glm::dvec3(1.0 + kRim), perspective);
    const double both = std::min(whole[1], seen[1]) - std::max(whole[0], seen[0]);
    share[i] = float(1.0 - std::max(both, 0.0) / (whole[1] - whole[0]));
  }
  return share;
}

std::string StackSource::note(const Camera& camera) const {
  std::string names;
  double nearest = 0.0;
  for (const ProxyHeader& header : headers_) {
    names += (names.empty() ? "'" : ", '") + header.view + "'";
    nearest = std::max(nearest, std::abs(glm::dot(header.camera.forward, camera.forward)));
  }
  const double degrees = std::acos(std::min(nearest, 1.0)) * 180.0 / glm::pi<double>();
  return fmt::format(
      "uses sliced: {} {} as a grid of {} x {} x {} values{}; the nearest looks within {:.3g} "
      "degrees of the direction asked for",
      headers_.size() == 1 ? "stack" : "stacks", names, grid_.size.x, grid_.size.y, grid_.size.z,
      headers_.size() == 1 ? "" : ", fused where they are surest", degrees);
}

std::string errorOfStack(const ProxyHeader& header, int levels) {
  double widest = 0.0, thickest = 0.0;
  const auto bounds = header.partition->bounds();
  for (std::size_t k = 0; k + 1 < bounds.size(); ++k) {
    widest = std::max(widest, bounds[k + 1] - bounds[k]);
  }
  for (std::size_t s = 0; s + 1 < header.slabDepths.size(); ++s) {
    thickest = std::max(thickest, header.slabDepths[s + 1] - header.slabDepths[s]);
  }
  return fmt::format(
      "{} slabs of {:.4g}, lengths within {:.3g} of a slab, values within {:.4g}; within a slab "
      "the order is exact where values turn twice at most, turns lie within {:.4g}",
      header.slabDepths.size() - 1, thickest, 1.0 / levels, widest, thickest / SlicedStack::kTurns);
}

int levelsOfStack(const ExrFile& file) {
  return int(std::lround(1.0 / (file.unitOf("slab00") * kHalfQuantum)));
}

}  // namespace vestige
