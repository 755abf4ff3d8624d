/* SPDX-License-Identifier: BSD-3-Clause */
/* Values and layouts that compiled solvers rely upon (LP64). One may add to them only. */
#include <stdio.h>
#include <string.h>
#include <vestige.h>

static int failures = 0;

static void expect(const char *what, long actual, long expected) {
  if (actual == expected) return;
  fprintf(stderr, "%s is %ld, was %ld\n", what, actual, expected);
  ++failures;
}

#define EXPECT(expression, expected) expect(#expression, (long)(expression), (long)(expected))

static void checkCodes(void) {
  EXPECT(VESTIGE_OK, 0);
  EXPECT(VESTIGE_ERROR_ARGUMENT, 1);
  EXPECT(VESTIGE_ERROR_CONFIG, 2);
  EXPECT(VESTIGE_ERROR_NO_GL, 3);
  EXPECT(VESTIGE_ERROR_GL, 4);
  EXPECT(VESTIGE_ERROR_IO, 5);
  EXPECT(VESTIGE_ERROR_NO_SPACE, 6);
  EXPECT(VESTIGE_ERROR_FORMAT, 7);
  EXPECT(VESTIGE_ERROR_EXISTS, 8);
  EXPECT(VESTIGE_ERROR_NOT_FOUND, 9);
  EXPECT(VESTIGE_ERROR_INTERNAL, 10);
  EXPECT(VESTIGE_ERROR_MEMORY, 11);
  EXPECT(VESTIGE_ERROR_MPI, 12);
  EXPECT(VESTIGE_ERROR_VERSION, 13);
  EXPECT(VESTIGE_ERROR_GRID, 14);
  EXPECT(VESTIGE_ERROR_NO_BLOCK, 15);
  EXPECT(VESTIGE_ERROR_NO_FIELD, 16);
  EXPECT(VESTIGE_ERROR_FIELD, 17);
  EXPECT(VESTIGE_ERROR_CYCLE, 18);
}

static void checkEnums(void) {
  EXPECT(VESTIGE_FLOAT32, 0);
  EXPECT(VESTIGE_FLOAT64, 1);
  EXPECT(VESTIGE_INT8, 2);
  EXPECT(VESTIGE_UINT8, 3);
  EXPECT(VESTIGE_INT16, 4);
  EXPECT(VESTIGE_UINT16, 5);
  EXPECT(VESTIGE_INT32, 6);
  EXPECT(VESTIGE_UINT32, 7);
  EXPECT(VESTIGE_INT64, 8);
  EXPECT(VESTIGE_UINT64, 9);
  EXPECT(VESTIGE_POINT, 0);
  EXPECT(VESTIGE_CELL, 1);
  EXPECT(VESTIGE_INFO, 0);
  EXPECT(VESTIGE_WARNING, 1);
  EXPECT(VESTIGE_ERROR, 2);
  EXPECT(VESTIGE_QUIET, 1);
  EXPECT(sizeof(vestige_code), 4);
  EXPECT(VESTIGE_NO_MPI, -2147483647L - 1);
}

static void checkLayouts(void) {
  EXPECT(offsetof(vestige_options, size), 0);
  EXPECT(offsetof(vestige_options, config), 8);
  EXPECT(offsetof(vestige_options, config_text), 16);
  EXPECT(offsetof(vestige_options, output), 24);
  EXPECT(offsetof(vestige_options, mpi_comm), 32);
  EXPECT(offsetof(vestige_options, flags), 36);
  EXPECT(offsetof(vestige_options, log), 40);
  EXPECT(offsetof(vestige_options, log_data), 48);
  EXPECT(sizeof(vestige_options), 56);
  EXPECT(offsetof(vestige_grid, size), 0);
  EXPECT(offsetof(vestige_grid, points), 8);
  EXPECT(offsetof(vestige_grid, first), 20);
  EXPECT(offsetof(vestige_grid, origin), 32);
  EXPECT(offsetof(vestige_grid, spacing), 56);
  EXPECT(offsetof(vestige_grid, axes), 80);
  EXPECT(offsetof(vestige_grid, ghosts), 104);
  EXPECT(sizeof(vestige_grid), 128);
}

/* Without any GL or file: a session that cannot be opened, used from C. */
static void checkCalls(void) {
  vestige_options options = VESTIGE_OPTIONS_INIT;
  vestige_grid grid = VESTIGE_GRID_INIT;
  vestige_session *session = NULL;
  float value = 0.0f;
  options.flags = VESTIGE_QUIET;
  options.config_text = "[image]\nwidht = 3\n";
  EXPECT(vestige_open(&options, &session), VESTIGE_ERROR_CONFIG);
  EXPECT(session != NULL, 1);
  EXPECT(vestige_wants(session, 0, 0.0), 0);
  EXPECT(vestige_wants_field(session, "f"), 0);
  EXPECT(vestige_block(session, 0, &grid), VESTIGE_ERROR_CONFIG);
  EXPECT(vestige_share_field(session, 0, "f", VESTIGE_FLOAT32, VESTIGE_POINT, 1, &value, NULL),
         VESTIGE_ERROR_CONFIG);
  EXPECT(vestige_execute(session, 0, 0.0), VESTIGE_ERROR_CONFIG);
  EXPECT(strstr(vestige_last_error(session), "did you mean width?") != NULL, 1);
  EXPECT(vestige_close(session), VESTIGE_ERROR_CONFIG);
  EXPECT(strcmp(vestige_code_name(VESTIGE_ERROR_CONFIG), "VESTIGE_ERROR_CONFIG"), 0);
  EXPECT(vestige_version()[0] != '\0', 1);
}

int main(void) {
  checkCodes();
  checkEnums();
  checkLayouts();
  checkCalls();
  return failures ? 1 : 0;
}
