/* SPDX-License-Identifier: BSD-3-Clause */
/* A complete solver, instrumented: heat spreads from a hot ring through a cold cube. */
#include <stdio.h>
#include <stdlib.h>
#include <vestige.h>

enum { N = 64, CYCLES = 100 };

static void report(int level, const char *sentence, void *user_data) {
  (void)user_data;
  fprintf(level == VESTIGE_ERROR ? stderr : stdout, "%s\n", sentence);
}

static size_t at(int x, int y, int z) { return ((size_t)z * N + (size_t)y) * N + (size_t)x; }

int main(void) {
  double *heat = calloc((size_t)N * N * N, sizeof *heat);
  double *next = calloc((size_t)N * N * N, sizeof *next);
  if (!heat || !next) return 1;
  for (int z = 0; z < N; ++z)
    for (int y = 0; y < N; ++y)
      for (int x = 0; x < N; ++x) {
        long dx = x - N / 2, dy = y - N / 2, dz = z - N / 2, ring = N / 4, thick = N / 12;
        long d = dx * dx + dz * dz, q = d + dy * dy + ring * ring - thick * thick;
        heat[at(x, y, z)] = q * q < 4 * ring * ring * d ? 100.0 : 20.0;
      }

  vestige_options options = VESTIGE_OPTIONS_INIT;
  options.config_text = "[trigger]\nevery_cycles = 20\n"
                        "[image]\nproxies = ['reference', 'field']\n";
  options.output = "heat.cdb";
  options.log = report;
  vestige_session *vestige;
  vestige_open(&options, &vestige);

  vestige_grid grid = VESTIGE_GRID_INIT;
  for (int a = 0; a < 3; ++a) {
    grid.points[a] = N;
    grid.spacing[a] = 1.0 / (N - 1);
  }
  vestige_block(vestige, 0, &grid);
  vestige_units(vestige, "temperature", "degC");

  for (int cycle = 0; cycle <= CYCLES; ++cycle) {
    double time = 0.01 * cycle;
    if (vestige_wants(vestige, cycle, time)) {
      vestige_share_field(vestige, 0, "temperature", VESTIGE_FLOAT64, VESTIGE_POINT, 1, heat, NULL);
      vestige_execute(vestige, cycle, time);
    }

    for (int z = 1; z < N - 1; ++z)
      for (int y = 1; y < N - 1; ++y)
        for (int x = 1; x < N - 1; ++x) {
          double around = heat[at(x - 1, y, z)] + heat[at(x + 1, y, z)] + heat[at(x, y - 1, z)] +
                          heat[at(x, y + 1, z)] + heat[at(x, y, z - 1)] + heat[at(x, y, z + 1)];
          next[at(x, y, z)] = heat[at(x, y, z)] + 0.05 * (around - 6.0 * heat[at(x, y, z)]);
        }
    for (int z = 1; z < N - 1; ++z)
      for (int y = 1; y < N - 1; ++y)
        for (int x = 1; x < N - 1; ++x) heat[at(x, y, z)] = next[at(x, y, z)];
  }

  int code = vestige_close(vestige);
  free(heat);
  free(next);
  return code;
}
