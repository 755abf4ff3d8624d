// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "explorer/program/cli.h"
#include "explorer/program/doctor.h"

namespace vestige::cli {

void addDoctor(CLI::App& app, int& exitCode) {
  CLI::App* command =
      app.add_subcommand("doctor", "Says what is found, what works and how to mend the rest");
  command->callback([&exitCode] {
    for (const Diagnosis& diagnosis : diagnose()) {
      fmt::print("{:8} {}  {}\n", diagnosis.name, diagnosis.works ? "ok  " : "FAIL",
                 diagnosis.finding);
      if (!diagnosis.works) fmt::print("{:8}       mend: {}\n", "", diagnosis.mend);
      if (!diagnosis.works && diagnosis.needed) exitCode = 1;
    }
  });
}

}  // namespace vestige::cli
