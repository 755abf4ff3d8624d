#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
// One layer of a grid's gradients, a change a cell along each axis, and their length: central
// differences of values or of extinction, one-sided at the border (method §1). They are
// interpolated before they are brought to length 1, so normals are continuous from cell to cell.
// Zero where the slope is too flat to tell.
precision highp float;
precision highp int;
precision highp sampler3D;

uniform sampler3D values;
uniform int layer;
uniform float flatSlope;  // values: a slope a cell; optics: as a share of the extinction

out vec4 result;

float valueAt(ivec3 cell) {
#ifdef SCALAR
  return texelFetch(values, cell, 0).r;
#else
  return texelFetch(values, cell, 0).a;
#endif
}

void main() {
  ivec3 cell = ivec3(gl_FragCoord.xy, layer), last = textureSize(values, 0) - 1;
  ivec3 low = max(cell - 1, 0), high = min(cell + 1, last);
  vec3 before = vec3(valueAt(ivec3(low.x, cell.yz)), valueAt(ivec3(cell.x, low.y, cell.z)),
                     valueAt(ivec3(cell.xy, low.z)));
  vec3 after = vec3(valueAt(ivec3(high.x, cell.yz)), valueAt(ivec3(cell.x, high.y, cell.z)),
                    valueAt(ivec3(cell.xy, high.z)));
  vec3 slope = (after - before) / vec3(max(high - low, 1));
  float steepest = max(abs(slope.x), max(abs(slope.y), abs(slope.z)));
#ifdef SCALAR
  float least = flatSlope;
#else
  float least = flatSlope * max(max(before.x, max(before.y, before.z)),
                                max(after.x, max(after.y, after.z)));
#endif
  // Slopes to cells without data are as steep as 1e29.
  bool known = steepest > least && steepest < 1e20;
  result = known ? vec4(slope, length(slope)) : vec4(0.0);
}
