// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/run/dry_run.h"

#include <fmt/format.h>

#include <map>

namespace vestige {

DryRunReport dryRunReport(const StepFrame& frame, const std::vector<EncodedProxy>& proxies,
                          const StepTimes& times) {
  std::map<std::pair<std::string, std::string>, std::size_t> bytes;
  std::size_t sum = 0, files = 0;
  for (const auto& proxy : proxies) {
    const std::size_t size = proxy.exr.size() + proxy.png.size();
    bytes[{proxy.field, proxy.kind}] += size;
    sum += size;
    files += proxy.png.empty() ? 1 : 2;
  }
  std::size_t fieldBytes = 0;
  for (const auto& [index, block] : frame.blocks->blocks()) {
    for (const auto& field : block.fields) {
      fieldBytes += sizeOf(field.type) * field.components.size() * std::size_t(field.size[0]) *
                    std::size_t(field.size[1]) * std::size_t(field.size[2]);
    }
  }
  DryRunReport report{sum, {}};
  report.sentences.push_back(fmt::format(
      "dry run: a step takes {:.3f} s without writing ({:.3f} ingest, {:.3f} upload, {:.3f} march, "
      "{:.3f} read-back, {:.3f} encoding) and {} bytes in {} files, {:.1f} % of the {} bytes of "
      "shared fields",
      times.sum(), times.ingest, times.upload, times.march, times.readBack, times.encode, sum,
      files, fieldBytes ? 100.0 * double(sum) / double(fieldBytes) : 0.0, fieldBytes));
  for (const auto& [key, size] : bytes) {
    report.sentences.push_back(fmt::format("dry run: field '{}', proxy '{}': {} bytes in {} view{}",
                                           key.first, key.second, size, frame.views.size(),
                                           frame.views.size() == 1 ? "" : "s"));
  }
  return report;
}

}  // namespace vestige
