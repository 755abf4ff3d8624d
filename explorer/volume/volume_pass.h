// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "explorer/gpu/custom_textures.h"
#include "explorer/gpu/light.h"
#include "explorer/gpu/probed_rays.h"
#include "explorer/gpu/rendered_view.h"
#include "explorer/volume/look_grid.h"
#include "proxy/camera/box.h"
#include "proxy/camera/camera.h"

namespace vestige {

/// What is drawn of a grid: emission and absorption (method §1); the greatest value along the ray;
/// surfaces of equal value; a plane through the grid. Maximum and isosurfaces need scalars.
enum class VolumeMode { Compositing, Maximum, Isosurface, Slice };

/// A surface of equal value: linear RGB and opacity of one crossing.
struct Isosurface {
  double value = 0.0;
  glm::dvec3 color{1.0};
  double opacity = 1.0;
};
inline constexpr std::size_t kMaxIsosurfaces = 8;

/// The openness of a grid's cells, 1 = nothing near: made once a look by VolumePass::occlusion.
struct OcclusionGrid {
  gl::Texture open;  ///< R8, 3-D, filtered, over [0, 1]^3 of the grid
};

/// What a grid of fields is drawn with.
struct ClassifiedLook {
  const Classifier* classifier = nullptr;  ///< normalised
  std::vector<ChannelOptics> optics;       ///< [channel]
};

/// Position-dependent classification of a scalar grid (classification §6): gamma at each sample,
/// functions, factor and shift at the middle of a step.
struct CustomDrawing {
  const CustomTextures* textures = nullptr;
  std::vector<const OpticsTable*> blends;  ///< of Customization::functions, ends as the table's
  double low = 0.0, high = 1.0;            ///< values that gamma leaves where they are
  glm::dmat4 worldFromScene{1.0};          ///< where a look stretches the world (stretch.h)
  /// The values that those in a range may become.
  glm::dvec2 widened(glm::dvec2 range) const;
};

/// How a grid is drawn.
struct VolumeSetup {
  Camera camera;
  ImageSize size;
  VolumeMode mode = VolumeMode::Compositing;
  const OpticsTable* table = nullptr;  ///< of a scalar grid; LookGrid::leaps must be up to date
  const ClassifiedLook* classified = nullptr;  ///< of a grid of fields; leaps must be up to date
  std::optional<Box> clip;                     ///< in world units: what is outside is not drawn
  const LightSetup* light = nullptr;  ///< from lightSetup(look, camera, camera, ...); null: none
  const OcclusionGrid* occlusion = nullptr;
  const CustomDrawing* custom = nullptr;
  std::vector<Isosurface> isosurfaces;  ///< at most kMaxIsosurfaces
  glm::dvec4 plane{0.0};                ///< slice: the points with dot(plane.xyz, x) = plane.w
  double sliceThickness = 0.0;          ///< slice of optics: length that its opacity stands for
  double step = 0.5;                    ///< in cells of the axis that the ray crosses fastest, > 0
  double opaque = 1e-3;                 ///< rays end where so much light is left
  /// Scalar: values are moved by so much of what they may be wrong by (LookGrid::wrong).
  double doubt = 0.0;
  bool skip = true;  ///< skip bricks that have nothing to show
  /// Above 0, where cells are several pixels wide, every other pixel is cast, and those between
  /// only where colours bend by more than this: 6 % of them in turbulence of 256^3 at 1024^2.
  double tolerance = 0.0;
};

/// A picture of a grid; depth: the mean weighted by opacity; guess: what comes from cells that are
/// one.
using VolumeView = RenderedView;

/// Ray casting of 3-D grids (method §1): front to back, trilinear, samples at planar depths that
/// depend on camera and grid alone. Opacities follow the exact length of each step, so that a
/// homogeneous medium is exact at any step. Several grids of one scene (stacks seen along different
/// axes) are drawn one by one and their pictures blended by weight: each has its own step and its
/// own empty space, and away from the bands of transition one weight is 1. Made, used and destroyed
/// in Device::run.
class VolumePass {
 public:
  /// Throws InvalidArgument naming what does not fit the grid's content.
  VolumeView render(const LookGrid& grid, const VolumeSetup& setup);
  /// The longest step of 1/2, 1, 2, 3 and 4 cells through a scalar grid that changes no more of a
  /// picture than can be seen, judged by 32 x 32 rays askew through the box: hard edges of the
  /// opacity need short steps, smooth functions do not. Depends on grid, table and customisation
  /// alone, which may be null.
  double longestStep(const LookGrid& grid, const OpticsTable& table, const Box& box,
                     const CustomDrawing* custom = nullptr);
  /// Finds the bricks of an optics grid that have something to show.
  void findBricks(LookGrid& grid);
  /// ... of a scalar grid under a table; of a scalar grid that shows isosurfaces.
  static void findBricks(LookGrid& grid, const OpticsTable& table,
                         const CustomDrawing* custom = nullptr);
  static void findBricks(LookGrid& grid, std::span<const Isosurface> surfaces);
  /// ... of a grid of fields under a normalised classifier.
  static void findBricks(LookGrid& grid, const Classifier& classifier);
  /// The optics of each cell of a grid of fields, and their bricks: what light and occlusion need.
  LookGrid baked(const LookGrid& grid, const ClassifiedLook& look);
  /// Finds LookGrid::gradient, which light needs: of extinction for optics, hence once a look, and
  /// of values for scalars, once and for all.
  void findGradients(LookGrid& grid);
  /// Local ambient occlusion: the light that reaches a cell, through the extinction of a grid
  /// reduced by 4, from all sides no farther away than the radius. A cell on a flat opaque face
  /// counts as fully open. `table` belongs to scalar grids.
  OcclusionGrid occlusion(const LookGrid& grid, double radiusWorld,
                          const OpticsTable* table = nullptr);

 private:
  using Defines = std::vector<std::pair<std::string, std::string>>;
  const gl::Program& program(const std::string& name, std::string_view fragment,
                             const Defines& defines);
  /// Makes the program of a setup current, all uniforms and textures set.
  const gl::Program& bind(const LookGrid& grid, const VolumeSetup& setup);
  void drawLayers(const gl::Program& pass, const gl::Texture& target, glm::ivec3 size);
  std::map<std::string, gl::Program> programs_;
  ProbedRays rays_;
  gl::Framebuffer framebuffer_;
  gl::VertexArray empty_;
};

}  // namespace vestige
