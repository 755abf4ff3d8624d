#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
// The three pixels between rays through every other pixel (probes): texel (x, y) has those to the
// right of probe (x, y), below it, and diagonally across, by cubics through four probes each.
precision highp float;
precision highp int;
precision highp sampler2D;

uniform sampler2D probes, probeInfo;  // of every other pixel, from pixel (0, 0)
uniform float tolerance;

layout(location = 0) out vec4 right;
layout(location = 1) out vec4 below;
layout(location = 2) out vec4 across;
layout(location = 3) out vec4 info;  // r = mean planar depth, g = share of guess, b = 1: believe it

vec4 probe(ivec2 at) {
  return texelFetch(probes, clamp(at, ivec2(0), textureSize(probes, 0) - 1), 0);
}
vec4 infoAt(ivec2 at) { return texelFetch(probeInfo, min(at, textureSize(probeInfo, 0) - 1), 0); }

float greatest(vec4 v) { return max(max(v.x, v.y), max(v.z, v.w)); }
float bend(vec4 a, vec4 b, vec4 c) { return greatest(abs(a - 2.0 * b + c)); }
vec4 middle(vec4 a, vec4 b, vec4 c, vec4 d) { return 0.5625 * (b + c) - 0.0625 * (a + d); }

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 p[16];
  for (int i = 0; i < 16; ++i) p[i] = probe(at + ivec2(i % 4 - 1, i / 4 - 1));
  // Half of the bend is less than the tolerance in both directions, everywhere around the square:
  // the midpoint of a cubic is off by a small share of it.
  float most = 0.0;
  for (int y = 0; y < 4; ++y) {
    most = max(most, max(bend(p[4 * y], p[4 * y + 1], p[4 * y + 2]),
                         bend(p[4 * y + 1], p[4 * y + 2], p[4 * y + 3])));
  }
  for (int x = 1; x < 3; ++x) {
    most = max(most, max(bend(p[x], p[x + 4], p[x + 8]), bend(p[x + 4], p[x + 8], p[x + 12])));
  }
  vec4 rows[4];
  for (int y = 0; y < 4; ++y) rows[y] = middle(p[4 * y], p[4 * y + 1], p[4 * y + 2], p[4 * y + 3]);
  right = clamp(rows[1], 0.0, 1.0);
  below = clamp(middle(p[1], p[5], p[9], p[13]), 0.0, 1.0);
  across = clamp(middle(rows[0], rows[1], rows[2], rows[3]), 0.0, 1.0);
  vec4 i00 = infoAt(at), i10 = infoAt(at + ivec2(1, 0));
  vec4 i01 = infoAt(at + ivec2(0, 1)), i11 = infoAt(at + ivec2(1, 1));
  vec4 depths = vec4(i00.r, i10.r, i01.r, i11.r);
  // Rays that see nothing have no depth: four that do, or four that do not.
  float seen = dot(vec4(lessThan(depths, vec4(1e29))), vec4(1.0));
  vec4 guesses = vec4(i00.g, i10.g, i01.g, i11.g);
  bool alike = greatest(guesses) + greatest(-guesses) < 0.02 && (seen == 0.0 || seen == 4.0);
  info = 0.25 * (i00 + i10 + i01 + i11);
  info.b = most <= tolerance && alike ? 1.0 : 0.0;
}
