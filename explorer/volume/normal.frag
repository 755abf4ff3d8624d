#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
// One layer of a grid's gradients, a change a cell of equal width along each axis, and their length:
// central differences of values or of extinction, one-sided at the border and beside cells without
// data (method §1). They are
// interpolated before they are brought to length 1, so normals are continuous from cell to cell.
// Zero where the slope is too flat to tell.
precision highp float;
precision highp int;
precision highp sampler3D;

#pragma axes

uniform sampler3D values;
#ifdef GAPS
uniform sampler3D mask;
#endif
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

#ifdef GAPS
bool hasData(ivec3 cell) { return texelFetch(mask, cell, 0).r > 0.5; }
#endif

void main() {
  ivec3 cell = ivec3(gl_FragCoord.xy, layer), last = textureSize(values, 0) - 1;
  ivec3 low = max(cell - 1, 0), high = min(cell + 1, last);
#ifdef GAPS
  result = vec4(0.0);
  if (!hasData(cell)) return;
  if (!hasData(ivec3(low.x, cell.yz))) low.x = cell.x;
  if (!hasData(ivec3(cell.x, low.y, cell.z))) low.y = cell.y;
  if (!hasData(ivec3(cell.xy, low.z))) low.z = cell.z;
  if (!hasData(ivec3(high.x, cell.yz))) high.x = cell.x;
  if (!hasData(ivec3(cell.x, high.y, cell.z))) high.y = cell.y;
  if (!hasData(ivec3(cell.xy, high.z))) high.z = cell.z;
#endif
  vec3 before = vec3(valueAt(ivec3(low.x, cell.yz)), valueAt(ivec3(cell.x, low.y, cell.z)),
                     valueAt(ivec3(cell.xy, low.z)));
  vec3 after = vec3(valueAt(ivec3(high.x, cell.yz)), valueAt(ivec3(cell.x, high.y, cell.z)),
                    valueAt(ivec3(cell.xy, high.z)));
  vec3 run = placeOfTexture(vec3(high) + 0.5) - placeOfTexture(vec3(low) + 0.5);
  vec3 slope = (after - before) / max(run, 1e-12) * vec3(greaterThan(high, low));
  float steepest = max(abs(slope.x), max(abs(slope.y), abs(slope.z)));
#ifdef SCALAR
  float least = flatSlope;
#else
  float least = flatSlope * max(max(before.x, max(before.y, before.z)),
                                max(after.x, max(after.y, after.z)));
#endif
  bool known = steepest > least;
  result = known ? vec4(slope, length(slope)) : vec4(0.0);
}
