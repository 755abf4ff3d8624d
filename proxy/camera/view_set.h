// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "proxy/camera/camera.h"

namespace vestige {

/// A camera with the name by which the archive and its users call it ([a-z0-9_+-.]+).
struct View {
  std::string name;
  Camera camera;
};

/// The world's up axis is +z. `front` stands on the -y side and looks along +y; `back`, `left`
/// (from -x), `right` (from +x), `top` (from +z, up = +y), `bottom` (from -z, up = +y).
/// Returns the framed views of a set by name:
///   "front", "back", "left", "right", "top", "bottom": that one;  "axes": these six;
///   "sphere:N": N >= 1 directions on a Fibonacci sphere, named "sphere000" ...;
///   "orbit:AZ,EL": front orbited by degrees (Camera::orbited), named "orbit_AZ_EL".
/// Names of multi-perspective views end in "_distorted", so that they may stand beside the others.
/// Throws Config with the name and the choices when the name is none of these.
std::vector<View> viewSet(const std::string& name, const Box& box, double aspect,
                          Projection projection = Projection::Orthographic,
                          double fieldOfView = 0.5, double convergence = 1.0);

}  // namespace vestige
