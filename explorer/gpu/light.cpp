// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/gpu/light.h"

#include <cmath>

#include "explorer/picture/stretch.h"

namespace vestige {
namespace {

double radians(double degrees) { return degrees * (3.14159265358979323846 / 180.0); }

}  // namespace

LightSetup lightSetup(const Look& look, const Camera& source, const Camera& target,
                      const Box& domain) {
  LightSetup setup;
  const glm::dmat4 sourceFromTarget = source.eyeFromWorld() * target.worldFromEye();
  // Unasked for, a headlight a little off the axis, which leaves nothing that is seen in the dark.
  const double aside = look.shading == Shading::Auto ? 20.0 : 30.0;
  const std::vector<Light> lights =
      look.lights.empty() ? std::vector<Light>{{aside, aside, 1.0}} : look.lights;
  for (const Light& light : lights) {
    const double azimuth = radians(light.azimuth), elevation = radians(light.elevation);
    const glm::dvec3 direction{std::sin(azimuth) * std::cos(elevation), std::sin(elevation),
                               std::cos(azimuth) * std::cos(elevation)};
    setup.directions.push_back(glm::dvec3(sourceFromTarget * glm::dvec4(direction, 0.0)));
    setup.intensities.push_back(light.intensity);
  }
  setup.material = look.material;
  setup.shade = look.isLit();
  setup.normals = look.normals;
  setup.ao = look.ao;
  setup.aoRadiusWorld = look.ao.radius * domain.diagonal();
  const Stretch stretch(look.scale, domain);
  if (!stretch.none()) {
    setup.stretch = source.eyeFromWorld() * stretch.sceneFromWorld() * source.worldFromEye();
    setup.stretchNormal = glm::transpose(glm::inverse(glm::dmat3(setup.stretch)));
  }
  setup.viewer = sourceFromTarget * (target.projection == Projection::Perspective
                                         ? glm::dvec4(0.0, 0.0, 0.0, 1.0)
                                         : glm::dvec4(0.0, 0.0, 1.0, 0.0));
  return setup;
}

}  // namespace vestige
