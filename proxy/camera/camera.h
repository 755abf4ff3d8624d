// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <limits>

#include "proxy/camera/box.h"

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
/// of planar depth Z (method §1: ds = dZ / cos θ).
struct Ray {
  glm::dvec3 origin;
  glm::dvec3 direction;
  double depthPerLength;
  double lastDepth = std::numeric_limits<double>::infinity();  ///< planar Z at which it ends
};

/// MultiPerspective: the volume distortion camera of [Tikhonova 2010, §4.1-4.2] with a single
/// pole at the picture's centre. The ray of the pixel at radius r (world units on the camera plane)
/// runs from there to the pole line, the view axis, which it meets at depth κ r and where it ends;
/// κ = `convergence`. At depth Z it stands at radius ρ = r - Z/κ: a point (ρ, Z) is seen by the
/// pixel r = ρ + Z/κ in the same direction from the pole, Z/κ being its distortion (eq. 1-2).
enum class Projection { Orthographic, Perspective, MultiPerspective };

/// A pinhole, orthographic or multi-perspective camera (method §1). Eye space: x right, y up, z
/// toward the viewer. Depth Z is planar: the distance from the camera plane (through `position`,
/// normal to `forward`) along `forward`, in world units. Pixel (0, 0) is the top left; its centre
/// is at (0.5, 0.5).
struct Camera {
  static constexpr double kLeastConvergence = 1e-2, kMostConvergence = 1e6;

  Projection projection = Projection::Orthographic;
  glm::dvec3 position{0.0, -1.0, 0.0};
  glm::dvec3 forward{0.0, 1.0, 0.0};  ///< unit
  glm::dvec3 up{0.0, 0.0, 1.0};       ///< unit, orthogonal to forward
  double viewHeight = 1.0;            ///< world height of the picture, > 0; multi-perspective: on
                                      ///< the camera plane; not of perspective cameras
  double fieldOfView = 0.5;           ///< perspective: full vertical angle in radians, in (0, π)
  double pixelAspect = 1.0;           ///< width / height of a pixel in the world, > 0
  double convergence = 1.0;           ///< multi-perspective: κ, kLeast.. to kMostConvergence
  glm::dvec2 shift{0.0};              ///< moves the picture right and up by so many of its heights;
                                      ///< 0 in archives and for multi-perspective cameras
  double nearDepth = 0.0;             ///< Z mapped to NDC z = -1; > 0 for perspective
  double farDepth = 2.0;              ///< Z mapped to NDC z = +1; > nearDepth

  glm::dvec3 right() const;
  /// Width / height of a picture in the world.
  double aspect(ImageSize size) const { return size.aspect() * pixelAspect; }
  /// Rigid: world to eye space and back.
  glm::dmat4 eyeFromWorld() const;
  glm::dmat4 worldFromEye() const;
  /// OpenGL clip space (x right, y up, z in [-w, w]) for a picture of this width / height in
  /// pixels. Throw InvalidArgument for multi-perspective cameras, whose projection no matrix can
  /// make.
  glm::dmat4 clipFromEye(double aspect) const;
  glm::dmat4 eyeFromClip(double aspect) const;
  glm::dmat4 clipFromWorld(double aspect) const;

  /// The ray through a point of the picture, in pixels; perspective rays start at `position`, all
  /// others on the camera plane.
  Ray rayThrough(glm::dvec2 pixel, ImageSize size) const;
  /// World point to (pixel x, pixel y, planar depth Z); and back, exactly. Multi-perspective: for
  /// points with Z >= 0 and pixels whose rays reach Z; a point on the pole line is seen all around
  /// and projected to the right.
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

/// A camera that looks along `forward` (any length > 0) at the centre of `box` and shows all of it
/// with 2 % to spare in a picture of this width / height. nearDepth and farDepth bracket the box. A
/// box of zero size gets a camera of height 1.
Camera frameBox(const Box& box, glm::dvec3 forward, glm::dvec3 up, double aspect,
                Projection projection = Projection::Orthographic, double fieldOfView = 0.5);
/// The same for a multi-perspective camera. Its plane touches the box, and its picture is as large
/// as the ellipsoid inscribed in the box needs to be seen from all sides that its rays reach: for a
/// ball and κ = 1, 1 + √2 = 2.4 radii from the pole. What lies at the box's far edges is beyond
/// the picture, in exchange for pixels that are not finer than needed for what mostly is in
/// domains; `viewHeight` may be raised afterwards. The smaller κ, the more of the sides and the
/// fewer pixels for the front.
Camera frameBoxDistorted(const Box& box, glm::dvec3 forward, glm::dvec3 up, double aspect,
                         double convergence = 1.0);
/// The camera itself; of a multi-perspective one, the orthographic camera that frames `box` from
/// the same direction.
Camera undistorted(const Camera& camera, const Box& box, double aspect);

}  // namespace vestige
