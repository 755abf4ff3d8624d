// SPDX-License-Identifier: BSD-3-Clause
// vestige-explorer: pictures from an archive, without the fields. Exit codes: 0 done, 1 an error
// (one sentence on standard error), 2 a wrong command line.
#include <fmt/format.h>

#include <exception>
#include <string>

#include "explorer/cli.h"
#include "proxy/error.h"
#include "proxy/version.h"

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
  addTrain(app, exitCode);
  addFit(app, exitCode);
  if (argc > 1 && argv[1][0] != '-' &&
      app.get_subcommands([&](CLI::App* command) { return command->check_name(argv[1]); })
          .empty()) {
    fmt::print(stderr, "No command is called '{}'\nRun with --help for more information.\n",
               argv[1]);
    return 2;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "vestige-explorer: {}\n", error.what());
    return 1;
  }
  return exitCode;
}
