// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace vestige {

/// What one stored step cost. Seconds of wall time; phases do not overlap.
struct StepTimes {
  double ingest = 0.0;    ///< statistics, and conversion of the fields to normalised floats
  double upload = 0.0;    ///< to the GL device
  double march = 0.0;     ///< rays, and compositing of blocks
  double readBack = 0.0;  ///< from the GL device
  double encode = 0.0;    ///< proxy images, previews, EXR and PNG bytes
  double write = 0.0;     ///< files, fsync, table
  double sum() const { return ingest + upload + march + readBack + encode + write; }
};

/// timings.csv beside data.csv, one line a stored step:
/// cycle,time,ingest,upload,march,readback,encode,write,peak_memory,bytes
/// with seconds, then the process's peak resident memory and the bytes written by the step.
inline constexpr const char* kTimingsFile = "timings.csv";
inline constexpr const char* kTimingsHeader =
    "cycle,time,ingest,upload,march,readback,encode,write,peak_memory,bytes\n";

std::string timingsLine(std::int64_t cycle, double time, const StepTimes& times,
                        std::uint64_t peakMemory, std::uint64_t bytes);
/// Appends a line, with the header if the file is new or empty; a torn last line of a run that died
/// is ended first. Throws Io / NoSpace.
void appendTimings(const std::filesystem::path& file, const std::string& line);
/// This process's peak resident set in bytes.
std::uint64_t peakMemory();

}  // namespace vestige
