// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>
#include <explorer/renderer/renderer.h>
#include <proxy/archive/archive.h>
#include <proxy/version.h>

int main(int, char** arguments) {
  const auto findings = vestige::checkArchive(arguments[1]);
  for (const auto& finding : findings) {
    std::fprintf(stderr, "%s: %s\n", finding.file.c_str(), finding.problem.c_str());
  }
  const vestige::Archive archive(arguments[1]);
  std::printf("vestige %s: %zu rows\n", vestige::kVersion, archive.rows().size());
  return findings.empty() && archive.rows().size() >= 5 ? 0 : 1;
}
