// SPDX-License-Identifier: BSD-3-Clause
// vestige-explorer: pictures from an archive, without the fields. Exit codes: 0 done, 1 an error
// (one sentence on standard error), 2 a wrong command line.
#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "explorer/picture/printable.h"
#include "explorer/program/cli.h"
#include "proxy/base/error.h"
#include "proxy/base/nearest_word.h"
#include "proxy/version.h"

namespace {

/// The options of the subcommand that was called, "--size".
std::vector<std::string> optionsOf(const CLI::App& app) {
  const auto called = app.get_subcommands();
  std::vector<std::string> names;
  for (const CLI::Option* option : (called.empty() ? &app : called.front())->get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Explores archives of Vestige: pictures from proxies, without the raw fields."};
  app.name("vestige-explorer");
  app.set_version_flag("--version", std::string("vestige-explorer ") + vestige::kVersion);
  app.require_subcommand(1);
  app.fallthrough(false);
  int exitCode = 0;
  using namespace vestige::cli;
  addInfo(app, exitCode);
  addRender(app, exitCode);
  addMovie(app, exitCode);
  addCompare(app, exitCode);
  addCheck(app, exitCode);
  addDoctor(app, exitCode);
  addExport(app, exitCode);
  addProbe(app, exitCode);
#ifdef VESTIGE_TRAINING
  addTrain(app, exitCode);
#endif
  addFit(app, exitCode);
  addColormaps(app, exitCode);
  groupCommands(app);
  if (argc > 1 && argv[1][0] != '-' &&
      app.get_subcommands([&](CLI::App* command) { return command->check_name(argv[1]); })
          .empty()) {
    std::vector<std::string> names;
    for (const CLI::App* command : app.get_subcommands([](CLI::App*) { return true; }))
      names.push_back(command->get_name());
    fmt::print(stderr, "No command is called '{}'{}\nRun with --help for more information.\n",
               argv[1], vestige::didYouMean(argv[1], names));
    return 2;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (app.exit(error) == 0) return 0;
    fmt::print(stderr, "{}",
               vestige::optionHints(optionsOf(app), {argv + 1, std::size_t(argc - 1)}));
    return 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "vestige-explorer: {}\n", vestige::printable(error.what()));
    return 1;
  }
  if (std::fflush(stdout) != 0 || std::ferror(stdout)) {
    fmt::print(stderr, "vestige-explorer: standard output could not be written\n");
    return 1;
  }
  return exitCode;
}
