// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "explorer/recomposition/edit_pass.h"
#include "explorer/renderer/view_data.h"
#include "proxy/format/layout/learned_layout.h"

namespace vestige {

/// The attenuation of a view under a function, recomposed from one of its proxies, as
/// EditPass::attenuation gives it. `from`: length, attenuation or sliced (LearnedOrigin). Throws
/// NotFound when the view does not store it, Format when attenuation does not say of what.
gl::Texture attenuationFrom(EditPass& edit, ViewData& view, std::string_view from,
                            const TransferFunction& function);

/// What a table is, in words: "24 clusters of length from 3 pictures (headlight), RMS error ...".
std::string learnedNote(const ProxyHeader& header);

/// Draws with learned colours ([Tikhonova 2010, §6.2]; explorer/renderer/learned.frag). Made,
/// used and destroyed inside Device::run.
class LearnedPass {
 public:
  /// `attenuation` as of EditPass::attenuation, of the table's channels; `enhancement` may be null.
  Picture render(const gl::Texture& attenuation, ImageSize size, const LearnedTable& table,
                 const gl::Texture* enhancement = nullptr);

 private:
  std::map<bool, gl::Program> programs_;  ///< by whether it is enhanced
  gl::Framebuffer framebuffer_;
  gl::VertexArray empty_;
};

}  // namespace vestige
