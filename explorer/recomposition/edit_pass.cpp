// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/recomposition/edit_pass.h"

#include <algorithm>
#include <array>
#include <numbers>

#include "edit_frag.embed.h"
#include "enhance_frag.embed.h"
#include "fullscreen_vert.embed.h"
#include "proxy/base/error.h"

namespace vestige {
namespace {

constexpr int kMaxChannels = IntervalPartition::kMaxIntervals + 3;  // as in edit.frag

void setLayers(const gl::Program& program, const std::vector<int>* layerOf) {
  std::array<GLint, kMaxChannels> layers;
  layers.fill(-1);
  if (layerOf) std::copy(layerOf->begin(), layerOf->end(), layers.begin());
  gl::functions().Uniform1iv(program.uniform("layerOf"), kMaxChannels, layers.data());
}

/// More channels than uniforms hold: see edit.frag.
bool isWide(const ChannelTable& table) { return table.strength.size() > std::size_t(kMaxChannels); }

std::array<float, 4> entryOf(const ChannelTable& table, std::size_t channel, double unit) {
  const glm::dvec3& color = table.color[channel];
  return {float(color.r), float(color.g), float(color.b),
          float(-table.strength[channel] * unit * std::numbers::log2e)};
}

}  // namespace

ChannelTable tableForLength(const IntervalLook& look) { return {look.extinction, look.color}; }

ChannelTable tableForAttenuation(const IntervalLook& look, const IntervalLook& base) {
  ChannelTable table{std::vector<double>(look.extinction.size(), 0.0), look.color};
  for (std::size_t k = 0; k < table.strength.size(); ++k) {
    if (base.extinction[k] > 0.0) table.strength[k] = look.extinction[k] / base.extinction[k];
  }
  return table;
}

SegmentTextures::SegmentTextures(const SegmentLists& lists)
    : size(lists.size),
      unit(lists.unit),
      first(gpu::texture2D(GL_R32UI, lists.size, GL_RED_INTEGER, GL_UNSIGNED_INT,
                           lists.first.data())),
      entries(gpu::listTexture(lists.entries)) {}

EditPass::EditPass() = default;

const gl::Program& EditPass::variant(
    const std::string& name, const std::vector<std::pair<std::string, std::string>>& defines) {
  const auto found = programs_.find(name);
  if (found != programs_.end()) return found->second;
  return programs_
      .emplace(name, gpu::program(embedded::fullscreen_vert, embedded::edit_frag, defines))
      .first->second;
}

void EditPass::bind(const gl::Program& program, const SegmentTextures& segments,
                    const ChannelTable& table, const std::vector<int>* layerOf) {
  if (table.strength.size() > std::size_t(SegmentLists::kMostChannel) ||
      table.color.size() != table.strength.size()) {
    throw Error(ErrorCode::InvalidArgument,
                "a channel table has " + std::to_string(table.strength.size()) + " strengths and " +
                    std::to_string(table.color.size()) + " colours");
  }
  const gl::Functions& gl = gl::functions();
  const std::size_t count = table.strength.size();
  if (isWide(table)) {  // first: making a texture binds it to unit 0
    std::vector<float> rows(8 * count, -1.0f);
    for (std::size_t k = 0; k < count; ++k) {
      const auto entry = entryOf(table, k, segments.unit);
      std::copy(entry.begin(), entry.end(), rows.begin() + std::ptrdiff_t(4 * k));
      if (layerOf && k < layerOf->size()) rows[4 * (count + k)] = float((*layerOf)[k]);
    }
    table_ = gpu::texture2D(GL_RGBA32F, {int(count), 2}, GL_RGBA, GL_FLOAT, rows.data());
  }
  program.use();
  gpu::bindSampler(program, "firstEntry", 0, segments.first);
  gpu::bindSampler(program, "entries", 1, segments.entries);
  gl.Uniform1i(program.uniform("listWidthLog2"), gpu::kListWidthLog2);
  if (isWide(table)) {
    gpu::bindSampler(program, "table", 4, *table_);
    return;
  }
  std::array<float, 4 * kMaxChannels> values{};
  for (std::size_t k = 0; k < count; ++k) {
    const auto entry = entryOf(table, k, segments.unit);
    std::copy(entry.begin(), entry.end(), values.begin() + std::ptrdiff_t(4 * k));
  }
  gl.Uniform4fv(program.uniform("channels"), kMaxChannels, values.data());
  if (layerOf) setLayers(program, layerOf);
}

void EditPass::draw(const SegmentTextures& segments, const ChannelTable& table,
                    const EditExtras& extras, const gl::Texture& target, int layer) {
  std::vector<std::pair<std::string, std::string>> defines;
  std::string name = "edit";
  const auto define = [&](const char* key) {
    defines.emplace_back(key, "1");
    name += key;
  };
  if (extras.light) define("SHADED");
  if (extras.enhancement) define("ENHANCED");
  if (extras.oneLayer >= 0) define("ONE_LAYER");
  if (isWide(table)) define("WIDE");
  const gl::Program& program = variant(name, defines);
  const gpu::Attachment attachment{&target, layer};
  gpu::bindTarget(framebuffer_, {&attachment, 1}, segments.size);
  const bool layered = extras.light || extras.oneLayer >= 0;
  bind(program, segments, table, layered ? extras.layerOf : nullptr);
  if (extras.light) gpu::bindSampler(program, "light", 2, *extras.light);
  if (extras.enhancement) gpu::bindSampler(program, "enhancement", 3, *extras.enhancement);
  gl::functions().Uniform1i(program.uniform("oneLayer"), extras.oneLayer);
  gpu::drawFullscreen(empty_);
}

Picture EditPass::render(const SegmentTextures& segments, const ChannelTable& table,
                         const EditExtras& extras) {
  if (!target_ || targetSize_ != segments.size) {
    target_ = gpu::texture2D(GL_RGBA32F, segments.size, GL_RGBA, GL_FLOAT, nullptr);
    targetSize_ = segments.size;
  }
  draw(segments, table, extras, *target_);
  return {segments.size, gpu::readFloats(segments.size)};
}

std::vector<float> EditPass::doubt(const SegmentTextures& segments, const ChannelTable& table) {
  const gl::Texture target = gpu::texture2D(GL_RGBA32F, segments.size, GL_RGBA, GL_FLOAT, nullptr);
  const gpu::Attachment attachment{&target};
  std::vector<std::pair<std::string, std::string>> defines{{"TRUST", "1"}};
  if (isWide(table)) defines.emplace_back("WIDE", "1");
  const gl::Program& program = variant(isWide(table) ? "trustWIDE" : "trust", defines);
  gpu::bindTarget(framebuffer_, {&attachment, 1}, segments.size);
  bind(program, segments, table);
  gpu::drawFullscreen(empty_);
  const std::vector<float> values = gpu::readFloats(segments.size);
  std::vector<float> doubt(segments.size.pixels());
  for (std::size_t i = 0; i < doubt.size(); ++i) doubt[i] = values[4 * i];
  return doubt;
}

gl::Texture EditPass::attenuation(const SegmentTextures& segments, const ChannelTable& table) {
  const gl::Functions& gl = gl::functions();
  const int groups = int(table.strength.size() + 3) / 4;
  gl::Texture attenuation = gpu::textureArray(GL_RGBA32F, segments.size, groups);
  std::vector<std::pair<std::string, std::string>> defines{{"ATTENUATION", "1"}};
  if (isWide(table)) defines.emplace_back("WIDE", "1");
  const gl::Program& gather = variant(isWide(table) ? "attenuationWIDE" : "attenuation", defines);
  for (int group = 0; group < groups; ++group) {
    const gpu::Attachment attachment{&attenuation, group};
    gpu::bindTarget(framebuffer_, {&attachment, 1}, segments.size);
    bind(gather, segments, table);
    gl.Uniform1i(gather.uniform("group"), group);
    gpu::drawFullscreen(empty_);
  }
  gl::checkErrors("attenuation of an edit");
  return attenuation;
}

std::vector<std::vector<float>> EditPass::readAttenuation(const gl::Texture& attenuation,
                                                          ImageSize size, int channels) {
  std::vector<std::vector<float>> groups;
  for (int group = 0; 4 * group < channels; ++group) {
    const gpu::Attachment attachment{&attenuation, group};
    gpu::bindTarget(framebuffer_, {&attachment, 1}, size);
    groups.push_back(gpu::readFloats(size));
  }
  return groups;
}

gl::Texture EditPass::enhancement(const SegmentTextures& segments, const ChannelTable& table,
                                  double lambda, double gamma) {
  return enhancement(attenuation(segments, table), segments.size, int(table.strength.size()),
                     lambda, gamma);
}

gl::Texture EditPass::enhancement(const gl::Texture& attenuation, ImageSize size, int channels,
                                  double lambda, double gamma) {
  const gl::Functions& gl = gl::functions();
  auto found = programs_.find("enhance");
  if (found == programs_.end()) {
    found = programs_
                .emplace("enhance", gpu::program(embedded::fullscreen_vert, embedded::enhance_frag))
                .first;
  }
  gl::Texture result = gpu::texture2D(GL_RGBA32F, size, GL_RGBA, GL_FLOAT, nullptr);
  const gpu::Attachment attachment{&result};
  gpu::bindTarget(framebuffer_, {&attachment, 1}, size);
  const gl::Program& program = found->second;
  program.use();
  gpu::bindSampler(program, "attenuation", 0, attenuation);
  gl.Uniform1i(program.uniform("groups"), (channels + 3) / 4);
  gl.Uniform1f(program.uniform("lambda"), float(lambda));
  gl.Uniform1f(program.uniform("gamma"), float(gamma));
  gl.Uniform1f(program.uniform("gradientScale"), float(size.height) / 512.0f);
  gpu::drawFullscreen(empty_);
  gl::checkErrors("depth-aware enhancement");
  return result;
}

}  // namespace vestige
