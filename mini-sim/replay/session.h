// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vtkSmartPointer.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "adaptor/vestige.h"

class vtkDataArray;
class vtkDataSet;

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

  bool wants(std::int64_t cycle, double time) { return vestige_wants(vestige_, cycle, time) != 0; }
  void domain(const double low[3], const double high[3]);
  void units(const std::string& name, const std::string& units);
  void block(int block, const vestige_grid& grid);
  /// All components of a packed array; the array lives until the step is executed.
  void field(int block, const std::string& name, int location, vtkDataArray* array);
  void mask(int block, int location, vtkDataArray* array);
  /// Keeps the first error, its own or an earlier call's, and returns it.
  int execute(std::int64_t cycle, double time);

 private:
  void note(int code) {
    if (code_ == VESTIGE_OK) code_ = code;
  }
  Options options_;
  vestige_session* vestige_ = nullptr;
  int code_ = VESTIGE_OK;
  std::vector<vtkSmartPointer<vtkDataArray>> shared_;
};

/// Describes an image or rectilinear grid as block 0 and shares its numeric arrays: all, or the one
/// called `array`. Throws std::runtime_error when the data set is of another kind or has no such
/// array.
void shareDataSet(Session& session, vtkDataSet* data, const std::string& array);

}  // namespace minisim
