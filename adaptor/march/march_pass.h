// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "adaptor/volume/block_volume.h"
#include "adaptor/volume/march_setup.h"
#include "proxy/gl/objects.h"
#include "proxy/gl/program.h"

namespace vestige {

// What marches of a block share, whatever they gather: the field (march_field.glsl), the base
// transfer function (march_base.glsl), rays and tiles. On the device's thread only.

using MarchDefines = std::vector<std::pair<std::string, std::string>>;

/// X(0) X(1) ... or, in pairs, X(0, 1) X(1, 2) ...: `count` calls of a macro, backward the last
/// first.
std::string unrolled(int count, bool pairs, bool backward = false);

/// Throws InvalidArgument unless the camera, the size and the isovalues of a request make sense.
void checkRequest(const MarchRequest& request);

/// What a request comes to in one block. Without `needsBase` the base function is left out.
struct MarchSetup {
  MarchFrame frame;
  std::array<MarchAxis, 3> axes;
  std::optional<PreintegratedTable> base;
  std::vector<glm::vec2> edges;
  std::vector<glm::vec4> bricks;
  bool skips;
  std::shared_ptr<const CustomVolume> custom;  ///< with the base function only
  bool customValues = false;                   ///< some gamma is not 1

  MarchSetup(const MarchRequest& request, const BlockVolume& volume, bool needsBase);
};

/// The textures of a setup and of the block, bound for as long as it lives.
class MarchTables {
 public:
  MarchTables(const MarchSetup& setup, const BlockVolume& volume);

 private:
  std::vector<gl::Texture> nodes_;
  std::vector<BufferTable> base_;
  std::optional<BrickTexture> bricks_;
  std::vector<gl::Texture> custom_;
};

/// PIECES, GAPS, SKIP and AXIS_* as march_field.glsl and march_base.glsl want them.
void addFieldDefines(MarchDefines& defines, const MarchSetup& setup, const BlockVolume& volume,
                     bool skip);
/// Sets the uniforms of all three files; a program need not have all of them.
void setMarchUniforms(const gl::Program& program, const MarchRequest& request,
                      const MarchSetup& setup, const BlockVolume& volume);

/// Tiles (TilePlan) and the program that is run on them.
struct TilePass {
  const gl::Program& program;
  const std::vector<glm::vec4>& tiles;
  gl::Buffer buffer;

  TilePass(const gl::Program& program_, const std::vector<glm::vec4>& tiles_);
  /// Runs it on the tiles whose first row of pixels is in [first, first + count).
  void run(int first, int count) const;
};

}  // namespace vestige
