// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "proxy/camera/box.h"
#include "proxy/camera/camera.h"
#include "proxy/classifier/classifier.h"
#include "proxy/customization/customization.h"
#include "proxy/transfer/transfer_function.h"

namespace vestige {

/// Auto: phong for isosurfaces, else none.
enum class Shading { Auto, None, Phong };
/// Which proxy recomposes the picture at a stored view (method §2 "opacity change").
enum class Via { Auto, Length, Attenuation };
/// How the segments of a ray are put in order: by mean depth, or by the runs that the stored
/// counts, lengths and mean depths allow to be reconstructed (docs/exploring.md "Order"). Runs are
/// truer and take longer: auto reconstructs them for views of at most kRunsPixels pixels.
enum class Order { Auto, Runs, Mean };
inline constexpr std::size_t kRunsPixels = 512 * 512;
enum class NormalSource { Stored, Depth };
/// Whose colours a recomposed picture has: the transfer function's, or those that the archive's
/// table of learned colours gives each distribution of attenuation [Tikhonova 2010, §6.2].
enum class Coloring { Function, Learned };
/// What the picture is made of: the intervals (volume) or warped depth layers; MIP; the run's own
/// reference rendering; piecewise-analytic layers (layered); the stored field; sliced stacks;
/// virtual rays through a multi-perspective view. Classifiers: features as the run integrated them,
/// or fields or stacks, classified anew. Auto:
/// at a stored view that the look does not edit the reference; the field where it states less error
/// (stated_error.h); else at a stored view its stack, else volume; when rotated stacks, else
/// layers, else layered.
enum class Source {
  Auto,
  Volume,
  Layers,
  Mip,
  Reference,
  Layered,
  Field,
  Sliced,
  Virtual,
  Features
};
/// What is drawn of a source that is a grid (fields, stacks): emission and absorption, surfaces of
/// equal value, the greatest value along each ray, or a plane.
enum class Draw { Volume, Isosurface, Mip, Slice };

/// Degrees in the viewer's frame: 0,0 shines from the viewer, azimuth 90 from the right, elevation
/// 90 from above.
struct Light {
  double azimuth = 0.0, elevation = 0.0;
  double intensity = 1.0;
  friend bool operator==(const Light&, const Light&) = default;
};

/// An orbit of the viewer about the domain's centre in degrees (Camera::orbited).
struct Rotation {
  double azimuth = 0.0, elevation = 0.0, roll = 0.0;
  friend bool operator==(const Rotation&, const Rotation&) = default;
  /// Whole turns are none.
  bool isZero() const {
    const auto whole = [](double angle) { return std::remainder(angle, 360.0) == 0.0; };
    return whole(azimuth) && whole(elevation) && whole(roll);
  }
};

/// What the picture's frame holds. Auto: what the stored one holds, widened as far as a turn or a
/// scale needs so that no more of the domain is cut off. Stored: the stored frame, whatever is cut
/// off. Fit: the domain, or what the clip box leaves of it. Orbit: the same from all azimuths.
enum class Frame { Auto, Stored, Fit, Orbit };

/// A surface of equal value. Its colour is "#rrggbb", "map" (the colour map's at its value), or
/// empty for one of its own (surface_palette.h).
struct SurfaceLook {
  double value = 0.0, opacity = 1.0;
  std::string color{};
  friend bool operator==(const SurfaceLook&, const SurfaceLook&) = default;
};

/// Blinn-Phong weights.
struct Material {
  double ambient = 0.3, diffuse = 0.7, specular = 0.25, shininess = 32.0;
  friend bool operator==(const Material&, const Material&) = default;
};

/// Proxy ambient occlusion [Tikhonova 2010, §5, eq. 5]. The radius is a fraction of the
/// domain's diagonal.
struct AmbientOcclusion {
  bool on = false;
  double strength = 1.0, radius = 0.05;
  friend bool operator==(const AmbientOcclusion&, const AmbientOcclusion&) = default;
};

/// Depth-aware enhancement [Tikhonova 2010, §6.5, eq. 11].
struct Enhancement {
  bool on = false;
  double lambda = 1.5, gamma = 1.0;
  friend bool operator==(const Enhancement&, const Enhancement&) = default;
};

/// How the seeds of a customisation are drawn: not at all, in the colour that they make of the
/// middle of the colour map, or in one of their own.
enum class Seeds { None, Value, Identity };

struct Annotations {
  bool colorbar = false, axes = false, box = false, time = false;
  Seeds seeds = Seeds::None;
  friend bool operator==(const Annotations&, const Annotations&) = default;
};

/// The whole state of a picture: a look and an archive give the same picture, always. What is left
/// empty takes the archive's own value. JSON keys and defaults: docs/exploring.md "Looks".
struct Look {
  std::optional<long> cycle;   ///< neither cycle nor time: the last step
  std::optional<double> time;  ///< the stored step nearest to it
  std::string field, view;     ///< empty: the archive's first
  Source source = Source::Auto;
  std::optional<ImageSize> size;  ///< empty: as stored
  Rotation rotate;
  Draw draw = Draw::Volume;
  std::vector<SurfaceLook> isosurfaces;  ///< at most 8; empty: opaque, at the peaks of opacity
  std::optional<glm::dvec4> slice;       ///< dot(slice.xyz, x) = slice.w; empty: through the middle
  std::optional<Box> clip;               ///< world; what is outside is not drawn

  Frame frame = Frame::Auto;
  std::vector<Rotation> frameFor;    ///< one frame that holds all of these, in place of `rotate`
  double zoom = 1.0;                 ///< of the frame, about its middle
  glm::dvec2 pan{0.0};               ///< moves what is seen right and up, in heights of the picture
  std::optional<glm::dvec3> center;  ///< world: in the middle of the picture, and turned about
  glm::dvec3 scale{1.0};  ///< stretches the world's axes; equal factors change nothing (stretch.h)

  std::optional<std::vector<OpacityPoint>> opacity;  ///< empty: the run's base
  std::optional<double> referenceLength;
  std::string colormap;  ///< empty: the run's
  std::optional<std::pair<double, double>> colorRange;
  std::vector<double> factors;                 ///< empty: all 1; else one an interval
  std::optional<Customization> customization;  ///< by position

  std::string classifier;  ///< JSON text of classifierFromJson(); empty: the archive's, or none
  std::vector<FeatureEdit> features;  ///< changes of the classifier's features

  Coloring color = Coloring::Function;
  Via via = Via::Auto;
  Order order = Order::Auto;
  Shading shading = Shading::Auto;
  NormalSource normals = NormalSource::Stored;
  std::vector<Light> lights;  ///< empty: one at 30, 30; under Shading::Auto at 20, 20
  Material material;
  AmbientOcclusion ao;
  Enhancement enhance;
  bool trust = false;
  Annotations annotations;
  std::optional<glm::dvec3> background = glm::dvec3(0.0);  ///< sRGB; empty: transparent

  bool isLit() const {
    return shading == Shading::Phong || (shading == Shading::Auto && draw == Draw::Isosurface);
  }
  /// Whether the axes have other proportions than the world's.
  bool isStretched() const { return scale.x != scale.y || scale.y != scale.z; }
  /// Whether its customisation changes anything.
  bool isCustomized() const { return customization && !customization->isNeutral(); }
  /// Whether only a grid can show it.
  bool needsGrid() const { return draw != Draw::Volume || clip.has_value(); }
  /// Throws Config naming the key unless every value is in its stated range.
  void validate() const;
  friend bool operator==(const Look&, const Look&) = default;
};

nlohmann::json toJson(const Look& look);
/// Throws Config naming the key: unknown keys, wrong types, bad values.
Look lookFromJson(const nlohmann::json& json);
/// The same from a file's text; a syntax error is Config with line and column.
Look lookFromText(const std::string& text);

/// sRGB of "#rrggbb"; nothing for any other text.
std::optional<glm::dvec3> colorFromHex(const std::string& text);
/// "black", "white", "grey", "transparent" or "#rrggbb"; throws Config.
std::optional<glm::dvec3> backgroundFromText(const std::string& text);
std::string textFromBackground(const std::optional<glm::dvec3>& background);

}  // namespace vestige
