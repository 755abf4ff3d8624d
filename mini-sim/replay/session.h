// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vtkSmartPointer.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "adaptor/include/vestige.h"

class vtkDataArray;
class vtkDataSet;

namespace vestige {
class VtkImport;
}

namespace minisim {

/// vestige_type of an array's values; -1 if the adaptor has none for it.
int vestigeType(vtkDataArray* array);

/// An open adaptor and the VTK objects whose memory it shares for the step.
class Session {
 public:
  struct Options {
    std::string config;      ///< path, or "" ...
    std::string configText;  ///< ... the text itself, or ""
    std::string output;
    std::function<void(const std::string&)> warn;
  };
  explicit Session(const Options& options);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// The code of the first call that failed since opening or the last execute.
  int code() const { return code_; }
  std::string lastError() const;
  std::int64_t storedSteps() const { return vestige_stored_steps(vestige_); }
  /// Whether the configuration asks for figures only: no step is stored.
  bool dryRun() const { return dryRun_; }

  bool wants(std::int64_t cycle, double time) { return vestige_wants(vestige_, cycle, time) != 0; }
  void domain(const double low[3], const double high[3]);
  void units(const std::string& name, const std::string& units);
  void block(int block, const vestige_grid& grid);
  /// All components of a packed array; the array lives until the step is executed.
  void field(int block, const std::string& name, int location, vtkDataArray* array);
  void mask(int block, int location, vtkDataArray* array);
  /// Describes a data set as block 0 and shares its numeric arrays; images and rectilinear grids as
  /// they are, others resampled (adaptor/include/vestige_vtk.h).
  void dataSet(vtkDataSet* data, int resampledPoints);
  /// Keeps the first error, its own or an earlier call's, and returns it.
  int execute(std::int64_t cycle, double time);

 private:
  void note(int code) {
    if (code_ == VESTIGE_OK) code_ = code;
  }
  Options options_;
  vestige_session* vestige_ = nullptr;
  int code_ = VESTIGE_OK;      ///< since opening or the last execute
  int lastCode_ = VESTIGE_OK;  ///< of the last execute
  bool dryRun_ = false;
  std::vector<vtkSmartPointer<vtkDataArray>> shared_;
  std::unique_ptr<vestige::VtkImport> import_;
};

/// Leaves only the array of that name (and VTK's own) in a data set. Throws std::runtime_error
/// naming those that are there when it is not.
void keepArray(vtkDataSet* data, const std::string& array);

}  // namespace minisim
