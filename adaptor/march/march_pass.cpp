// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/march/march_pass.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/type_ptr.hpp>

#include "adaptor/march/tile_plan.h"
#include "proxy/base/error.h"
#include "proxy/format/image/length_unit.h"
#include "proxy/gl/functions.h"

namespace vestige {
namespace {

/// Where hardly any brick can be skipped, looking costs more than it saves.
bool worthSkipping(const std::vector<glm::vec4>& bricks) {
  const auto skippable = std::count_if(bricks.begin(), bricks.end(),
                                       [](const glm::vec4& brick) { return brick.x >= 0.0f; });
  return std::size_t(skippable) * 50 > bricks.size();
}

constexpr int kCustomUnit = kNodesUnit + 4;  // after the light's; and the next

gl::Texture customTexture(int unit, glm::ivec3 size, const std::vector<glm::vec4>& texels) {
  const gl::Functions& f = gl::functions();
  gl::Texture texture(GL_TEXTURE_3D);
  texture.bind(unit);
  for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    f.TexParameteri(GL_TEXTURE_3D, filter, GL_LINEAR);
  for (const GLenum wrap : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
    f.TexParameteri(GL_TEXTURE_3D, wrap, GL_CLAMP_TO_EDGE);
  f.TexStorage3D(GL_TEXTURE_3D, 1, GL_RGBA16F, size.x, size.y, size.z);
  f.PixelStorei(GL_UNPACK_ALIGNMENT, 4);
  f.TexSubImage3D(GL_TEXTURE_3D, 0, 0, 0, 0, size.x, size.y, size.z, GL_RGBA, GL_FLOAT,
                  texels.data());
  gl::checkErrors("uploading a customisation");
  return texture;
}

void setCustom(const gl::Program& program, const MarchFrame& frame, const CustomVolume& custom) {
  glm::vec3 fromLocal, origin;
  for (int axis = 0; axis < 3; ++axis) {
    // The first and the last texel have their middles on the faces of the domain.
    const double size = custom.box.size()[axis], count = custom.nodes[axis];
    const double fromWorld = size > 0.0 ? (count - 1.0) / count / size : 0.0;
    fromLocal[axis] = float(fromWorld * frame.scale);
    origin[axis] = float(0.5 / count + fromWorld * (frame.centre[axis] - custom.box.low[axis]));
  }
  const gl::Functions& f = gl::functions();
  f.Uniform3fv(program.uniform("customFromLocal"), 1, glm::value_ptr(fromLocal));
  f.Uniform3fv(program.uniform("customOrigin"), 1, glm::value_ptr(origin));
  f.Uniform1i(program.uniform("customOptics"), kCustomUnit);
  f.Uniform1i(program.uniform("customValues"), kCustomUnit + 1);
}

}  // namespace

std::string unrolled(int count, bool pairs, bool backward) {
  std::string text;
  for (int i = 0; i < count; ++i) {
    const int k = backward ? count - 1 - i : i;
    text += "X(" + std::to_string(k) + (pairs ? ", " + std::to_string(k + 1) : "") + ") ";
  }
  return text;
}

void checkRequest(const MarchRequest& request) {
  request.camera.validate();
  if (request.size.width < 1 || request.size.height < 1) {
    throw Error(ErrorCode::InvalidArgument, "a picture of " + std::to_string(request.size.width) +
                                                " x " + std::to_string(request.size.height) +
                                                " pixels cannot be marched");
  }
  for (double isovalue : request.isovalues) {
    if (!std::isfinite(isovalue)) {
      throw Error(ErrorCode::InvalidArgument,
                  "the isovalue " + std::to_string(isovalue) + " is not finite");
    }
  }
}

MarchSetup::MarchSetup(const MarchRequest& request, const BlockVolume& volume, bool needsBase)
    : frame(request.domain, request.camera),
      axes{MarchAxis(volume.grid().nodes[0], frame.centre.x, frame.scale, request.domain.low.x),
           MarchAxis(volume.grid().nodes[1], frame.centre.y, frame.scale, request.domain.low.y),
           MarchAxis(volume.grid().nodes[2], frame.centre.z, frame.scale, request.domain.low.z)} {
  if (needsBase) {
    base.emplace(request.base, request.partition, frame.scale);
    custom = request.custom;
    customValues = custom && std::any_of(custom->values.begin(), custom->values.end(),
                                         [](const glm::vec4& values) { return values.x != 1.0f; });
  }
  const PreintegratedTable* table = base ? &*base : nullptr;
  edges = channelEdges(request.partition, table);
  bricks = volume.bricks().texels(edges, table);
  // Bricks know the base function of values as they are.
  if (!request.skipEmptySpace || customValues) {
    for (glm::vec4& brick : bricks) brick.x = -1.0f;
  }
  skips = worthSkipping(bricks);
}

MarchTables::MarchTables(const MarchSetup& setup, const BlockVolume& volume) {
  for (int i = 0; i < 3; ++i) {
    const MarchAxis& axis = setup.axes[std::size_t(i)];
    if (!axis.even) nodes_.push_back(makeTable(kNodesUnit + i, axis.width, axis.texels));
  }
  if (setup.base) {
    base_.emplace_back(kBaseUnit, setup.base->cells);
    base_.emplace_back(kBaseColorUnit, setup.base->colors);
  }
  if (setup.skips) bricks_.emplace(volume.bricks(), setup.bricks);
  if (setup.custom) {
    custom_.push_back(customTexture(kCustomUnit, setup.custom->nodes, setup.custom->optics));
    if (setup.customValues)
      custom_.push_back(customTexture(kCustomUnit + 1, setup.custom->nodes, setup.custom->values));
  }
  volume.bind();
}

void addFieldDefines(MarchDefines& defines, const MarchSetup& setup, const BlockVolume& volume,
                     bool skip) {
  const auto flag = [&](const char* name, bool on) {
    if (on) defines.push_back({name, ""});
  };
  flag("PIECES", setup.base && setup.base->pieces);
  flag("CUSTOM", setup.custom != nullptr);
  flag("CUSTOM_VALUES", setup.customValues);
  flag("GAPS", volume.hasGaps());
  if (setup.skips && skip) defines.push_back({"SKIP", std::to_string(BrickGrid::kCells)});
  flag("AXIS_X", !setup.axes[0].even);
  flag("AXIS_Y", !setup.axes[1].even);
  flag("AXIS_Z", !setup.axes[2].even);
}

void setMarchUniforms(const gl::Program& program, const MarchRequest& request,
                      const MarchSetup& setup, const BlockVolume& volume) {
  const auto& [frame, axes, base, edges, bricks, skips, custom, customValues] = setup;
  const gl::Functions& f = gl::functions();
  program.use();
  const auto at = [&](const char* name) { return program.uniform(name); };
  const auto vec3 = [&](const char* name, glm::vec3 v) {
    f.Uniform3fv(at(name), 1, glm::value_ptr(v));
  };
  f.Uniform1i(at("volume"), kVolumeUnit);
  const auto nodeCount = volume.grid().size();
  f.Uniform3i(at("nodeCount"), nodeCount[0], nodeCount[1], nodeCount[2]);
  glm::vec3 nodesFromLocal, nodesOrigin, firstNode, guesses[3];
  glm::vec3 brickLow, brickWidth;
  const char* const nodeNames[3] = {"nodesX", "nodesY", "nodesZ"};
  for (int i = 0; i < 3; ++i) {
    nodesFromLocal[i] = axes[std::size_t(i)].nodesFromLocal;
    nodesOrigin[i] = axes[std::size_t(i)].nodesOrigin;
    firstNode[i] = axes[std::size_t(i)].firstNode;
    guesses[i] = axes[std::size_t(i)].guess;
    f.Uniform1i(at(nodeNames[i]), kNodesUnit + i);
    brickLow[i] = axes[std::size_t(i)].nodeAt(0);
    brickWidth[i] = axes[std::size_t(i)].nodeAt(BrickGrid::kCells) - brickLow[i];
  }
  const auto brickCount = volume.bricks().size();
  f.Uniform1i(at("bricks"), kBricksUnit);
  f.Uniform3i(at("lastBrick"), brickCount[0] - 1, brickCount[1] - 1, brickCount[2] - 1);
  vec3("brickLow", brickLow);
  vec3("brickWidth", brickWidth);
  vec3("nodesFromLocal", nodesFromLocal);
  vec3("nodesOrigin", nodesOrigin);
  vec3("firstNode", firstNode);
  vec3("lastNode", firstNode + glm::vec3(nodeCount[0] - 1, nodeCount[1] - 1, nodeCount[2] - 1));
  const glm::vec2 texelSize(1.0f / float(nodeCount[0]), 1.0f / float(nodeCount[1]));
  const glm::vec2 cornerOrigin = (1.0f - glm::vec2(firstNode)) * texelSize;
  f.Uniform2f(at("texelSize"), texelSize.x, texelSize.y);
  f.Uniform2f(at("cornerOrigin"), cornerOrigin.x, cornerOrigin.y);
  f.Uniform3fv(at("guesses"), 3, glm::value_ptr(guesses[0]));

  const MarchRays rays(frame, request.camera, request.size);
  f.Uniform2i(at("size"), request.size.width, request.size.height);
  f.Uniform3fv(at("originAt"), 3, glm::value_ptr(rays.origin[0]));
  f.Uniform3fv(at("directionAt"), 3, glm::value_ptr(rays.direction[0]));
  f.Uniform1f(at("firstDepth"), rays.firstDepth);
  f.Uniform1f(at("lean"), rays.lean);
  vec3("boxLow", frame.localFromWorld(volume.grid().owned.low));
  vec3("boxHigh", frame.localFromWorld(volume.grid().owned.high));
  vec3("domainHigh", frame.localFromWorld(request.domain.high));
  f.Uniform1f(at("stepDepth"), float(marchStep(request, volume.grid()) / frame.scale));
  f.Uniform1f(at("depthOrigin"), float(frame.depthOrigin));
  f.Uniform1f(at("scale"), float(frame.scale));
  f.Uniform1f(at("perMoment"), float(1.0 / lengthUnitFor(request.domain)));
  const glm::mat3 eye(request.camera.eyeFromWorld());
  f.UniformMatrix3fv(at("eyeFromWorld"), 1, GL_FALSE, glm::value_ptr(eye));

  std::vector<float> isovalues;
  for (double v : request.isovalues) isovalues.push_back(float(request.partition.normalised(v)));
  if (!isovalues.empty()) {
    f.Uniform1fv(at("isovalues"), GLsizei(isovalues.size()), isovalues.data());
  }
  f.Uniform2fv(at("edges"), GLsizei(edges.size()), glm::value_ptr(edges[0]));
  if (base) {
    f.Uniform1i(at("base"), kBaseUnit);
    f.Uniform1i(at("baseColor"), kBaseColorUnit);
    f.Uniform2f(at("baseCells"), base->cellsPerValue, base->cellOfZero);
    f.Uniform1f(at("baseLast"), base->lastCell);
    f.Uniform1f(at("baseColorRate"), base->colorRate);
    if (custom) setCustom(program, frame, *custom);
  }
}

TilePass::TilePass(const gl::Program& program_, const std::vector<glm::vec4>& tiles_)
    : program(program_), tiles(tiles_) {
  const gl::Functions& f = gl::functions();
  f.BindBuffer(GL_SHADER_STORAGE_BUFFER, buffer.id());
  f.BufferData(GL_SHADER_STORAGE_BUFFER, GLsizeiptr(tiles.size() * sizeof(glm::vec4)), tiles.data(),
               GL_STREAM_DRAW);
}

void TilePass::run(int first, int count) const {
  const auto from = [&](int row) {
    return std::partition_point(tiles.begin(), tiles.end(), [&](const glm::vec4& t) {
      return t.y * TilePlan::kTile < float(row);
    });
  };
  const auto begin = from(first), end = from(first + count);
  if (begin == end) return;
  const gl::Functions& f = gl::functions();
  program.use();
  f.Uniform2i(program.uniform("band"), first, count);
  f.Uniform1i(program.uniform("firstTile"), int(begin - tiles.begin()));
  f.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, buffer.id());
  f.DispatchCompute(GLuint(end - begin), 1, 1);
}

}  // namespace vestige
