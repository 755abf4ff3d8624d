// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/step/timings.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <cstdio>

#include "proxy/base/durable_file.h"

namespace vestige {

std::string timingsLine(std::int64_t cycle, double time, const StepTimes& times,
                        std::uint64_t peakMemoryBytes, std::uint64_t bytes) {
  return fmt::format("{},{},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{},{}\n", cycle, time,
                     times.ingest, times.upload, times.march, times.readBack, times.encode,
                     times.write, peakMemoryBytes, bytes);
}

void appendTimings(const std::filesystem::path& file, const std::string& line) {
  bool empty = true, torn = false;
  if (std::FILE* existing = std::fopen(file.c_str(), "rb")) {
    if (std::fseek(existing, -1, SEEK_END) == 0) {
      empty = false;
      torn = std::fgetc(existing) != '\n';
    }
    std::fclose(existing);
  }
  appendDurably(file, (empty ? kTimingsHeader : "") + std::string(torn ? "\n" : "") + line);
}

std::uint64_t peakMemory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return std::uint64_t(usage.ru_maxrss) * 1024;
}

}  // namespace vestige
