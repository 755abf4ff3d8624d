// SPDX-License-Identifier: BSD-3-Clause
// The base transfer function along segments on which the value is linear. Its extinction is
// piecewise linear in cells of a table, so optical depth is exact for that table however a segment
// is cut: depth between values f0 and f1 = length * (S(f1) - S(f0)) / (f1 - f0), S = ∫ extinction.

uniform sampler2D base;   // row 0: S, extinction * cell, half its rise; rows 1, 2: ∫ extinction *
                          // colour, and colour, at the start of the cell
uniform vec3 baseRange;   // first value, cells / length, cells

struct Base {
  float integral;  // S
  float extinction;
};

// The cell of a value and how far into it; x.z: how far beyond the table, in cells.
vec3 baseCellAt(float f) {
  float x = ((f > kGapEdge ? 0.0 : f) - baseRange.x) * baseRange.y;
  float inside = clamp(x, 0.0, baseRange.z);
  float cell = min(floor(inside), baseRange.z - 1.0);
  return vec3(cell, inside - cell, x - inside);
}

Base baseAt(float f) {
  vec3 x = baseCellAt(f);
  vec4 t = texelFetch(base, ivec2(int(x.x), 0), 0);
  float slope = t.y + 2.0 * x.y * t.z;
  return Base(t.x + x.y * (t.y + x.y * t.z) + x.z * slope, slope * baseRange.y);
}

// Mean extinction of a segment.
float meanExtinction(float f0, float f1, Base b0, Base b1) {
  float rise = f1 - f0;
  float mean = abs(rise) > 1e-3 ? (b1.integral - b0.integral) / rise
                                : 0.5 * (b0.extinction + b1.extinction);
  return max(f0, f1) > kGapEdge ? 0.0 : max(mean, 0.0);
}

#ifdef REFERENCE
vec3 baseRow(int row, float f) {
  vec3 x = baseCellAt(f);
  vec3 a = texelFetch(base, ivec2(int(x.x), row), 0).rgb;
  vec3 b = texelFetch(base, ivec2(int(x.x) + 1, row), 0).rgb;
  return mix(a, b, x.y);
}

// Extinction-weighted mean colour of a segment.
vec3 meanColor(float f0, float f1, float integral0, float integral1) {
  float weight = integral1 - integral0;
  bool inside = min(f0, f1) >= baseRange.x && max(f0, f1) <= baseRange.x + baseRange.z / baseRange.y;
  if (inside && abs(f1 - f0) > 4.0 / baseRange.y && abs(weight) > 1e-5) {
    return clamp((baseRow(1, f1) - baseRow(1, f0)) / weight, 0.0, 1.0);
  }
  return baseRow(2, 0.5 * (f0 + f1));
}
#endif
