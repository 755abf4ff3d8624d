/* SPDX-License-Identifier: BSD-3-Clause */
#include <vestige.h>

int main(void) {
  static unsigned char field[8 * 8 * 8];
  vestige_options options = VESTIGE_OPTIONS_INIT;
  vestige_grid grid = VESTIGE_GRID_INIT;
  vestige_session *session = NULL;
  int i, code;
  for (i = 0; i < 8 * 8 * 8; ++i) field[i] = (unsigned char)(i % 251);
  for (i = 0; i < 3; ++i) grid.points[i] = 8;
  options.output = "c.cdb";
  options.config_text = "[image]\nwidth = 32\nheight = 32\n";
  code = vestige_open(&options, &session);
  if (code == VESTIGE_OK) code = vestige_block(session, 0, &grid);
  if (code == VESTIGE_OK) {
    code = vestige_share_field(session, 0, "bytes", VESTIGE_UINT8, VESTIGE_POINT, 1, field, NULL);
  }
  if (code == VESTIGE_OK) code = vestige_execute(session, 1, 0.5);
  vestige_close(session);
  return code;
}
