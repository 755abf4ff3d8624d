// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <glm/vec3.hpp>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "explorer/gpu/gpu.h"
#include "explorer/recomposition/segments.h"
#include "proxy/transfer/transfer_function.h"

namespace vestige {

/// What a look makes of the channels of a partition: the strength that multiplies a segment's
/// amount to its optical depth, and linear RGB.
struct ChannelTable {
  std::vector<double> strength;
  std::vector<glm::dvec3> color;
};

/// For segments from lengths: strength = extinction.
ChannelTable tableForLength(const IntervalLook& look);
/// For segments from attenuation: strength = new extinction / base extinction; 0 where the base was
/// transparent, because what was not seen in situ cannot come back (method §2).
ChannelTable tableForAttenuation(const IntervalLook& look, const IntervalLook& base);

/// The segments of a view on the GPU.
struct SegmentTextures {
  ImageSize size;
  double unit = 1.0;
  gl::Texture first, entries;

  explicit SegmentTextures(const SegmentLists& lists);
};

/// What a variant of the recomposition needs besides segments and table; null = off.
struct EditExtras {
  const std::vector<int>* layerOf = nullptr;  ///< [channel], with `light` or `oneLayer`
  const gl::Texture* light = nullptr;         ///< DepthLayerPass::light
  const gl::Texture* enhancement = nullptr;   ///< EditPass::enhancement
  int oneLayer = -1;                          ///< >= 0: only the segments of this layer
};

/// Recomposes edited pictures (method §2 "opacity change"; explorer/recomposition/edit.frag). Made,
/// used and destroyed inside Device::run; programs are compiled when first needed and kept.
class EditPass {
 public:
  EditPass();
  /// Into layer `layer` of `target` (layer < 0: a 2-D texture), a float RGBA texture of the
  /// segments' size: premultiplied linear RGBA.
  void draw(const SegmentTextures& segments, const ChannelTable& table, const EditExtras& extras,
            const gl::Texture& target, int layer = -1);
  /// The same as a picture.
  Picture render(const SegmentTextures& segments, const ChannelTable& table,
                 const EditExtras& extras = {});
  /// [pixel] the largest change of a colour that an order which is not stored could make.
  std::vector<float> doubt(const SegmentTextures& segments, const ChannelTable& table);
  /// a'_k of the edit [channel / 4], four channels a texel.
  gl::Texture attenuation(const SegmentTextures& segments, const ChannelTable& table);
  /// The same on the CPU: [channel / 4][pixel][channel % 4], of `channels` channels.
  std::vector<std::vector<float>> readAttenuation(const gl::Texture& attenuation, ImageSize size,
                                                  int channels);
  /// r = λ Σ_k ‖∇_xy a'_k‖^γ clamped to [0, 1] [Tikhonova 2010, eq. 11]; gradients
  /// are per 1/512 of the picture's height, so that λ means the same at every size.
  gl::Texture enhancement(const SegmentTextures& segments, const ChannelTable& table, double lambda,
                          double gamma);
  gl::Texture enhancement(const gl::Texture& attenuation, ImageSize size, int channels,
                          double lambda, double gamma);

 private:
  const gl::Program& variant(const std::string& name,
                             const std::vector<std::pair<std::string, std::string>>& defines);
  void bind(const gl::Program& program, const SegmentTextures& segments, const ChannelTable& table,
            const std::vector<int>* layerOf = nullptr);

  std::map<std::string, gl::Program> programs_;
  gl::Framebuffer framebuffer_;
  gl::VertexArray empty_;
  std::optional<gl::Texture> table_;   ///< of more channels than uniforms hold
  std::optional<gl::Texture> target_;  ///< kept: an edit must not pay for fresh memory
  ImageSize targetSize_;
};

}  // namespace vestige
