// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/plan/views.h"

#include <algorithm>
#include <cmath>

#include "proxy/format/layout/proxy_layout.h"

namespace vestige {
namespace {

Camera explicitCamera(const ViewConfig& view, const Box& domain, double aspect) {
  const glm::dvec3 forward =
      glm::normalize(view.direction ? *view.direction : *view.target - *view.position);
  const bool vertical = std::abs(forward.z) > 1.0 - 1e-9;
  const glm::dvec3 up =
      view.up.value_or(vertical ? glm::dvec3(0.0, 1.0, 0.0) : glm::dvec3(0.0, 0.0, 1.0));
  Camera camera = view.projection == Projection::MultiPerspective
                      ? frameBoxDistorted(domain, forward, up, aspect, view.convergence)
                      : frameBox(domain, forward, up, aspect, view.projection, view.fieldOfView);
  if (view.height) camera.viewHeight = *view.height;
  if (view.position) {
    camera.position = *view.position;
    // A little more than the domain's depths; perspective cameras inside it see what is ahead.
    const auto depths = depthRange(camera, domain);
    const double margin = 0.01 * std::max(domain.diagonal(), depths.high - depths.low);
    const bool perspective = view.projection == Projection::Perspective;
    const double nearest = perspective ? 1e-3 * std::max(margin, 1e-300) : -HUGE_VAL;
    camera.nearDepth = std::max(depths.low - margin, nearest);
    camera.farDepth = std::max(depths.high + margin, camera.nearDepth + margin);
  }
  if (view.nearDepth) camera.nearDepth = *view.nearDepth;
  if (view.farDepth) camera.farDepth = *view.farDepth;
  camera.validate();
  return camera;
}

}  // namespace

std::vector<View> resolveViews(const Config& config, const Box& domain) {
  const double aspect = config.size.aspect();
  if (config.views.empty()) return viewSet("front", domain, aspect);
  std::vector<View> views;
  for (const auto& view : config.views) {
    if (view.set.empty()) {
      views.push_back({view.name, explicitCamera(view, domain, aspect)});
    } else {
      auto set =
          viewSet(view.set, domain, aspect, view.projection, view.fieldOfView, view.convergence);
      std::move(set.begin(), set.end(), std::back_inserter(views));
    }
  }
  return views;
}

}  // namespace vestige
