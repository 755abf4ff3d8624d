// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/training/training.h"

#include <algorithm>
#include <cmath>

#include "explorer/renderer/learned_pass.h"
#include "proxy/base/error.h"

namespace vestige {
namespace {

std::string_view picturesOf(const ViewData& view) {
  if (view.has(kind::kTraining)) return kind::kTraining;
  if (view.has(kind::kReference)) return kind::kReference;
  throw Error(ErrorCode::NotFound,
              "view '" + view.header().view +
                  "' has neither training pictures nor a reference picture to learn from");
}

std::string sourceOf(const ViewData& view, const std::string& wanted) {
  if (!wanted.empty()) return wanted;
  for (const std::string_view kind : {kind::kSliced, kind::kLength, kind::kAttenuation})
    if (view.has(kind)) return std::string(kind);
  throw Error(ErrorCode::NotFound,
              "view '" + view.header().view +
                  "' stores neither sliced, length nor attenuation: there is nothing to recompose");
}

/// Adds the pixels of one picture that show anything, in the picture or in its attenuation.
void addPixels(const std::vector<std::vector<float>>& groups, const ProxyPart& picture,
               LearningSamples& samples) {
  const char* const names[] = {"R", "G", "B"};
  const Channel* colors[3];
  for (int c = 0; c < 3; ++c) {
    colors[c] = picture.find(names[c]);
    if (!colors[c])
      throw Error(ErrorCode::Format, "the picture '" + picture.name + "' has no colours");
  }
  const auto channels = std::size_t(samples.channels);
  for (std::size_t i = 0; i < colors[0]->values.size(); ++i) {
    float sum = 0.0f;
    for (std::size_t k = 0; k < channels; ++k) sum += groups[k / 4][4 * i + k % 4];
    if (!(sum > 0.0f)) continue;
    for (std::size_t k = 0; k < channels; ++k)
      samples.attenuation.push_back(groups[k / 4][4 * i + k % 4]);
    for (const Channel* color : colors) samples.color.push_back(color->values[i]);
  }
}

}  // namespace

std::vector<std::string> trainableViews(const Archive& archive, long cycle,
                                        const std::string& field) {
  std::vector<std::string> views;
  for (const std::string& view : archive.views()) {
    if (archive.find(cycle, view, field, kind::kTraining) ||
        archive.find(cycle, view, field, kind::kReference))
      views.push_back(view);
  }
  return views;
}

LearningSamples learningSamples(gl::Device& device, const Archive& archive,
                                const TrainingRequest& request, ProxyHeader& header) {
  LearningSamples samples;
  device.run([&] {
    ViewData view(archive, request.cycle, request.view, request.field);
    const ProxyImage pictures = view.image(picturesOf(view));
    const std::string from = sourceOf(view, request.from);
    header = pictures.header;
    if (header.kind == kind::kReference) {
      if (header.customization)
        throw Error(ErrorCode::NotFound,
                    "the run customised the reference picture of view '" + request.view +
                        "' by position, which no table of colours knows: store training pictures");
      if (!header.base)
        throw Error(ErrorCode::Format,
                    "the reference picture does not say under which transfer function it was made");
      header.looks = {*header.base};
      if (header.shading.empty()) header.shading = "unlit";
    }
    if (!view.partition())
      throw Error(ErrorCode::NotFound, "view '" + request.view + "' stores no intervals");
    header.partition = *view.partition();
    header.learned = LearnedOrigin{from, header.size, 0.0};
    const std::size_t count = std::min(header.looks.size(), std::size_t(request.pictures));
    header.looks.erase(header.looks.begin() + std::ptrdiff_t(count), header.looks.end());
    samples.channels = header.partition->channels();
    EditPass edit;
    for (std::size_t i = 0; i < count; ++i) {
      const gl::Texture attenuation = attenuationFrom(edit, view, from, header.looks[i]);
      const ProxyHeader& source = view.header();
      if (source.size != header.size || source.camera != header.camera)
        throw Error(ErrorCode::Format, "the pictures of view '" + request.view +
                                           "' have another size or camera than its " + from +
                                           " proxy");
      addPixels(edit.readAttenuation(attenuation, header.size, samples.channels), pictures.parts[i],
                samples);
    }
  });
  return samples;
}

ProxyImage trainColors(gl::Device& device, const Archive& archive, const TrainingRequest& request) {
  ProxyHeader header;
  const LearningSamples samples = learningSamples(device, archive, request, header);
  const LearnedFit fit = fitLearnedColor(
      samples, header.looks.front().onIntervals(*header.partition).color, request.clusters);
  header.learned->error = fit.error;
  return learnedImage(std::move(header), fit.table);
}

}  // namespace vestige
