// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "explorer/program/cli.h"
#include "explorer/picture/picture.h"
#include "explorer/annotation/text.h"
#include "proxy/transfer/colormap.h"

namespace vestige::cli {
namespace {

/// A bar of each colour map from 0 to 1, its name before it.
Picture drawn(const std::vector<std::string>& names) {
  constexpr int kRow = 28, kGap = 6, kBar = 512, kEdge = 12;
  const Font font(16);
  double widest = 0.0;
  for (const std::string& name : names) widest = std::max(widest, font.width(name));
  const int left = 2 * kEdge + int(widest);
  Picture picture = Picture::blank({left + kBar + kEdge, kEdge + int(names.size()) * kRow + kGap});
  placeOver(picture, glm::dvec3(0.0));
  for (std::size_t i = 0; i < names.size(); ++i) {
    const Colormap map = Colormap::named(names[i]);
    const int top = kEdge + int(i) * kRow, height = kRow - kGap;
    for (int x = 0; x < kBar; ++x) {
      const glm::dvec3 color = map.at(double(x) / (kBar - 1));
      for (int y = top; y < top + height; ++y)
        for (int c = 0; c < 3; ++c) picture.pixel(left + x, y)[c] = float(color[c]);
    }
    font.draw(picture, {double(kEdge), top + 0.5 * (height + font.digitHeight())}, names[i],
              glm::dvec3(1.0));
  }
  return picture;
}

}  // namespace

void addColormaps(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand("colormaps", "Lists and draws the colour maps");
  auto output = std::make_shared<std::string>();
  command->add_option("-o,--output", *output, "Draw them into this picture (.png or .exr)");
  command->callback([output] {
    const std::vector<std::string> names = Colormap::names();
    if (!output->empty()) writePicture(*output, drawn(names));
    fmt::print("{}\n", fmt::join(names, "\n"));
  });
}

}  // namespace vestige::cli
