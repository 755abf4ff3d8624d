// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "adaptor/ingest/block_set.h"

namespace vestige {

/// Dumps every publish, so that vestige-replay can re-issue it (VESTIGE_RECORD=directory). The
/// directory, which is made, or the first of directory.1, directory.2 ... that holds no recording,
/// gets
///
///   config.toml   the text of the configuration, empty for the defaults
///   calls.jsonl   one JSON object a line, appended as the calls come; numbers round-trip exactly:
///     {"call": "open", "version": "0.1.0", "output": "vestige.cdb"}
///     {"call": "execute", "cycle": 10, "time": 0.5,
///      "domain": [lx, ly, lz, hx, hy, hz],              (only if vestige_domain was called)
///      "units": {"temperature": "K"},                   (all that are known by now)
///      "blocks": [{"index": 0,
///                  "file": "step000000_block0000.vti",  ("" for an empty block)
///                  "points": [nx, ny, nz], "first": [i, j, k], "origin": [x, y, z],
///                  "spacing": [dx, dy, dz], "axes": [false, false, true],
///                  "ghosts": [0, 1, 0, 0, 0, 0],
///                  "fields": [{"name": "temperature", "location": "point", "type": "Float32",
///                              "components": 1}, ...],  (in the order in which they were shared)
///                  "masks": ["point", "cell"]}, ...]}   (locations that have a mask)
///     {"call": "close"}                                 (missing if the host died)
///   stepSSSSSS_blockBBBB.vti, or .vtr if any axis has explicit coordinates: raw appended data in
///                 the fields' own types, ghosts included, whole extent = first .. first+points-1.
///                 A mask is a UInt8 array "vestige:mask" in PointData or CellData, 1 = no data.
///                 A uniform axis of a .vtr is written out; "axes" tells which were explicit.
///
/// "units" and "domain" are state: replay calls vestige_units and vestige_domain before the
/// execute.
class Recorder {
 public:
  /// Throws Io / NoSpace.
  Recorder(const std::filesystem::path& directory, const std::string& configText,
           const std::string& output);
  /// Writes "close".
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Where it records.
  const std::filesystem::path& directory() const { return directory_; }
  void execute(std::int64_t cycle, double time, const BlockSet& blocks,
               const std::map<std::string, std::string>& units);

 private:
  void append(const nlohmann::json& call);

  std::filesystem::path directory_;
  int steps_ = 0;
};

}  // namespace vestige
