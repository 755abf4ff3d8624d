// SPDX-License-Identifier: BSD-3-Clause
// The base transfer function along segments on which the value is linear. Its extinction is linear
// in pieces (PreintegratedTable), so optical depth is exact for that table however a segment is cut: depth
// between values f0 and f1 = length * (S(f1) - S(f0)) / (f1 - f0), S = ∫ extinction.

uniform samplerBuffer base;  // per cell: S, extinction * cell, half its rise; PIECES: the next or 0
uniform vec2 baseCells;      // cells / value, and the cell of value 0; cell 0 and the last one go on
uniform float baseLast;      // for ever with constant extinction

#ifdef REFERENCE
uniform samplerBuffer baseColor;  // two texels a cell, at its start: ∫ extinction * colour and S,
uniform float baseColorRate;      // colour; the greatest change of colour in a cell
#endif

#ifdef CUSTOM
// Position-dependent classification (classification §6): what a sample's value and a step's optics become at
// their place. Values are those of the partition's range.
uniform sampler3D customOptics;  // factor of extinction, shift of colour
uniform vec3 customFromLocal, customOrigin;
vec3 customShift = vec3(0.0);  // of the step whose colour is asked for

vec3 customPlace(vec3 local) { return local * customFromLocal + customOrigin; }
#ifdef CUSTOM_VALUES
uniform sampler3D customValues;  // gamma
float customValue(float f, vec3 local) {
  float gamma = texture(customValues, customPlace(local)).r;
  return gamma != 1.0 && f > 0.0 && f < 1.0 ? pow(f, gamma) : f;
}
#define VALUE(f, z) customValue(f, origin + (z) * direction)
#else
#define VALUE(f, z) (f)
#endif
#define FACTOR(z) texture(customOptics, customPlace(origin + (z) * direction)).r *
#define SHIFT(z) customShift = texture(customOptics, customPlace(origin + (z) * direction)).gba;
#else
#define VALUE(f, z) (f)
#define FACTOR(z)
#define SHIFT(z)
#endif

struct Base {
  float integral;     // S
  float extinction;
  float x;            // in cells
  float start, part;  // S = start + part; differences of starts are exact
#ifdef REFERENCE
  vec3 emission;  // ∫ extinction * colour
  vec3 color;
#endif
};

Base baseAt(float f) {
  float x = f * baseCells.x + baseCells.y;
#ifdef GAPS
  x = f < kGapEdge ? x : 0.0;
#endif
  int cell = int(clamp(x, 0.0, baseLast));
  float u = x - float(cell);
  vec4 t = texelFetch(base, cell);
#ifdef PIECES
  // On to the piece of the cell that holds x.
  float from = 0.0;
  for (int further = int(t.w); further > 0;) {
    vec2 piece = texelFetch(base, further).xy;
    if (u < piece.x) break;
    from = piece.x;
    t = texelFetch(base, further + 1);
    further = int(piece.y);
  }
  u -= from;
#endif
  float part = u * (t.y + u * t.z);
  float extinction = (t.y + 2.0 * u * t.z) * baseCells.x;
#ifdef REFERENCE
  vec4 emission = texelFetch(baseColor, 2 * cell);
  vec3 first = texelFetch(baseColor, 2 * cell + 1).rgb, next = texelFetch(baseColor, 2 * cell + 3).rgb;
  vec3 color = mix(first, next, clamp(x - float(cell), 0.0, 1.0));
  // What the cell has emitted so far has the colour halfway.
  emission.rgb += ((t.x - emission.w) + part) * 0.5 * (first + color);
  return Base(t.x + part, extinction, x, t.x, part, emission.rgb, color);
#else
  return Base(t.x + part, extinction, x, t.x, part);
#endif
}

float integralBetween(Base b0, Base b1) { return (b1.start - b0.start) + (b1.part - b0.part); }

// Mean extinction of a segment. The rise is that of the table's argument, which is rounded.
float meanExtinction(float f0, float f1, Base b0, Base b1) {
  float rise = b1.x - b0.x;
  float mean = abs(rise) > 0.01 ? integralBetween(b0, b1) / rise * baseCells.x
                                : 0.5 * (b0.extinction + b1.extinction);
#ifdef GAPS
  // Half a step each.
  if (isGap(max(f0, f1)))
    mean = 0.5 * ((isGap(f0) ? 0.0 : b0.extinction) + (isGap(f1) ? 0.0 : b1.extinction));
#endif
  return mean;
}

// Mean extinction of a step up to a share of it, where the base function is `b`.
float meanUpTo(float share, float f0, float f1, Base b0, Base b) {
#ifdef GAPS
  if (isGap(f0) != isGap(f1)) {
    float part = max(share, 1e-6);
    return isGap(f1) ? b0.extinction * min(0.5 / part, 1.0)
                     : b.extinction * max(part - 0.5, 0.0) / part;
  }
#endif
  return meanExtinction(f0, between(f0, f1, share), b0, b);
}

// The base function at the ends of what has data in a step.
Base baseAtStart(float f0, Base b0, Base b1) {
#ifdef GAPS
  if (isGap(f0)) return b1;
#endif
  return b0;
}
Base baseAtEnd(float f1, Base b0, Base b1) {
#ifdef GAPS
  if (isGap(f1)) return b0;
#endif
  return b1;
}

#ifdef REFERENCE
// Extinction-weighted mean colour of a segment.
vec3 meanColor(Base b0, Base b1) {
  float weight = integralBetween(b0, b1);
  bool known = abs(b1.x - b0.x) > 2.0 && abs(weight) > 1e-5;
  vec3 color =
      known ? clamp((b1.emission - b0.emission) / weight, 0.0, 1.0) : 0.5 * (b0.color + b1.color);
#ifdef CUSTOM
  color = clamp(color + customShift, 0.0, 1.0);
#endif
  return color;
}

// The light ∫ c σ T of a segment whose optical depth goes from tau0 to tau1, as far as that is in
// [0, tauEnd]. A part of it has its mean colour, which is wrong by a twelfth of its optical depth
// times its change of colour: parts keep that below 1/700. They are those of the whole segment even
// where only some of it counts, so that blocks add up.
float segmentParts(Base b0, Base b1, float tau0, float tau1) {
  float change = min(baseColorRate * abs(b1.x - b0.x), 1.5);
  return tau0 < 9.0 ? floor(clamp(sqrt(60.0 * (tau1 - tau0) * change), 0.0, 15.0)) + 1.0 : 1.0;
}

vec3 segmentLight(float f0, float f1, float tau0, float tau1, float tauEnd) {
#ifdef GAPS
  float known = min(f0, f1);
  f0 = isGap(f0) ? known : f0;
  f1 = isGap(f1) ? known : f1;
#endif
  Base b0 = baseAt(f0), b1 = baseAt(f1), a = b0;
  float parts = segmentParts(b0, b1, tau0, tau1), weight = integralBetween(b0, b1);
  float front = exp(-max(tau0, 0.0)), i = 0.0;
  vec3 light = vec3(0.0);
  do {
    i += 1.0;
    float share = min(i / parts, 1.0);
    Base b = baseAt(share < 1.0 ? mix(f0, f1, share) : f1);
    share = share < 1.0 && abs(weight) > 0.0 ? integralBetween(b0, b) / weight : share;
    float back = exp(-clamp(share < 1.0 ? tau0 + (tau1 - tau0) * share : tau1, 0.0, tauEnd));
    light += (front - back) * meanColor(a, b);
    front = back;
    a = b;
  } while (i < parts);
  return light;
}
#endif
