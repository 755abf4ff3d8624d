// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "proxy/box.h"

namespace vestige {

/// Width and height of a picture in pixels, both >= 1.
struct ImageSize {
  int width = 512;
  int height = 512;
  std::size_t pixels() const { return std::size_t(width) * std::size_t(height); }
  double aspect() const { return double(width) / double(height); }
  friend bool operator==(const ImageSize&, const ImageSize&) = default;
};

/// The smallest picture of square pixels that has no fewer on either side than one of `size` whose
/// pixels are `pixelAspect` times as wide as high; no side grows past 4096.
ImageSize squarePixels(ImageSize size, double pixelAspect);

/// A ray in world space. `direction` is a unit vector; one unit along it is `depthPerLength` units
/// of planar depth Z (method §0: ds = dZ / cos θ).
struct Ray {
  glm::dvec3 origin;
  glm::dvec3 direction;
  double depthPerLength;
};

enum class Projection { Orthographic, Perspective };

/// A pinhole or orthographic camera (method §0). Eye space: x right, y up, z toward the viewer.
/// Depth Z is planar: the distance from the camera plane (through `position`, normal to `forward`)
/// along `forward`, in world units. Pixel (0, 0) is the top left; its centre is at (0.5, 0.5).
struct Camera {
  Projection projection = Projection::Orthographic;
  glm::dvec3 position{0.0, -1.0, 0.0};
  glm::dvec3 forward{0.0, 1.0, 0.0};  ///< unit
  glm::dvec3 up{0.0, 0.0, 1.0};       ///< unit, orthogonal to forward
  double viewHeight = 1.0;            ///< orthographic: world height of the picture, > 0
  double fieldOfView = 0.5;           ///< perspective: full vertical angle in radians, in (0, π)
  double pixelAspect = 1.0;           ///< width / height of a pixel in the world, > 0
  double nearDepth = 0.0;             ///< Z mapped to NDC z = -1; > 0 for perspective
  double farDepth = 2.0;              ///< Z mapped to NDC z = +1; > nearDepth

  glm::dvec3 right() const;
  /// Width / height of a picture in the world.
  double aspect(ImageSize size) const { return size.aspect() * pixelAspect; }
  /// Rigid: world to eye space and back.
  glm::dmat4 eyeFromWorld() const;
  glm::dmat4 worldFromEye() const;
  /// OpenGL clip space (x right, y up, z in [-w, w]) for a picture of this width / height in
  /// pixels.
  glm::dmat4 clipFromEye(double aspect) const;
  glm::dmat4 eyeFromClip(double aspect) const;
  glm::dmat4 clipFromWorld(double aspect) const;

  /// The ray through a point of the picture, in pixels; orthographic rays start on the camera
  /// plane, perspective rays at `position`.
  Ray rayThrough(glm::dvec2 pixel, ImageSize size) const;
  /// World point to (pixel x, pixel y, planar depth Z); and back, exactly.
  glm::dvec3 project(glm::dvec3 world, ImageSize size) const;
  glm::dvec3 unproject(glm::dvec3 pixelAndDepth, ImageSize size) const;

  /// This camera turned about `center` by an orbit in its own frame: `azimuth` moves the camera to
  /// its right around its up axis, `elevation` then moves it up, `roll` turns the picture
  /// counterclockwise; radians.
  Camera orbited(glm::dvec3 center, double azimuth, double elevation, double roll = 0.0) const;

  /// Throws InvalidArgument naming the value unless every stated range holds and all are finite.
  void validate() const;
  friend bool operator==(const Camera&, const Camera&) = default;
};

/// An orthographic camera that looks along `forward` (any length > 0) at the centre of `box` and
/// shows all of it with 2 % to spare in a picture of this width / height. nearDepth and farDepth
/// bracket the box. A box of zero size gets a camera of height 1.
Camera frameBox(const Box& box, glm::dvec3 forward, glm::dvec3 up, double aspect,
                Projection projection = Projection::Orthographic, double fieldOfView = 0.5);

}  // namespace vestige
