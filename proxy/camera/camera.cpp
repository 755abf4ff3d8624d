// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/camera/camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "proxy/base/error.h"

namespace vestige {
namespace {

[[noreturn]] void refuse(const std::string& sentence) {
  throw Error(ErrorCode::InvalidArgument, sentence);
}

std::string text(glm::dvec3 v) { return fmt::format("({}, {}, {})", v.x, v.y, v.z); }

bool finite(glm::dvec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

/// Unit vector along v; dividing by the largest component first keeps tiny and huge vectors whole.
/// Zero when v is zero.
glm::dvec3 unit(glm::dvec3 v) {
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  return largest > 0.0 ? glm::normalize(v / largest) : glm::dvec3(0.0);
}

/// v turned by `angle` counterclockwise about the unit vector `axis` (Rodrigues).
glm::dvec3 turned(glm::dvec3 v, glm::dvec3 axis, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return c * v + s * glm::cross(axis, v) + (1.0 - c) * glm::dot(axis, v) * axis;
}

/// The unit vector nearest to `up` that is orthogonal to `forward`. An `up` along the view line
/// says nothing: then the world axis that is least along it, y before x before z.
glm::dvec3 upright(glm::dvec3 forward, glm::dvec3 up) {
  const auto across = [&](glm::dvec3 v) { return v - glm::dot(forward, v) * forward; };
  glm::dvec3 result = across(unit(up));
  if (glm::length(result) < 1e-6) {
    const glm::dvec3 a = glm::abs(forward);
    const glm::dvec3 axis = a.y <= std::min(a.x, a.z) ? glm::dvec3(0, 1, 0)
                            : a.x <= a.z              ? glm::dvec3(1, 0, 0)
                                                      : glm::dvec3(0, 0, 1);
    result = across(axis);
  }
  // Twice: the first pass leaves a rounding error along forward when up is almost parallel to it.
  return unit(across(unit(result)));
}

/// World height of the picture at depth Z; negative behind a perspective camera, so that the
/// projection stays invertible there.
double heightAt(const Camera& camera, double depth) {
  return camera.projection == Projection::Perspective
             ? 2.0 * depth * std::tan(0.5 * camera.fieldOfView)
             : camera.viewHeight;
}

void requireMatrix(const Camera& camera) {
  if (camera.projection == Projection::MultiPerspective)
    refuse("a multi-perspective camera has no projection matrix");
}

/// `v` made longer by `by`, or shorter; along x where it has no direction.
glm::dvec2 lengthened(glm::dvec2 v, double by) {
  const double length = std::hypot(v.x, v.y);
  return length > 0.0 ? v * (1.0 + by / length) : glm::dvec2(by, 0.0);
}

/// Pixel to (x right, y up) in units of the picture's height, zero in the middle.
glm::dvec2 offsetFromCenter(const Camera& camera, glm::dvec2 pixel, ImageSize size) {
  return {camera.pixelAspect * (pixel.x - 0.5 * size.width) / size.height - camera.shift.x,
          0.5 - pixel.y / size.height - camera.shift.y};
}

/// A shift in normalised device coordinates.
glm::dvec2 ndcShift(const Camera& camera, double aspect) {
  return 2.0 * camera.shift / glm::dvec2(aspect * camera.pixelAspect, 1.0);
}

}  // namespace

ImageSize squarePixels(ImageSize size, double pixelAspect) {
  const auto grown = [](int count, double by) {
    return int(std::lround(std::min(count * std::max(by, 1.0), std::max(count, 4096) * 1.0)));
  };
  return {grown(size.width, pixelAspect), grown(size.height, 1.0 / pixelAspect)};
}

glm::dvec3 Camera::right() const { return glm::cross(forward, up); }

glm::dmat4 Camera::eyeFromWorld() const {
  const glm::dvec3 x = right(), y = up, z = -forward;
  return {x.x,
          y.x,
          z.x,
          0.0,
          x.y,
          y.y,
          z.y,
          0.0,
          x.z,
          y.z,
          z.z,
          0.0,
          -glm::dot(x, position),
          -glm::dot(y, position),
          -glm::dot(z, position),
          1.0};
}

glm::dmat4 Camera::worldFromEye() const {
  return {glm::dvec4(right(), 0.0), glm::dvec4(up, 0.0), glm::dvec4(-forward, 0.0),
          glm::dvec4(position, 1.0)};
}

glm::dmat4 Camera::clipFromEye(double aspect) const {
  requireMatrix(*this);
  const double range = farDepth - nearDepth;
  const glm::dvec2 shifted = ndcShift(*this, aspect);
  glm::dmat4 m(0.0);
  if (projection == Projection::Orthographic) {
    m[0][0] = 2.0 / (viewHeight * aspect * pixelAspect);
    m[1][1] = 2.0 / viewHeight;
    m[2][2] = -2.0 / range;
    m[3][0] = shifted.x;
    m[3][1] = shifted.y;
    m[3][2] = -(farDepth + nearDepth) / range;
    m[3][3] = 1.0;
  } else {
    const double t = std::tan(0.5 * fieldOfView);
    m[0][0] = 1.0 / (t * aspect * pixelAspect);
    m[1][1] = 1.0 / t;
    m[2][0] = -shifted.x;
    m[2][1] = -shifted.y;
    m[2][2] = -(farDepth + nearDepth) / range;
    m[2][3] = -1.0;
    m[3][2] = -2.0 * farDepth * nearDepth / range;
  }
  return m;
}

glm::dmat4 Camera::eyeFromClip(double aspect) const {
  requireMatrix(*this);
  const double range = farDepth - nearDepth;
  const glm::dvec2 shifted = ndcShift(*this, aspect);
  glm::dmat4 m(0.0);
  if (projection == Projection::Orthographic) {
    m[0][0] = 0.5 * viewHeight * aspect * pixelAspect;
    m[1][1] = 0.5 * viewHeight;
    m[2][2] = -0.5 * range;
    m[3][0] = -shifted.x * m[0][0];
    m[3][1] = -shifted.y * m[1][1];
    m[3][2] = -0.5 * (farDepth + nearDepth);
    m[3][3] = 1.0;
  } else {
    const double t = std::tan(0.5 * fieldOfView);
    const double twice = 2.0 * farDepth * nearDepth;
    m[0][0] = t * aspect * pixelAspect;
    m[1][1] = t;
    m[2][3] = -range / twice;
    m[3][0] = -shifted.x * m[0][0];
    m[3][1] = -shifted.y * m[1][1];
    m[3][2] = -1.0;
    m[3][3] = (farDepth + nearDepth) / twice;
  }
  return m;
}

glm::dmat4 Camera::clipFromWorld(double aspect) const {
  return clipFromEye(aspect) * eyeFromWorld();
}

Ray Camera::rayThrough(glm::dvec2 pixel, ImageSize size) const {
  const glm::dvec2 offset = offsetFromCenter(*this, pixel, size);
  if (projection == Projection::Orthographic)
    return {position + viewHeight * (offset.x * right() + offset.y * up), forward, 1.0};
  if (projection == Projection::MultiPerspective) {
    const glm::dvec2 start = viewHeight * offset;
    const double radius = std::hypot(start.x, start.y);
    const glm::dvec2 inward = radius > 0.0 ? -start / (radius * convergence) : glm::dvec2(0.0);
    const glm::dvec3 along = forward + inward.x * right() + inward.y * up;
    const double length = glm::length(along);
    return {position + start.x * right() + start.y * up, along / length, 1.0 / length,
            convergence * radius};
  }
  const double height = heightAt(*this, 1.0);
  const glm::dvec3 along = forward + height * (offset.x * right() + offset.y * up);
  const double length = glm::length(along);
  return {position, along / length, 1.0 / length};
}

glm::dvec3 Camera::project(glm::dvec3 world, ImageSize size) const {
  const glm::dvec3 d = world - position;
  const double depth = glm::dot(d, forward);
  const double pixelsPerLength = size.height / heightAt(*this, depth);
  glm::dvec2 across(glm::dot(d, right()), glm::dot(d, up));
  if (projection == Projection::MultiPerspective) across = lengthened(across, depth / convergence);
  return {0.5 * size.width + (across.x * pixelsPerLength + shift.x * size.height) / pixelAspect,
          0.5 * size.height - across.y * pixelsPerLength - shift.y * size.height, depth};
}

glm::dvec3 Camera::unproject(glm::dvec3 pixelAndDepth, ImageSize size) const {
  const double depth = pixelAndDepth.z;
  glm::dvec2 offset =
      heightAt(*this, depth) * offsetFromCenter(*this, {pixelAndDepth.x, pixelAndDepth.y}, size);
  if (projection == Projection::MultiPerspective) offset = lengthened(offset, -depth / convergence);
  return position + depth * forward + offset.x * right() + offset.y * up;
}

Camera Camera::orbited(glm::dvec3 center, double azimuth, double elevation, double roll) const {
  Camera camera = *this;
  const auto turn = [&](glm::dvec3 axis, double angle) {
    camera.position = center + turned(camera.position - center, axis, angle);
    camera.forward = unit(turned(camera.forward, axis, angle));
    camera.up = upright(camera.forward, turned(camera.up, axis, angle));
  };
  if (azimuth != 0.0) turn(up, azimuth);
  if (elevation != 0.0) turn(camera.right(), -elevation);
  // The picture turns counterclockwise when the camera turns clockwise about its view line.
  if (roll != 0.0)
    camera.up =
        upright(camera.forward, std::cos(roll) * camera.up + std::sin(roll) * camera.right());
  return camera;
}

void Camera::validate() const {
  constexpr double kTolerance = 1e-6;  // of stored single-precision vectors
  if (!finite(position)) refuse("camera position " + text(position) + " is not finite");
  if (!finite(forward) || std::abs(glm::length(forward) - 1.0) > kTolerance)
    refuse("camera forward " + text(forward) + " is not a unit vector");
  if (!finite(up) || std::abs(glm::length(up) - 1.0) > kTolerance)
    refuse("camera up " + text(up) + " is not a unit vector");
  if (std::abs(glm::dot(forward, up)) > kTolerance)
    refuse("camera up " + text(up) + " is not orthogonal to forward " + text(forward));
  if (!std::isfinite(viewHeight) || viewHeight <= 0.0)
    refuse(fmt::format("camera viewHeight {} is not positive and finite", viewHeight));
  if (!std::isfinite(pixelAspect) || pixelAspect <= 0.0)
    refuse(fmt::format("camera pixelAspect {} is not positive and finite", pixelAspect));
  if (!(fieldOfView > 0.0 && fieldOfView < std::numbers::pi))
    refuse(fmt::format("camera fieldOfView {} is not between 0 and pi", fieldOfView));
  if (!(convergence >= kLeastConvergence && convergence <= kMostConvergence))
    refuse(fmt::format("camera convergence {} is not in {} .. {}", convergence, kLeastConvergence,
                       kMostConvergence));
  if (!std::isfinite(shift.x) || !std::isfinite(shift.y))
    refuse(fmt::format("camera shift ({}, {}) is not finite", shift.x, shift.y));
  if (!std::isfinite(nearDepth))
    refuse(fmt::format("camera nearDepth {} is not finite", nearDepth));
  if (projection == Projection::Perspective && nearDepth <= 0.0)
    refuse(fmt::format("camera nearDepth {} of a perspective camera is not positive", nearDepth));
  if (!std::isfinite(farDepth) || farDepth <= nearDepth)
    refuse(fmt::format("camera farDepth {} is not beyond nearDepth {}", farDepth, nearDepth));
}

namespace {

constexpr double kSpare = 1.02;

/// Throws unless a camera can be put up before a box.
void requireFrame(const Box& box, glm::dvec3 forward, glm::dvec3 up, double aspect) {
  const glm::dvec3 size = box.size();
  if (!finite(size) || std::min({size.x, size.y, size.z}) < 0.0)
    refuse("box " + text(box.low) + " .. " + text(box.high) + " is not finite and ordered");
  if (!finite(forward) || forward == glm::dvec3(0.0))
    refuse("view direction " + text(forward) + " is not finite and non-zero");
  if (!finite(up)) refuse("view up " + text(up) + " is not finite");
  if (!std::isfinite(aspect) || aspect <= 0.0)
    refuse(fmt::format("picture aspect {} is not positive and finite", aspect));
}

}  // namespace

Camera frameBox(const Box& box, glm::dvec3 forward, glm::dvec3 up, double aspect,
                Projection projection, double fieldOfView) {
  requireFrame(box, forward, up, aspect);
  if (projection == Projection::MultiPerspective)
    return frameBoxDistorted(box, forward, up, aspect);
  if (!(fieldOfView > 0.0 && fieldOfView < std::numbers::pi))
    refuse(fmt::format("field of view {} is not between 0 and pi", fieldOfView));

  Camera camera;
  camera.projection = projection;
  camera.fieldOfView = fieldOfView;
  camera.forward = unit(forward);
  camera.up = upright(camera.forward, up);

  // Half extents along the camera's axes: a box is symmetric about its centre.
  const glm::dvec3 half = 0.5 * box.size();
  const double across = glm::dot(glm::abs(camera.right()), half);
  const double high = glm::dot(glm::abs(camera.up), half);
  const double deep = glm::dot(glm::abs(camera.forward), half);
  const double scale = box.diagonal() > 0.0 ? box.diagonal() : 1.0 / kSpare;

  // The height that fits; a box seen as a point is framed by its diagonal.
  double height = 2.0 * kSpare * std::max(high, across / aspect);
  if (height < 1e-9 * scale) height = kSpare * scale;
  double distance = scale;
  if (projection == Projection::Perspective) {
    // The nearest corner decides: it must fit, and lie in front of the near plane.
    const double fits = 0.5 * height / std::tan(0.5 * fieldOfView) + deep;
    distance = std::max(fits, deep + 0.05 * scale);
    height = 2.0 * distance * std::tan(0.5 * fieldOfView);
  }
  camera.viewHeight = height;
  camera.position = box.center() - distance * camera.forward;
  camera.nearDepth = distance - deep - 0.01 * scale;
  camera.farDepth = distance + deep + 0.01 * scale;
  camera.validate();
  return camera;
}

Camera frameBoxDistorted(const Box& box, glm::dvec3 forward, glm::dvec3 up, double aspect,
                         double convergence) {
  requireFrame(box, forward, up, aspect);
  Camera camera;
  camera.projection = Projection::MultiPerspective;
  camera.convergence = convergence;
  camera.forward = unit(forward);
  camera.up = upright(camera.forward, up);

  const glm::dvec3 half = 0.5 * box.size();
  const double deep = glm::dot(glm::abs(camera.forward), half);
  const double scale = box.diagonal() > 0.0 ? box.diagonal() : 1.0;
  // A point at height y over the pole line is no higher in the picture than y + Z/κ, and as high as
  // that straight above the pole: the extent is the support of the ellipsoid along y + Z/κ.
  const auto extent = [&](glm::dvec3 axis) {
    double most = 0.0;
    for (const double sign : {-1.0, 1.0})
      most = std::max(most, glm::length((sign * axis + camera.forward / convergence) * half));
    return deep / convergence + most;
  };
  double height = 2.0 * kSpare * std::max(extent(camera.up), extent(camera.right()) / aspect);
  if (height < 1e-9 * scale) height = scale;
  camera.viewHeight = height;
  camera.position = box.center() - deep * camera.forward;
  camera.nearDepth = -0.01 * scale;
  camera.farDepth = 2.0 * deep + 0.01 * scale;
  camera.validate();
  return camera;
}

Camera undistorted(const Camera& camera, const Box& box, double aspect) {
  if (camera.projection != Projection::MultiPerspective) return camera;
  return frameBox(box, camera.forward, camera.up, aspect);
}

}  // namespace vestige
