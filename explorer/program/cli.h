// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>

#include "explorer/picture/look.h"
#include "explorer/renderer/renderer.h"

namespace vestige::cli {

/// The subcommands; each adds itself to the program, with a callback that does the work and throws
/// vestige::Error. `exitCode` is what the program returns when nothing was thrown.
void addInfo(CLI::App& app, int& exitCode);
void addRender(CLI::App& app, int& exitCode);
void addMovie(CLI::App& app, int& exitCode);
void addCompare(CLI::App& app, int& exitCode);
void addCheck(CLI::App& app, int& exitCode);
void addDoctor(CLI::App& app, int& exitCode);
void addExport(CLI::App& app, int& exitCode);
void addProbe(CLI::App& app, int& exitCode);
void addTrain(CLI::App& app, int& exitCode);
void addFit(CLI::App& app, int& exitCode);
void addColormaps(CLI::App& app, int& exitCode);
/// Puts the commands into the groups of --help.
void groupCommands(CLI::App& app);
/// Puts the options of a look into the groups of --help: those that are not named here stand with
/// the look.
void groupLookOptions(const std::vector<CLI::Option*>& options);

/// The options that change a look: each is a part of it, and goes before the same key in --look.
class LookOptions {
 public:
  explicit LookOptions(CLI::App& command);
  /// --look's file with the other options applied; writes --save-look. Throws Config or Io.
  Look look() const;
  const std::string& backend() const { return backend_; }

 private:
  CLI::App* command_;
  std::string lookFile_, saveLook_, backend_ = "auto";
  long cycle_ = 0;
  double time_ = 0.0, referenceLength_ = 0.0, aoRadius_ = 0.0, enhanceLambda_ = 0.0, zoom_ = 1.0;
  std::string field_, view_, source_, rotate_, size_, opacity_, factors_, colormap_, colorRange_;
  std::string customize_, seeds_;
  std::string draw_, isosurfaces_, slice_, clip_, frame_, pan_, center_, scale_;
  std::string color_, via_, order_, shading_, normals_, background_;
  std::vector<std::string> lights_, features_, surfaces_;
  std::string classifierFile_;
  bool ao_ = false, enhance_ = false, trust_ = false, fit_ = false;
  bool colorbar_ = false, axes_ = false, box_ = false, timeLabel_ = false;
};

/// "1,2,3": numbers separated by commas, between `least` and `most` of them; throws Config naming
/// the option and the segment that is none.
std::vector<double> numbersFromText(const std::string& option, const std::string& text,
                                    std::size_t least, std::size_t most);

/// Says what of a look was in vain, on standard error.
void printWarnings(const std::vector<Warning>& warnings);

/// A whole text file; throws Io naming it.
std::string textOfFile(const std::string& path);

/// A bar on the terminal, or nothing when standard error is none.
class ProgressBar {
 public:
  explicit ProgressBar(const char* label);
  ~ProgressBar();
  void show(int done, int total);

 private:
  const char* label_;
  bool terminal_;
  bool shown_ = false;
};

}  // namespace vestige::cli
