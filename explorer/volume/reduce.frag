#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
// One layer of a grid's mean extinction, reduced by 4 along each axis, in cells of equal width.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler3D;

#pragma axes

uniform sampler3D values;
#ifdef GAPS
uniform sampler3D mask;
#endif
uniform int layer;
uniform float scale;
#ifdef SCALAR
uniform sampler2D table;
uniform vec2 entryFromTexel;
#endif

out vec4 result;

const int kReduce = 4;

void main() {
  ivec3 low = ivec3(gl_FragCoord.xy, layer) * kReduce;
  ivec3 high = min(low + kReduce, textureSize(values, 0));
  float sum = 0.0;
  for (int z = low.z; z < high.z; ++z) {
    for (int y = low.y; y < high.y; ++y) {
      for (int x = low.x; x < high.x; ++x) {
        ivec3 cell = clamp(ivec3(textureCell(vec3(x, y, z) + 0.5)), ivec3(0),
                           textureSize(values, 0) - 1);
#ifdef GAPS
        if (texelFetch(mask, cell, 0).r < 0.5) continue;
#endif
#ifdef SCALAR
        float value = texelFetch(values, cell, 0).r;
        int count = textureSize(table, 0).x;
        int entry = clamp(int(value * entryFromTexel.x + entryFromTexel.y), 0, count - 1);
        sum += texelFetch(table, ivec2(entry, 1), 0).a;
#else
        sum += texelFetch(values, cell, 0).a;
#endif
      }
    }
  }
  ivec3 size = high - low;
  result = vec4(scale * sum / float(size.x * size.y * size.z));
}
