// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "adaptor/compositing/march_types.h"
#include "proxy/base/error.h"

namespace vestige {
namespace {

void requireSamePlanes(const RayImage& a, const RayImage& b) {
  const bool same =
      a.size == b.size && a.channels == b.channels && a.entry.size() == b.entry.size() &&
      a.exit.size() == b.exit.size() && a.attenuation.size() == b.attenuation.size() &&
      a.transmittance.size() == b.transmittance.size() && a.length.size() == b.length.size() &&
      a.moment.size() == b.moment.size() && a.runs.size() == b.runs.size() &&
      a.first.size() == b.first.size() && a.last.size() == b.last.size() &&
      a.depth.size() == b.depth.size() && a.normal.size() == b.normal.size() &&
      a.mip.size() == b.mip.size() && a.reference.size() == b.reference.size();
  if (!same) {
    throw Error(ErrorCode::InvalidArgument,
                "ray images of " + std::to_string(a.size.width) + " x " +
                    std::to_string(a.size.height) + " pixels and " + std::to_string(a.channels) +
                    " channels, and of " + std::to_string(b.size.width) + " x " +
                    std::to_string(b.size.height) + " and " + std::to_string(b.channels) +
                    ", or of different planes, cannot be composited");
  }
}

void add(std::vector<float>& to, const std::vector<float>& from) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i] += from[i];
}

/// to += weight * from, plane by plane.
void addWeighted(std::vector<float>& to, const std::vector<float>& weight,
                 const std::vector<float>& from) {
  for (std::size_t begin = 0; begin < to.size(); begin += weight.size()) {
    for (std::size_t i = 0; i < weight.size(); ++i) to[begin + i] += weight[i] * from[begin + i];
  }
}

/// Whether a ray leaves the front image where it enters the back one, up to rounding.
bool touches(float exit, float entry) {
  return std::abs(entry - exit) <= 1e-5f * std::max(std::abs(entry), std::abs(exit));
}

/// A run that goes on through the shared face was counted on both sides.
void joinRuns(RayImage& front, const RayImage& back) {
  if (front.runs.empty()) return;
  const std::size_t pixels = front.size.pixels();
  for (std::size_t i = 0; i < pixels; ++i) {
    const std::uint8_t channel = front.last[i];
    if (channel == kMiss || channel != back.first[i]) continue;
    if (touches(front.exit[i], back.entry[i])) front.runs[channel * pixels + i] -= 1.0f;
  }
}

void nearestCrossings(RayImage& front, const RayImage& back) {
  const std::size_t pixels = front.size.pixels();
  for (std::size_t i = 0; i < front.depth.size(); ++i) {
    if (front.depth[i] <= back.depth[i]) continue;
    front.depth[i] = back.depth[i];
    const std::size_t layer = i / pixels, pixel = i % pixels;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t at = (3 * layer + c) * pixels + pixel;
      front.normal[at] = back.normal[at];
    }
  }
}

}  // namespace

void compositeUnder(RayImage& front, const RayImage& back) {
  requireSamePlanes(front, back);
  joinRuns(front, back);
  nearestCrossings(front, back);
  add(front.length, back.length);
  add(front.moment, back.moment);
  add(front.runs, back.runs);
  if (!front.transmittance.empty()) {
    addWeighted(front.attenuation, front.transmittance, back.attenuation);
    addWeighted(front.reference, front.transmittance, back.reference);
    for (std::size_t i = 0; i < front.transmittance.size(); ++i) {
      front.transmittance[i] *= back.transmittance[i];
    }
  }
  for (std::size_t i = 0; i < front.mip.size(); ++i) {
    front.mip[i] = std::fmax(front.mip[i], back.mip[i]);
  }
  for (std::size_t i = 0; i < front.first.size(); ++i) {
    if (front.first[i] == kMiss) front.first[i] = back.first[i];
    if (back.last[i] != kMiss) front.last[i] = back.last[i];
  }
  for (std::size_t i = 0; i < front.entry.size(); ++i) {
    front.entry[i] = std::min(front.entry[i], back.entry[i]);
    front.exit[i] = std::max(front.exit[i], back.exit[i]);
  }
}

namespace {

/// Which of two disjoint boxes rays meet first: -1 the first, +1 the second, 0 if no ray meets
/// both. Orthographic: box b holds a point of box a moved by t along the view. Perspective: it
/// holds one whose distance from the eye is t times that of a point of a, in the same direction. As
/// a and b are boxes, such t make an interval that each axis bounds on its own.
int nearer(const Box& a, const Box& b, const Camera& camera) {
  const bool perspective = camera.projection == Projection::Perspective;
  double least = perspective ? 0.0 : -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
  // Keeps the t with p * t <= q.
  const auto require = [&](double p, double q) {
    if (p > 0.0) {
      most = std::min(most, q / p);
    } else if (p < 0.0) {
      least = std::max(least, q / p);
    } else if (q <= 0.0) {
      most = least;
    }
  };
  for (int axis = 0; axis < 3; ++axis) {
    const double eye = camera.position[axis], along = camera.forward[axis];
    if (perspective) {
      require(a.low[axis] - eye, b.high[axis] - eye);
      require(eye - a.high[axis], eye - b.low[axis]);
    } else {
      require(along, b.high[axis] - a.low[axis]);
      require(-along, a.high[axis] - b.low[axis]);
    }
  }
  if (!(least < most)) return 0;
  const double here = perspective ? 1.0 : 0.0;
  return most - here > here - least ? -1 : 1;
}

double centreDepth(const Box& box, const Camera& camera) {
  return glm::dot(box.center() - camera.position, camera.forward);
}

}  // namespace

std::vector<std::size_t> visibilityOrder(std::span<const Box> boxes, const Camera& camera) {
  if (camera.projection == Projection::MultiPerspective) {
    throw Error(ErrorCode::InvalidArgument,
                "rays of a multi-perspective camera meet boxes in no common order");
  }
  const std::size_t count = boxes.size();
  std::vector<std::vector<std::size_t>> behind(count);
  std::vector<std::size_t> inFront(count, 0);  // how many not yet placed ones are nearer
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t b = a + 1; b < count; ++b) {
      const int order = nearer(boxes[a], boxes[b], camera);
      if (order == 0) continue;
      behind[order < 0 ? a : b].push_back(order < 0 ? b : a);
      ++inFront[order < 0 ? b : a];
    }
  }
  std::vector<std::size_t> order;
  std::vector<bool> placed(count, false);
  while (order.size() < count) {
    // The nearest of those that nothing hides; where boxes hide one another in a ring, of those
    // that the fewest hide.
    std::size_t best = count;
    for (std::size_t i = 0; i < count; ++i) {
      if (placed[i]) continue;
      if (best == count || inFront[i] < inFront[best] ||
          (inFront[i] == inFront[best] &&
           centreDepth(boxes[i], camera) < centreDepth(boxes[best], camera))) {
        best = i;
      }
    }
    placed[best] = true;
    order.push_back(best);
    for (std::size_t hidden : behind[best]) --inFront[hidden];
  }
  return order;
}

}  // namespace vestige
