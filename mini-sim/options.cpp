// SPDX-License-Identifier: BSD-3-Clause
#include "mini-sim/options.h"

#include <CLI/CLI.hpp>
#include <charconv>
#include <map>
#include <stdexcept>

#include "mini-sim/option_hints.h"
#include "proxy/version.h"

namespace minisim {
namespace {

const std::map<std::string, unsigned> kFieldNames = {{"temperature", kTemperature},
                                                     {"density", kDensity},
                                                     {"velocity", kVelocity},
                                                     {"vorticity", kVorticity}};

constexpr char kFooter[] =
    "Lengths are in heights of the box, times in free-fall times, velocities in free-fall\n"
    "velocities, temperatures in that of the hot patch.\n"
    "Exit codes: 0 done (whatever became of the adaptor), 1 the simulation failed, 2 bad usage,\n"
    "130 interrupted; the archive is closed in all of them.";

}  // namespace

std::array<int, 3> sizeFromText(const std::string& text) {
  std::array<int, 3> size{};
  int count = 0;
  const char *at = text.data(), *end = at + text.size();
  while (count < 3) {
    const auto [next, error] = std::from_chars(at, end, size[count]);
    if (error != std::errc() || size[count] < 1) break;
    ++count;
    at = next;
    if (at == end || (*at != ',' && *at != 'x')) break;
    ++at;
  }
  if (at != end || (count != 1 && count != 3))
    throw std::invalid_argument("'" + text + "' is not a size such as 128 or 128,96,64");
  if (count == 1) size[1] = size[2] = size[0];
  return size;
}

std::optional<Options> parseOptions(int argc, char** argv, int& exitCode) {
  Options o;
  o.plume.size = {128, 128, 128};
  std::string size = "128", precision = "float";
  std::vector<std::string> fields;
  bool noAdaptor = false;
  CLI::App app("A turbulent thermal plume (lattice Boltzmann), watched by Vestige while it runs.",
               "vestige-mini-sim");
  app.footer(kFooter);
  app.set_version_flag("--version", std::string("vestige-mini-sim ") + vestige::kVersion);
  app.add_option("--size", size, "cells: N, or NX,NY,NZ")->capture_default_str();
  app.add_option("--steps", o.steps, "time steps")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--config", o.config,
                 "the adaptor's configuration (TOML); see mini-sim/plume.toml");
  app.add_option("--output", o.output, "the archive, instead of the configuration's");
  app.add_option("--every", o.every,
                 "offer every n-th cycle to the adaptor (default 10, with --config 1: its triggers "
                 "decide)")
      ->check(CLI::PositiveNumber);
  app.add_option("--fields", fields, "share only these (default all)")
      ->delimiter(',')
      ->check(CLI::IsMember(kFieldNames));
  app.add_flag("--no-adaptor", noAdaptor, "simulate only");
  app.add_option("--precision", precision, "float or double")
      ->check(CLI::IsMember({"float", "double"}))
      ->capture_default_str();
  app.add_option("--threads", o.plume.threads, "threads (default: what OpenMP chooses)")
      ->check(CLI::Range(1, 1024));
  app.add_option("--seed", o.plume.seed, "of the perturbation")->capture_default_str();
  app.add_option("--rayleigh", o.plume.rayleigh, "Rayleigh number")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--prandtl", o.plume.prandtl, "Prandtl number")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_flag("--announce", o.announce, "print 'stored CYCLE' once a step is in the archive");
  app.add_flag("--quiet", o.quiet, "no progress");
  try {
    app.parse(argc, argv);
    o.plume.size = sizeFromText(size);
  } catch (const CLI::ParseError& error) {
    exitCode = app.exit(error) == 0 ? kDone : kUsage;
    if (exitCode == kUsage) hintAtOptions(app, argc, argv);
    return std::nullopt;
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "--size: %s\nRun with --help for more information.\n", error.what());
    exitCode = kUsage;
    return std::nullopt;
  }
  o.doublePrecision = precision == "double";
  o.adaptor = !noAdaptor;
  if (o.every == 0) o.every = o.config.empty() ? 10 : 1;
  if (!fields.empty()) {
    o.fields = 0;
    for (const std::string& name : fields) o.fields |= kFieldNames.at(name);
  }
  return o;
}

}  // namespace minisim
