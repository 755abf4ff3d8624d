// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/renderer/framing.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace vestige {
namespace {

/// As much room about a domain as views have.
constexpr double kSpare = 1.02;
constexpr int kOrbitStep = 5;  ///< degrees

double radians(double degrees) { return degrees * (std::numbers::pi / 180.0); }

Camera turned(const Camera& camera, glm::dvec3 about, const Rotation& by) {
  return camera.orbited(about, radians(by.azimuth), radians(by.elevation), radians(by.roll));
}

/// Half of the picture's height: in the world, or of perspective cameras at depth 1.
double halfHeight(const Camera& camera) {
  return camera.projection == Projection::Perspective ? std::tan(0.5 * camera.fieldOfView)
                                                      : 0.5 * camera.viewHeight;
}

void setHalfHeight(Camera& camera, double half) {
  if (camera.projection == Projection::Perspective) {
    camera.fieldOfView = 2.0 * std::atan(half);
  } else {
    camera.viewHeight = 2.0 * half;
  }
}

/// How a picture of some shape sees a box.
class Fit {
 public:
  /// `aspect`: width / height. `half`: half of its height, as above.
  Fit(const Box& box, double aspect, double half) : box_(box), aspect_(aspect), half_(half) {}

  /// Orthographic: the half height about the view axis that holds the box. Perspective: how far the
  /// camera must step back to hold it; below 0 where there is room.
  double needed(const Camera& camera) const {
    const bool perspective = camera.projection == Projection::Perspective;
    double most = perspective ? -HUGE_VAL : 0.0;
    for (int i = 0; i < 8; ++i) {
      const glm::dvec3 way = box_.corner(i) - camera.position;
      const double across = kSpare * std::max(std::abs(glm::dot(way, camera.right())) / aspect_,
                                              std::abs(glm::dot(way, camera.up)));
      const double depth = glm::dot(way, camera.forward);
      // In front of the viewer also where it is thin.
      most = std::max(
          most, perspective ? std::max(across / half_, 0.05 * box_.diagonal()) - depth : across);
    }
    return most;
  }

 private:
  Box box_;
  double aspect_, half_;
};

/// Near and far planes about a box.
void bracket(Camera& camera, const Box& box) {
  double nearest = HUGE_VAL, farthest = -HUGE_VAL;
  for (int i = 0; i < 8; ++i) {
    const double depth = glm::dot(box.corner(i) - camera.position, camera.forward);
    nearest = std::min(nearest, depth);
    farthest = std::max(farthest, depth);
  }
  const double margin = box.diagonal() > 0.0 ? 0.01 * box.diagonal() : 0.01;
  const bool perspective = camera.projection == Projection::Perspective;
  camera.farDepth = perspective ? std::max(farthest + margin, margin) : farthest + margin;
  camera.nearDepth =
      perspective ? std::max(nearest - margin, 1e-3 * camera.farDepth) : nearest - margin;
}

/// The rotations that one frame has to hold.
std::vector<Rotation> rotationsOf(const Look& look) {
  if (look.frame == Frame::Orbit) {
    std::vector<Rotation> all;
    for (int azimuth = 0; azimuth < 360; azimuth += kOrbitStep)
      all.push_back({double(azimuth), look.rotate.elevation, look.rotate.roll});
    return all;
  }
  return look.frameFor.empty() ? std::vector<Rotation>{look.rotate} : look.frameFor;
}

/// Moves the picture, not the viewer, by heights of the picture to the right and up; `half`: of its
/// final height.
void shift(Camera& camera, glm::dvec2 by, double half) {
  if (camera.projection == Projection::Perspective) {
    camera.shift += by;
  } else {
    camera.position -= 2.0 * half * (by.x * camera.right() + by.y * camera.up);
  }
}

void putInTheMiddle(Camera& camera, glm::dvec3 point, double half) {
  const glm::dvec3 way = point - camera.position;
  const double depth =
      camera.projection == Projection::Perspective ? glm::dot(way, camera.forward) : 1.0;
  if (!(depth > 0.0)) return;  // behind the viewer
  shift(
      camera,
      glm::dvec2(glm::dot(way, camera.right()), glm::dot(way, camera.up)) / (-2.0 * half * depth) -
          camera.shift,
      half);
}

/// What is drawn: the domain, or what the clip box leaves of it.
Box shownBox(const Look& look, const Box& domain) {
  if (!look.clip) return domain;
  const Box cut{glm::max(domain.low, look.clip->low), glm::min(domain.high, look.clip->high)};
  return glm::all(glm::lessThan(cut.low, cut.high)) ? cut : domain;
}

}  // namespace

Camera fittedCamera(Camera camera, ImageSize from, ImageSize to) {
  const double grow = std::max(1.0, from.aspect() / to.aspect());
  camera.viewHeight *= grow;
  if (grow > 1.0) camera.fieldOfView = 2.0 * std::atan(grow * std::tan(0.5 * camera.fieldOfView));
  return camera;
}

Camera framedCamera(const Look& look, const Camera& stored, ImageSize viewSize, const Box& domain) {
  const bool held = look.frame == Frame::Auto || look.frame == Frame::Stored;
  if (look.rotate.isZero() && held && (look.frameFor.empty() || look.frame == Frame::Stored) &&
      look.zoom == 1.0 && look.pan == glm::dvec2(0.0) && !look.center && !look.isStretched()) {
    return stored;
  }
  const Stretch stretch(look.scale, domain);
  const Box scene = stretch.box(domain);
  const bool perspective = stored.projection == Projection::Perspective;
  const ImageSize size = look.size.value_or(viewSize);
  // All frames are measured in the final picture; the camera is one of viewSize again at the end.
  const double grow = std::max(1.0, viewSize.aspect() / size.aspect());
  const double half = grow * halfHeight(stored), aspect = size.aspect();
  const glm::dvec3 middle = domain.center();
  const std::vector<Rotation> rotations = rotationsOf(look);

  const glm::dvec3 about = look.center ? stretch.point(*look.center) : middle;
  Camera camera = turned(stored, about, look.rotate);
  double framed = half, back = 0.0;  // the final half height; how far a viewer steps back
  if (look.frame == Frame::Auto) {
    const Fit fit(scene, aspect, half);
    const double before = Fit(domain, aspect, half).needed(stored);
    for (const Rotation& rotation : rotations) {
      const double needed = fit.needed(turned(stored, middle, rotation));
      if (perspective) {
        back = std::max(back, needed - std::max(before, 0.0));
      } else {
        framed = std::max(framed, needed * std::min(1.0, half / before));
      }
    }
  } else if (!held) {
    const Box shown = stretch.box(shownBox(look, domain));
    const Fit fit(shown, aspect, half);
    const double distance =
        std::max(glm::dot(middle - stored.position, stored.forward), 0.05 * scene.diagonal());
    framed = 0.0;
    back = -HUGE_VAL;
    for (const Rotation& rotation : rotations) {
      Camera seen = turned(stored, middle, rotation);
      seen.position = shown.center() - distance * seen.forward;
      (perspective ? back : framed) = std::max(perspective ? back : framed, fit.needed(seen));
    }
    if (perspective || !(framed > 0.0)) framed = half;
    if (!perspective) back = 0.0;
    if (look.frame == Frame::Fit || !look.center)
      camera.position = shown.center() - distance * camera.forward;
  }
  if (perspective) camera.position -= back * camera.forward;
  framed /= look.zoom;
  if (look.center) putInTheMiddle(camera, about, framed);
  shift(camera, look.pan, framed);
  setHalfHeight(camera, framed / grow);
  bracket(camera, scene);
  // Only the pictures that are stored have any but square pixels.
  camera.pixelAspect = 1.0;
  return camera;
}

std::optional<PictureWindow> windowOf(const Camera& stored, ImageSize storedSize,
                                      const Camera& camera, ImageSize size) {
  if (stored.projection != camera.projection) return std::nullopt;
  constexpr double kSame = 1e-9;
  const double away = glm::length(stored.position - camera.position);
  const double scale = std::abs(stored.farDepth) + std::abs(stored.nearDepth);
  if (glm::length(stored.forward - camera.forward) > kSame ||
      glm::length(stored.up - camera.up) > kSame ||
      (stored.projection == Projection::Perspective && away > kSame * scale) ||
      (stored.projection == Projection::MultiPerspective && stored != camera)) {
    return std::nullopt;
  }
  const double depth = 0.5 * (camera.nearDepth + camera.farDepth);
  const auto at = [&](double x, double y) {
    return glm::dvec2(stored.project(camera.unproject({x, y, depth}, size), storedSize));
  };
  return PictureWindow{at(0.0, 0.0), at(size.width, size.height)};
}

std::optional<Camera> ontoStored(const Camera& stored, const Camera& camera, ImageSize viewSize,
                                 ImageSize size, const Box& box) {
  if (stored.projection != camera.projection || stored.projection == Projection::MultiPerspective) {
    return std::nullopt;
  }
  constexpr double kUnseen = 0.5;  // pixels
  const Camera here = fittedCamera(camera, viewSize, size);
  const auto same = [&](const Camera& other) {
    const Camera there = fittedCamera(other, viewSize, size);
    for (int i = 0; i < 8; ++i) {
      const glm::dvec2 way(there.project(box.corner(i), size) - here.project(box.corner(i), size));
      if (!(glm::length(way) < kUnseen)) return false;  // also where it is not a number
    }
    return true;
  };
  // Sizes of pictures are those of square pixels.
  Camera exact = stored;
  exact.pixelAspect = 1.0;
  if (same(exact)) return stored;
  // Another window of the stored picture.
  Camera moved = camera;
  moved.forward = stored.forward;
  moved.up = stored.up;
  if (stored.projection == Projection::Perspective) {
    moved.position = stored.position;
  } else {  // turned with its picture about the middle of the box
    const glm::dvec3 way = box.center() - camera.position;
    moved.position = box.center() - glm::dot(way, camera.right()) * moved.right() -
                     glm::dot(way, camera.up) * moved.up -
                     glm::dot(way, camera.forward) * moved.forward;
  }
  return same(moved) ? std::optional(moved) : std::nullopt;
}

}  // namespace vestige
