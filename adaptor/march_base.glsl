// SPDX-License-Identifier: BSD-3-Clause
// The base transfer function along segments on which the value is linear. Its extinction is
// piecewise linear in cells of a table, so optical depth is exact for that table however a segment
// is cut: depth between values f0 and f1 = length * (S(f1) - S(f0)) / (f1 - f0), S = ∫ extinction.

uniform samplerBuffer base;  // per cell: S, extinction * cell, half its rise (in units of S)
uniform vec2 baseCells;      // cells / value, and the cell of value 0; cell 0 and the last one go on
uniform float baseLast;      // for ever with constant extinction

struct Base {
  float integral;  // S
  float extinction;
};

Base baseAt(float f) {
  float x = f * baseCells.x + baseCells.y;
#ifdef GAPS
  x = f < kGapEdge ? x : 0.0;
#endif
  int cell = int(clamp(x, 0.0, baseLast));
  float u = x - float(cell);
  vec4 t = texelFetch(base, cell);
  return Base(t.x + u * (t.y + u * t.z), (t.y + 2.0 * u * t.z) * baseCells.x);
}

// Mean extinction of a segment.
float meanExtinction(float f0, float f1, Base b0, Base b1) {
  float rise = f1 - f0;
  float mean = abs(rise) > 1e-3 ? (b1.integral - b0.integral) / rise
                                : 0.5 * (b0.extinction + b1.extinction);
#ifdef GAPS
  mean = max(f0, f1) < kGapEdge ? mean : 0.0;
#endif
  return mean;
}

#ifdef REFERENCE
uniform samplerBuffer baseColor;  // two texels a cell, at its start: ∫ extinction * colour, colour

vec3 baseColorAt(int row, float f) {
  float x = f * baseCells.x + baseCells.y;
  int cell = int(clamp(x, 0.0, baseLast - 1.0));
  return mix(texelFetch(baseColor, 2 * cell + row).rgb, texelFetch(baseColor, 2 * cell + 2 + row).rgb,
             clamp(x - float(cell), 0.0, 1.0));
}

// Extinction-weighted mean colour of a segment.
vec3 meanColor(float f0, float f1) {
  float weight = baseAt(f1).integral - baseAt(f0).integral;
  vec2 x = vec2(f0, f1) * baseCells.x + baseCells.y;
  bool inside = min(x.x, x.y) >= 1.0 && max(x.x, x.y) <= baseLast;
  if (inside && abs(x.y - x.x) > 4.0 && abs(weight) > 1e-5) {
    return clamp((baseColorAt(0, f1) - baseColorAt(0, f0)) / weight, 0.0, 1.0);
  }
  return baseColorAt(1, 0.5 * (f0 + f1));
}
#endif
