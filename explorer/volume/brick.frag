#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
// One pixel a brick of an optics grid: whether any cell that weighs in it has extinction.
precision highp float;
precision highp int;
precision highp sampler3D;

uniform sampler3D values;
uniform int layer;  // of bricks

out vec4 result;

const int kBrick = 8;

void main() {
  ivec3 brick = ivec3(gl_FragCoord.xy, layer);
  ivec3 low = max(brick * kBrick - 1, 0);
  ivec3 high = min(brick * kBrick + kBrick + 1, textureSize(values, 0));
  float most = 0.0;
  for (int z = low.z; z < high.z && most == 0.0; ++z) {
    for (int y = low.y; y < high.y; ++y) {
      for (int x = low.x; x < high.x; ++x) most = max(most, texelFetch(values, ivec3(x, y, z), 0).a);
    }
  }
  result = vec4(most > 0.0 ? 1.0 : 0.0);
}
