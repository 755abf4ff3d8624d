// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>
#include <vector>
#include <vestige.hpp>

int main() {
  std::vector<double> field(8 * 8 * 8);
  for (std::size_t i = 0; i < field.size(); ++i) field[i] = 0.5 * double(i % 97);
  vestige_options options = VESTIGE_OPTIONS_INIT;
  options.output = "cpp.cdb";
  options.config_text = "[image]\nwidth = 32\nheight = 32\n";
  vestige::Adaptor adaptor(options);
  adaptor.block(0, vestige::uniformGrid({8, 8, 8}, {0, 0, 0}, {1, 1, 1}));
  for (int cycle = 0; cycle < 2; ++cycle) {
    if (!adaptor.wants(cycle, cycle)) return 1;
    adaptor.shareField(0, "halves", VESTIGE_POINT, field.data());
    if (adaptor.execute(cycle, cycle) != VESTIGE_OK) {
      std::fprintf(stderr, "%s\n", adaptor.lastError().c_str());
      return 1;
    }
  }
  vestige::Adaptor moved = std::move(adaptor);
  return moved.storedSteps() == 2 && adaptor.get() == nullptr ? 0 : 1;
}
