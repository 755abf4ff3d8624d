#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
// Colour from attenuation [Tikhonova 2010, §6.2]: the cluster whose centroid is nearest to
// the pixel's attenuation (eq. 10), then that cluster's affine map (eq. 8). ENHANCED darkens by
// depth-aware enhancement (eq. 11).
precision highp float;
precision highp int;
precision highp sampler2DArray;
precision highp sampler2D;

const int kMostGroups = 17;          // of 67 channels

uniform sampler2DArray attenuation;  // [group] a_k of channels 4 group .. 4 group + 3
uniform sampler2D table;             // [cluster] row: groups of a0, of J's r, g, b; then colour
uniform int groups;
uniform int clusters;
#ifdef ENHANCED
uniform sampler2D enhancement;       // r of eq. 11 in [0, 1]
#endif

out vec4 result;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 own[kMostGroups];
  float opacity = 0.0;
  for (int g = 0; g < groups; ++g) {
    own[g] = texelFetch(attenuation, ivec3(pixel, g), 0);
    opacity += dot(own[g], vec4(1.0));
  }
  if (opacity <= 0.0) {
    result = vec4(0.0);
    return;
  }
  int best = 0;
  float least = 1e30;
  for (int k = 0; k < clusters; ++k) {
    float distance = 0.0;
    for (int g = 0; g < groups; ++g) {
      vec4 off = own[g] - texelFetch(table, ivec2(g, k), 0);
      distance += dot(off, off);
    }
    if (distance < least) {
      least = distance;
      best = k;
    }
  }
  vec3 color = texelFetch(table, ivec2(4 * groups, best), 0).rgb;
  for (int g = 0; g < groups; ++g) {
    vec4 off = own[g] - texelFetch(table, ivec2(g, best), 0);
    color += vec3(dot(texelFetch(table, ivec2(groups + g, best), 0), off),
                  dot(texelFetch(table, ivec2(2 * groups + g, best), 0), off),
                  dot(texelFetch(table, ivec2(3 * groups + g, best), 0), off));
  }
#ifdef ENHANCED
  color *= 1.0 - texelFetch(enhancement, pixel, 0).r;
#endif
  result = vec4(max(color, vec3(0.0)), min(opacity, 1.0));
}
