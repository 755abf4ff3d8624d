// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "explorer/renderer/renderer.h"

namespace vestige {

/// The looks of a movie, one a frame.
/// Over time: one frame for each stored cycle.
std::vector<Look> looksOverTime(const Look& look, const Archive& archive);
/// The look for all steps of a movie: what it leaves open, opacity and colours, is one for all
/// where steps have defaults of their own. The colour range then holds theirs, and an opacity that
/// differs is that of the step with the widest range, stretched with it.
Look lookForAllSteps(Renderer& renderer, const Look& look, const Archive& archive);
/// A turn of the viewer: `frames` frames from -degrees/2 to +degrees/2 of azimuth and back, so that
/// it loops; a full turn (360 or more) goes round once instead. All have one frame. None is exactly
/// at a stored view, which other proxies may draw than those between.
std::vector<Look> looksOfTurn(const Look& look, double degrees, int frames);

/// Renders the looks and encodes them with ffmpeg, fed by a pipe; all frames have the first one's
/// size. Transparent backgrounds become black. `progress(done, total)` may be empty. Returns the
/// warnings of all frames, one a key, saying in how many frames. Throws
/// NotFound without ffmpeg, Io with its words when it fails; then no file is left.
std::vector<Warning> writeMovie(const std::filesystem::path& path, Renderer& renderer,
                                const std::vector<Look>& looks, double framesPerSecond,
                                const std::function<void(int, int)>& progress);

}  // namespace vestige
