// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "mini-sim/replay/session.h"

namespace minisim {

/// A folder that VESTIGE_RECORD made (adaptor/run/record.h has its format).
class Recording {
 public:
  static bool isOne(const std::filesystem::path& folder);
  /// Parses the calls; throws std::runtime_error naming file, line and reason. A torn last line,
  /// which a killed host leaves, is ignored.
  explicit Recording(std::filesystem::path folder);

  const std::string& config() const { return config_; }
  const std::string& output() const { return output_; }
  long steps() const { return long(executes_.size()); }
  /// Issues the calls of step `step` again. Throws std::runtime_error when a file of it cannot be
  /// read or is not what the calls say; errors of the adaptor come as its code.
  int replay(long step, Session& session) const;

 private:
  std::filesystem::path folder_;
  std::string config_, output_;
  std::vector<nlohmann::json> executes_;
};

}  // namespace minisim
