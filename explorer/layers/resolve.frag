#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
// Composites warped layers front to back in each pixel's own order of depth.
precision highp float;
precision highp int;
precision highp sampler2DArray;

uniform sampler2DArray colors;     // premultiplied
uniform sampler2DArray positions;  // warp.frag; r > 1e29 = nothing
uniform int layers;

layout(location = 0) out vec4 color;
layout(location = 1) out vec4 info;  // r = nearest sampled Z, g = share of a guess

const int kMaxLayers = 64;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float order[kMaxLayers];
  int which[kMaxLayers];
  int count = 0;
  for (int i = 0; i < layers; ++i) {
    float z = texelFetch(positions, ivec3(pixel, i), 0).r;
    if (z > 1e29) continue;
    int j = count;
    for (; j > 0 && order[j - 1] > z; --j) {
      order[j] = order[j - 1];
      which[j] = which[j - 1];
    }
    order[j] = z;
    which[j] = i;
    ++count;
  }
  vec4 sum = vec4(0.0);
  float nearest = 1e30, guess = 0.0;
  for (int i = 0; i < count; ++i) {
    vec4 value = texelFetch(colors, ivec3(pixel, which[i]), 0);
    vec4 position = texelFetch(positions, ivec3(pixel, which[i]), 0);
    float left = 1.0 - sum.a;
    guess = min(guess + left * position.b, 1.0);
    if (position.g < 0.5 && value.a > 0.0) nearest = min(nearest, order[i]);
    sum += left * value;
  }
  color = sum;
  info = vec4(nearest, guess, 0.0, 1.0);
}
