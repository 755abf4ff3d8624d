// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/volume/volume_pass.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/type_ptr.hpp>
#include <glm/matrix.hpp>
#include <limits>

#include "axes_glsl.embed.h"
#include "bake_frag.embed.h"
#include "brick_frag.embed.h"
#include "fullscreen_vert.embed.h"
#include "normal_frag.embed.h"
#include "occlusion_frag.embed.h"
#include "proxy/base/error.h"
#include "reduce_frag.embed.h"
#include "volume_frag.embed.h"

namespace vestige {
namespace {

constexpr int kReduce = 4;
/// Rays are probed at every other pixel from so many pixels a cell on.
constexpr double kProbePixels = 2.5;
/// Texture units of the mask and of the axes.
constexpr int kMaskUnit = 12, kAxesUnit = 13;
/// Steps are no shorter than this share of an axis, however close its samples stand.
constexpr double kLeastStep = 0x1p-20;
/// Slopes a cell below this share (of the extinction, or of the range of values) are not lit.
constexpr float kFlatOptics = 0.01f, kFlatScalar = 1e-4f;

[[noreturn]] void refuse(const std::string& what) {
  throw Error(ErrorCode::InvalidArgument, "drawing a grid: " + what);
}

bool lights(const VolumeSetup& setup) {
  return setup.light && setup.light->shade &&
         (setup.mode == VolumeMode::Compositing || setup.mode == VolumeMode::Isosurface);
}

void checkSetup(const LookGrid& grid, const VolumeSetup& setup) {
  const bool scalar = grid.content == GridContent::Scalar;
  const bool surfaces = setup.mode == VolumeMode::Isosurface;
  if (!scalar && (surfaces || setup.mode == VolumeMode::Maximum)) {
    refuse("isosurfaces and maxima need values, the grid holds optics");
  }
  if (scalar && !surfaces && !setup.table) refuse("values need a table of optics");
  if (grid.content == GridContent::Fields && !setup.classified) {
    refuse("fields need a classifier");
  }
  if (surfaces && (setup.isosurfaces.empty() || setup.isosurfaces.size() > kMaxIsosurfaces)) {
    refuse(std::to_string(setup.isosurfaces.size()) + " isosurfaces, 1 to " +
           std::to_string(kMaxIsosurfaces) + " can be drawn");
  }
  if (setup.custom && !scalar && !setup.custom->blends.empty()) {
    refuse("only values of one field can be blended to other functions");
  }
  if (!(setup.step > 0.0)) refuse("a step of " + std::to_string(setup.step) + " cells");
  if (lights(setup) && setup.mode == VolumeMode::Compositing && !grid.gradient) {
    refuse("light needs gradients: call findGradients first");
  }
  if (setup.mode == VolumeMode::Slice && !(glm::length(glm::dvec3(setup.plane)) > 0.0)) {
    refuse("a slice needs a plane whose normal is not zero");
  }
}

void setEntries(const gl::Program& program, const LookGrid& grid, const OpticsTable& table) {
  const double perValue = OpticsTable::kEntries / (table.high() - table.low());
  gl::functions().Uniform2f(program.uniform("entryFromTexel"), float(grid.valueUnit * perValue),
                            float((grid.valueZero - table.low()) * perValue));
}

bool usesGradients(const LookGrid& grid, const ClassifiedLook& look) {
  if (look.classifier->needsGradient() && !grid.gradients) {
    refuse("the classifier needs gradients, the grid has none");
  }
  return look.classifier->needsGradient();
}

/// A shader with a text in the place that it leaves for it, "#pragma name".
std::string with(std::string_view shader, std::string_view name, std::string_view inserted) {
  const std::string place = "#pragma " + std::string(name);
  std::string text(shader);
  return text.replace(text.find(place), place.size(), inserted);
}

/// ... with the classifier's own, and with axes.glsl.
std::string withClassifier(std::string_view shader, const Classifier& classifier) {
  return with(shader, "classifier", classifier.glsl());
}
std::string withAxes(std::string_view shader) { return with(shader, "axes", embedded::axes_glsl); }

/// What shaders must know of where a grid's cells stand and which have data.
void addGridDefines(std::vector<std::pair<std::string, std::string>>& defines,
                    const LookGrid& grid) {
  if (grid.mask) defines.emplace_back("GAPS", "1");
  grid.axes.define(defines);
}

void setGrid(const gl::Program& program, const LookGrid& grid) {
  if (grid.mask) gpu::bindSampler(program, "mask", kMaskUnit, *grid.mask);
  grid.axes.bind(program, kAxesUnit);
}

/// The least distance of samples along each axis, in cells of equal width.
glm::dvec3 finestCells(const LookGrid& grid) {
  return glm::max(grid.axes.finest, glm::dvec3(grid.size) * kLeastStep);
}

void addClassifierDefines(std::vector<std::pair<std::string, std::string>>& defines,
                          const LookGrid& grid, const ClassifiedLook& look) {
  defines.emplace_back("FIELDS", "1");
  defines.emplace_back("CHANNELS", std::to_string(look.optics.size()));
  defines.emplace_back("PARAMETERS", std::to_string(look.classifier->parameters().size()));
  if (usesGradients(grid, look)) defines.emplace_back("GRADIENT", "1");
}

void setClassifier(const gl::Program& program, const LookGrid& grid, const ClassifiedLook& look,
                   double scale) {
  const gl::Functions& gl = gl::functions();
  const std::vector<glm::vec4> parameters = look.classifier->parameters();
  gl.Uniform4fv(program.uniform("parameters"), GLsizei(parameters.size()),
                glm::value_ptr(parameters.front()));
  std::vector<glm::vec4> optics;
  for (const ChannelOptics& each : look.optics) {
    optics.push_back(glm::vec4(glm::dvec4(each.emission, each.extinction) / scale));
  }
  gl.Uniform4fv(program.uniform("channelOptics"), GLsizei(optics.size()),
                glm::value_ptr(optics.front()));
  if (usesGradients(grid, look)) gpu::bindSampler(program, "gradients", 6, *grid.gradients);
}

/// Texture units from kCustomUnit on.
void setCustom(const gl::Program& program, const LookGrid& grid, const CustomDrawing& custom,
               const glm::dmat4& worldFromCell) {
  constexpr int kCustomUnit = 7;
  const gl::Functions& gl = gl::functions();
  const glm::mat4 customFromCell(custom.textures->textureFromWorld() * custom.worldFromScene *
                                 worldFromCell);
  gl.UniformMatrix4fv(program.uniform("customFromCell"), 1, GL_FALSE,
                      glm::value_ptr(customFromCell));
  gpu::bindSampler(program, "customOptics", kCustomUnit, custom.textures->optics());
  if (!custom.textures->hasValues() || grid.content != GridContent::Scalar) return;
  gpu::bindSampler(program, "customValues", kCustomUnit + 1, custom.textures->values());
  const double range = custom.high - custom.low;
  gl.Uniform2f(program.uniform("rangeFromTexel"), float(grid.valueUnit / range),
               float((grid.valueZero - custom.low) / range));
  const std::array<const char*, Customization::kMaxFunctions> names{"blend0", "blend1", "blend2"};
  for (std::size_t i = 0; i < custom.blends.size(); ++i) {
    gpu::bindSampler(program, names[i], kCustomUnit + 2 + int(i), custom.blends[i]->texture());
  }
}

void set3(const gl::Program& program, const char* name, const glm::dvec3& value) {
  gl::functions().Uniform3f(program.uniform(name), float(value.x), float(value.y), float(value.z));
}

/// Rays as functions of the pixel: see volume.frag.
struct RayUniforms {
  std::array<glm::dvec3, 3> start, along;  ///< in cells
  glm::dvec4 tangent{0.0};
  double nearest = -1e30;
  double stepDepth = 1.0;
};

RayUniforms raysOf(const Camera& camera, ImageSize size, const glm::dmat4& cellFromWorld,
                   double depthOrigin, const glm::dvec3& finest, const VolumeSetup& setup) {
  RayUniforms rays;
  const glm::dvec3 right = camera.right(), up = camera.up;
  const bool perspective = camera.projection == Projection::Perspective;
  const double height = perspective ? 2.0 * std::tan(0.5 * camera.fieldOfView) : camera.viewHeight;
  const double pixel = height / size.height, wide = pixel * camera.pixelAspect;
  // Pixel (x, y) is at (x - w / 2) * wide to the right and (h / 2 - y) * pixel up.
  const glm::dvec2 left =
      glm::dvec2(-0.5 * size.width * wide, 0.5 * height) - height * camera.shift;
  const glm::dvec3 corner = left.x * right + left.y * up;
  const std::array<glm::dvec3, 3> across{corner, wide * right, -pixel * up};
  const glm::dvec3 middle = camera.position + depthOrigin * camera.forward;
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec3 point = i == 0 ? middle : glm::dvec3(0.0);
    const glm::dvec3 way = i == 0 ? camera.forward : glm::dvec3(0.0);
    rays.start[i] =
        glm::dvec3(cellFromWorld * glm::dvec4(point + (perspective ? depthOrigin : 1.0) * across[i],
                                              i == 0 ? 1.0 : 0.0));
    rays.along[i] =
        glm::dvec3(cellFromWorld * glm::dvec4(way + (perspective ? 1.0 : 0.0) * across[i], 0.0));
  }
  if (perspective) {
    rays.tangent = {left.x, left.y, wide, -pixel};
    rays.nearest = std::max(camera.nearDepth, 0.0) - depthOrigin;
  }
  // The fastest axis of the ray in the middle of the picture and in its corners.
  double fastest = 0.0;
  for (const glm::dvec2 at : {glm::dvec2(0.5), {0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}, {1.0, 1.0}}) {
    const glm::dvec3 way =
        (rays.along[0] + at.x * size.width * rays.along[1] + at.y * size.height * rays.along[2]) /
        finest;
    fastest = std::max({fastest, std::abs(way.x), std::abs(way.y), std::abs(way.z)});
  }
  rays.stepDepth = setup.step / fastest;
  return rays;
}

/// Width in pixels of the narrowest side of a cell, in the middle of the medium.
double pixelsPerCell(const LookGrid& grid, const VolumeSetup& setup) {
  const glm::dvec3 middle(grid.worldFromGrid * glm::dvec4(0.5 * (grid.low + grid.high), 1.0));
  const double depth = glm::dot(middle - setup.camera.position, setup.camera.forward);
  const bool perspective = setup.camera.projection == Projection::Perspective;
  const double height = perspective ? 2.0 * depth * std::tan(0.5 * setup.camera.fieldOfView)
                                    : setup.camera.viewHeight;
  double narrowest = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double cell = finestCells(grid)[axis] / double(grid.size[axis]);
    narrowest = std::min(narrowest, cell * glm::length(glm::dvec3(grid.worldFromGrid[axis])));
  }
  return height > 0.0 ? narrowest * setup.size.height / height : 0.0;
}

void setLight(const gl::Program& program, const LightSetup& light) {
  const gl::Functions& gl = gl::functions();
  std::array<float, 32> from{};
  const std::size_t count = std::min<std::size_t>(light.directions.size(), 8);
  for (std::size_t i = 0; i < count; ++i) {
    for (int c = 0; c < 3; ++c) from[4 * i + std::size_t(c)] = float(light.directions[i][c]);
    from[4 * i + 3] = float(light.intensities[i]);
  }
  gl.Uniform1i(program.uniform("lights"), GLint(count));
  gl.Uniform4fv(program.uniform("lightFrom"), 8, from.data());
  gl.Uniform4f(program.uniform("material"), float(light.material.ambient),
               float(light.material.diffuse), float(light.material.specular),
               float(light.material.shininess));
}

gl::Texture target3D(GLenum format, glm::ivec3 size) {
  const gl::Functions& gl = gl::functions();
  gl::Texture texture(GL_TEXTURE_3D);
  texture.bind(0);
  for (const GLenum name : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER}) {
    gl.TexParameteri(GL_TEXTURE_3D, name, GL_LINEAR);
  }
  for (const GLenum name : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R}) {
    gl.TexParameteri(GL_TEXTURE_3D, name, GL_CLAMP_TO_EDGE);
  }
  gl.TexStorage3D(GL_TEXTURE_3D, 1, format, size.x, size.y, size.z);
  gl::checkErrors("making a 3-D target");
  return texture;
}

}  // namespace

const gl::Program& VolumePass::program(const std::string& name, std::string_view fragment,
                                       const Defines& defines) {
  std::string key = name;
  for (const auto& [define, value] : defines) key += " " + define + value;
  const auto found = programs_.find(key);
  if (found != programs_.end()) return found->second;
  return programs_.emplace(key, gpu::program(embedded::fullscreen_vert, fragment, defines))
      .first->second;
}

VolumeView VolumePass::render(const LookGrid& grid, const VolumeSetup& setup) {
  checkSetup(grid, setup);
  const gl::Functions& gl = gl::functions();
  const ImageSize size = setup.size;
  const auto target = [](ImageSize of) {
    return gpu::texture2D(GL_RGBA32F, of, GL_RGBA, GL_FLOAT, nullptr);
  };
  const gl::Texture color = target(size), info = target(size);
  // Cells that are several pixels wide need not be cast at every pixel.
  const bool probes = pixelsPerCell(grid, setup) >= kProbePixels;
  rays_.render(color, info, size, probes ? setup.tolerance : 0.0, [&](float pixelStep) {
    gl.Uniform1f(bind(grid, setup).uniform("pixelStep"), pixelStep);
    gpu::drawFullscreen(empty_);
  });
  VolumeView view = readDrawnView(size);
  gl::checkErrors("drawing a grid");
  return view;
}

double VolumePass::longestStep(const LookGrid& grid, const OpticsTable& table, const Box& box,
                               const CustomDrawing* custom) {
  constexpr double kVisible = 1.0 / 512.0;  // root of the mean square, linear light
  VolumeSetup setup;
  setup.size = {32, 32};
  setup.camera = frameBox(box, {3.0, 5.0, -2.0}, {0.0, 0.0, 1.0}, 1.0);
  setup.table = &table;
  setup.custom = custom;
  setup.clip = box;
  setup.step = 0.5;
  const Picture wanted = render(grid, setup).picture;
  double longest = setup.step;
  for (const double step : {1.0, 2.0, 3.0, 4.0}) {
    setup.step = step;
    const Picture made = render(grid, setup).picture;
    double squares = 0.0;
    std::size_t seen = 0;
    for (std::size_t i = 0; i < wanted.rgba.size(); i += 4) {
      if (wanted.rgba[i + 3] == 0.0f && made.rgba[i + 3] == 0.0f) continue;
      ++seen;
      for (std::size_t c = i; c < i + 4; ++c) {
        const double difference = double(made.rgba[c]) - double(wanted.rgba[c]);
        squares += 0.25 * difference * difference;
      }
    }
    if (squares > kVisible * kVisible * double(seen)) break;
    longest = step;
  }
  return longest;
}

const gl::Program& VolumePass::bind(const LookGrid& grid, const VolumeSetup& setup) {
  const gl::Functions& gl = gl::functions();
  const bool scalar = grid.content == GridContent::Scalar;
  const bool marches = setup.mode != VolumeMode::Slice;
  const bool shades = lights(setup);
  const bool opens = setup.occlusion && marches && setup.mode != VolumeMode::Maximum;
  const bool skips = setup.skip && marches && setup.mode != VolumeMode::Maximum;
  Defines defines;
  const auto define = [&](bool wanted, const char* name) {
    if (wanted) defines.emplace_back(name, "1");
  };
  define(scalar, "SCALAR");
  define(setup.mode == VolumeMode::Maximum, "MAXIMUM");
  define(setup.mode == VolumeMode::Isosurface, "ISOSURFACE");
  define(setup.mode == VolumeMode::Slice, "SLICE");
  define(shades, "LIT");
  define(opens, "OPEN");
  define(grid.guess.has_value(), "GUESS");
  const bool doubts = scalar && grid.wrong && setup.doubt != 0.0;
  define(doubts, "DOUBT");
  define(skips, "SKIP");
  addGridDefines(defines, grid);
  if (setup.custom) {
    defines.emplace_back("CUSTOM", "1");
    define(scalar && setup.custom->textures->hasValues(), "CUSTOM_VALUES");
    defines.emplace_back("BLENDS", std::to_string(setup.custom->blends.size()));
  }
  const bool fields = grid.content == GridContent::Fields;
  if (fields) addClassifierDefines(defines, grid, *setup.classified);
  const std::string shader = withAxes(embedded::volume_frag);
  const gl::Program& cast =
      fields ? program("volume " + std::string(setup.classified->classifier->kind()),
                       withClassifier(shader, *setup.classified->classifier), defines)
             : program("volume", shader, defines);
  cast.use();
  setGrid(cast, grid);
  if (grid.axes.table) gl.Uniform1f(cast.uniform("stepCells"), float(setup.step));

  // Everything in cells, from a middle that keeps single precision exact far from the origin.
  const glm::dvec3 cells(grid.size);
  glm::dmat4 cellFromWorld = glm::inverse(grid.worldFromGrid);
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 3; ++row) cellFromWorld[column][row] *= cells[row];
  }
  const glm::dvec3 middle(grid.worldFromGrid * glm::dvec4(0.5 * (grid.low + grid.high), 1.0));
  const double depthOrigin = glm::dot(middle - setup.camera.position, setup.camera.forward);
  const RayUniforms rays =
      raysOf(setup.camera, setup.size, cellFromWorld, depthOrigin, finestCells(grid), setup);
  std::array<float, 9> start{}, along{};
  for (std::size_t i = 0; i < 9; ++i) {
    start[i] = float(rays.start[i / 3][int(i % 3)]);
    along[i] = float(rays.along[i / 3][int(i % 3)]);
  }
  gl.Uniform3fv(cast.uniform("start"), 3, start.data());
  gl.Uniform3fv(cast.uniform("along"), 3, along.data());
  const glm::vec4 tangent(rays.tangent);
  gl.Uniform4fv(cast.uniform("tangent"), 1, glm::value_ptr(tangent));
  gl.Uniform1f(cast.uniform("nearest"), float(rays.nearest));
  gl.Uniform1f(cast.uniform("stepDepth"), float(rays.stepDepth));
  gl.Uniform1f(cast.uniform("depthOrigin"), float(depthOrigin));
  gl.Uniform1f(cast.uniform("opaque"), float(setup.opaque));
  gl.Uniform1f(cast.uniform("scale"), float(grid.scale));
  set3(cast, "cells", cells);
  set3(cast, "texelFromCell", 1.0 / cells);
  set3(cast, "low", grid.low * cells);
  set3(cast, "high", grid.high * cells);

  // The clip box in world units relative to the middle.
  const glm::dmat4 worldFromCell = glm::inverse(cellFromWorld);
  glm::dmat4 clipFromCell = worldFromCell;
  clipFromCell[3] = glm::dvec4(glm::dvec3(worldFromCell[3]) - middle, 1.0);
  const glm::mat4 clip(clipFromCell);
  gl.UniformMatrix4fv(cast.uniform("clipFromCell"), 1, GL_FALSE, glm::value_ptr(clip));
  constexpr double kFar = 1e30;
  set3(cast, "clipLow", setup.clip ? setup.clip->low - middle : glm::dvec3(-kFar));
  set3(cast, "clipHigh", setup.clip ? setup.clip->high - middle : glm::dvec3(kFar));

  gpu::bindSampler(cast, "values", 0, grid.values);
  if (skips) {
    gpu::bindSampler(cast, "leaps", 1, grid.leaps);
    gl.Uniform3i(cast.uniform("lastBrick"), grid.bricks.x - 1, grid.bricks.y - 1,
                 grid.bricks.z - 1);
  }
  if (scalar && setup.table) {
    gpu::bindSampler(cast, "table", 2, setup.table->texture());
    setEntries(cast, grid, *setup.table);
  }
  if (fields) setClassifier(cast, grid, *setup.classified, 1.0);
  if (opens) {
    gpu::bindSampler(cast, "open", 3, setup.occlusion->open);
    gl.Uniform1f(cast.uniform("openStrength"),
                 setup.light ? float(setup.light->ao.strength) : 1.0f);
  }
  if (grid.guess) gpu::bindSampler(cast, "guess", 4, *grid.guess);
  if (doubts) {
    gpu::bindSampler(cast, "wrong", 6, *grid.wrong);  // of fields: gradients
    gl.Uniform1f(cast.uniform("doubt"), float(setup.doubt * grid.wrongUnit));
  }
  if (setup.custom) setCustom(cast, grid, *setup.custom, worldFromCell);
  if (shades) {
    setLight(cast, *setup.light);
    const glm::dmat3 eyeFromWorld(setup.camera.eyeFromWorld());
    const glm::mat3 eyeFromGradient(eyeFromWorld * glm::transpose(glm::dmat3(cellFromWorld)));
    gl.UniformMatrix3fv(cast.uniform("eyeFromGradient"), 1, GL_FALSE,
                        glm::value_ptr(eyeFromGradient));
    if (grid.gradient) gpu::bindSampler(cast, "gradient", 5, *grid.gradient);
  }
  if (setup.mode == VolumeMode::Isosurface) {
    std::vector<Isosurface> sorted = setup.isosurfaces;
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const Isosurface& a, const Isosurface& b) { return a.value < b.value; });
    std::array<float, kMaxIsosurfaces> values{};
    std::array<float, 4 * kMaxIsosurfaces> colors{};
    for (std::size_t i = 0; i < sorted.size(); ++i) {
      values[i] = float((sorted[i].value - grid.valueZero) / grid.valueUnit);
      for (int c = 0; c < 3; ++c) colors[4 * i + std::size_t(c)] = float(sorted[i].color[c]);
      colors[4 * i + 3] = float(sorted[i].opacity);
    }
    gl.Uniform1i(cast.uniform("surfaces"), GLint(sorted.size()));
    gl.Uniform1fv(cast.uniform("isovalues"), GLsizei(values.size()), values.data());
    gl.Uniform4fv(cast.uniform("surfaceColors"), GLsizei(kMaxIsosurfaces), colors.data());
  }
  if (!marches) {
    const glm::vec4 plane(glm::transpose(worldFromCell) *
                          glm::dvec4(glm::dvec3(setup.plane), -setup.plane.w));
    gl.Uniform4f(cast.uniform("plane"), plane.x, plane.y, plane.z, -plane.w);
    gl.Uniform1f(cast.uniform("thickness"), float(setup.sliceThickness));
  }
  return cast;
}

void VolumePass::findBricks(LookGrid& grid) {
  if (grid.content != GridContent::Optics) refuse("values need a table to find their bricks");
  const gl::Functions& gl = gl::functions();
  const gl::Program& find = program("brick", embedded::brick_frag, {});
  const ImageSize size{grid.bricks.x, grid.bricks.y};
  const gl::Texture target = gpu::textureArray(GL_RGBA8, size, grid.bricks.z);
  find.use();
  gpu::bindSampler(find, "values", 0, grid.values);
  std::vector<std::uint8_t> occupied, rgba(4 * size.pixels());
  for (int layer = 0; layer < grid.bricks.z; ++layer) {
    const gpu::Attachment attachment{&target, layer};
    gpu::bindTarget(framebuffer_, {&attachment, 1}, size);
    gl.Uniform1i(find.uniform("layer"), layer);
    gpu::drawFullscreen(empty_);
    gl.ReadBuffer(GL_COLOR_ATTACHMENT0);
    gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
    gl.ReadPixels(0, 0, size.width, size.height, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
    for (std::size_t i = 0; i < size.pixels(); ++i) occupied.push_back(rgba[4 * i]);
  }
  gl::checkErrors("finding the bricks of a grid");
  grid.setOccupied(occupied);
}

glm::dvec2 CustomDrawing::widened(glm::dvec2 range) const {
  const auto changed = [&](double value, double gamma) {
    const double f = (value - low) / (high - low);
    return f > 0.0 && f < 1.0 ? low + std::pow(f, gamma) * (high - low) : value;
  };
  const glm::dvec2 gammas = textures->gammas();
  // The greatest gamma lowers values most.
  return {std::min(range.x, changed(range.x, gammas.y)),
          std::max(range.y, changed(range.y, gammas.x))};
}

void VolumePass::findBricks(LookGrid& grid, const OpticsTable& table, const CustomDrawing* custom) {
  std::vector<std::uint8_t> occupied(grid.brickRange.size());
  for (std::size_t i = 0; i < occupied.size(); ++i) {
    glm::dvec2 range = glm::dvec2(grid.brickRange[i]) * grid.valueUnit + grid.valueZero;
    if (!(range.x <= range.y)) continue;
    if (custom) range = custom->widened(range);
    const auto shows = [&](const OpticsTable* of) { return !of->transparent(range.x, range.y); };
    occupied[i] = shows(&table) ||
                  (custom && std::any_of(custom->blends.begin(), custom->blends.end(), shows));
  }
  grid.setOccupied(occupied);
}

void VolumePass::findBricks(LookGrid& grid, std::span<const Isosurface> surfaces) {
  std::vector<std::uint8_t> occupied(grid.brickRange.size(), 0);
  for (std::size_t i = 0; i < occupied.size(); ++i) {
    for (const Isosurface& surface : surfaces) {
      const float texel = float((surface.value - grid.valueZero) / grid.valueUnit);
      if (grid.brickRange[i].x <= texel && texel <= grid.brickRange[i].y) occupied[i] = 1;
    }
  }
  grid.setOccupied(occupied);
}

void VolumePass::findBricks(LookGrid& grid, const Classifier& classifier) {
  std::vector<std::uint8_t> occupied(grid.brickBox.size());
  for (std::size_t i = 0; i < occupied.size(); ++i) {
    const auto& [low, high] = grid.brickBox[i];
    occupied[i] = low.values[0] <= high.values[0] && !classifier.vanishes(low, high);
  }
  grid.setOccupied(occupied);
}

LookGrid VolumePass::baked(const LookGrid& grid, const ClassifiedLook& look) {
  const gl::Functions& gl = gl::functions();
  double scale = 0.0;
  for (const ChannelOptics& each : look.optics) scale += each.extinction;
  LookGrid result = LookGrid::emptyOptics(grid.size, grid.worldFromGrid, scale > 0.0 ? scale : 1.0);
  result.low = grid.low;
  result.high = grid.high;
  result.axes = GridAxes(grid.axes.nodes);
  Defines defines;
  addClassifierDefines(defines, grid, look);
  addGridDefines(defines, grid);
  const gl::Program& bake = program("bake " + std::string(look.classifier->kind()),
                                    withClassifier(embedded::bake_frag, *look.classifier), defines);
  bake.use();
  gpu::bindSampler(bake, "values", 0, grid.values);
  setGrid(bake, grid);
  setClassifier(bake, grid, look, result.scale);
  drawLayers(bake, result.values, result.size);
  gl.Flush();
  gl::checkErrors("classifying a grid");
  findBricks(result);
  return result;
}

void VolumePass::drawLayers(const gl::Program& pass, const gl::Texture& target, glm::ivec3 size) {
  for (int layer = 0; layer < size.z; ++layer) {
    const gpu::Attachment attachment{&target, layer};
    gpu::bindTarget(framebuffer_, {&attachment, 1}, {size.x, size.y});
    gl::functions().Uniform1i(pass.uniform("layer"), layer);
    gpu::drawFullscreen(empty_);
  }
}

void VolumePass::findGradients(LookGrid& grid) {
  const gl::Functions& gl = gl::functions();
  const bool scalar = grid.content == GridContent::Scalar;
  Defines defines;
  if (scalar) defines.emplace_back("SCALAR", "1");
  addGridDefines(defines, grid);
  const gl::Program& find = program("normal", withAxes(embedded::normal_frag), defines);
  grid.gradient = target3D(GL_RGBA16F, grid.size);
  find.use();
  gpu::bindSampler(find, "values", 0, grid.values);
  setGrid(find, grid);
  gl.Uniform1f(find.uniform("flatSlope"), scalar ? kFlatScalar : kFlatOptics);
  drawLayers(find, *grid.gradient, grid.size);
  gl::checkErrors("finding the gradients of a grid");
}

OcclusionGrid VolumePass::occlusion(const LookGrid& grid, double radiusWorld,
                                    const OpticsTable* table) {
  const bool scalar = grid.content == GridContent::Scalar;
  if (scalar && !table) refuse("ambient occlusion of values needs a table of optics");
  const gl::Functions& gl = gl::functions();
  const glm::ivec3 size = (grid.size + (kReduce - 1)) / kReduce;
  const gl::Texture reduced = target3D(GL_R32F, size);
  Defines defines;
  if (scalar) defines.emplace_back("SCALAR", "1");
  addGridDefines(defines, grid);
  const gl::Program& reduce = program("reduce", withAxes(embedded::reduce_frag), defines);
  reduce.use();
  setGrid(reduce, grid);
  gpu::bindSampler(reduce, "values", 0, grid.values);
  gl.Uniform1f(reduce.uniform("scale"), scalar ? 1.0f : float(grid.scale));
  if (scalar) {
    gpu::bindSampler(reduce, "table", 1, table->texture());
    setEntries(reduce, grid, *table);
  }
  drawLayers(reduce, reduced, size);

  OcclusionGrid result{target3D(GL_R8, size)};
  const gl::Program& gather = program("occlusion", embedded::occlusion_frag, {});
  gather.use();
  gpu::bindSampler(gather, "extinction", 0, reduced);
  gl.Uniform1f(gather.uniform("radius"), float(radiusWorld));
  const glm::mat3 gridFromWorld(glm::inverse(glm::dmat3(grid.worldFromGrid)));
  gl.UniformMatrix3fv(gather.uniform("gridFromWorld"), 1, GL_FALSE, glm::value_ptr(gridFromWorld));
  drawLayers(gather, result.open, size);
  gl::checkErrors("ambient occlusion of a grid");
  return result;
}

}  // namespace vestige
