// SPDX-License-Identifier: BSD-3-Clause
#include <string_view>
#include <utility>

#include "explorer/program/cli.h"

namespace vestige::cli {
namespace {

using Groups = std::pair<const char*, std::vector<std::string_view>>;

template <typename Name>
const char* groupOf(const std::vector<Groups>& groups, const Name& isName, const char* other) {
  for (const auto& [group, names] : groups)
    for (const std::string_view name : names)
      if (isName(std::string(name))) return group;
  return other;
}

}  // namespace

void groupCommands(CLI::App& app) {
  const std::vector<Groups> groups{{"Pictures", {"render", "movie", "compare", "colormaps"}},
                                   {"Numbers", {"info", "probe", "export"}},
                                   {"Making more of an archive", {"fit", "train"}},
                                   {"Health", {"check", "doctor"}}};
  for (CLI::App* command : app.get_subcommands([](CLI::App*) { return true; }))
    command->group(groupOf(
        groups, [&](const std::string& name) { return command->get_name() == name; }, "Others"));
}

void groupLookOptions(const std::vector<CLI::Option*>& options) {
  const std::vector<Groups> groups{
      {"What is shown",
       {"--step", "--time", "--field", "--view", "--source", "--draw", "--isosurfaces",
        "--isosurface", "--slice", "--clip", "--via", "--order"}},
      {"Viewer and picture",
       {"--rotate", "--size", "--zoom", "--pan", "--center", "--fit", "--frame", "--scale",
        "--background"}},
      {"Opacity and colour",
       {"--opacity", "--reference-length", "--factors", "--colormap", "--color-range", "--color",
        "--customize"}},
      {"Features", {"--classifier", "--feature"}},
      {"Light",
       {"--light", "--shading", "--normals", "--ao", "--ao-radius", "--enhance",
        "--enhance-lambda"}},
      {"Annotations", {"--colorbar", "--axes", "--box", "--time-label", "--seeds", "--trust"}},
      {"Files and machines", {"--look", "--save-look", "--gl"}}};
  for (CLI::Option* option : options)
    option->group(groupOf(
        groups, [&](const std::string& name) { return option->check_name(name); }, "Look"));
}

}  // namespace vestige::cli
