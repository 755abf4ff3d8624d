#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
// Ray casting of a 3-D grid (method §1). A point of the pixel's ray is `start + z * along` in cells
// of the grid, z = planar depth from the depth of the medium's centre; samples stand at whole
// multiples of `stepDepth`, and the first and the last step are cut at the medium's faces.
// VolumePass defines SCALAR (values and a table, else optics), FIELDS (up to four values and a
// classifier of CHANNELS channels and PARAMETERS parameters, with GRADIENT if it wants one),
// MAXIMUM, ISOSURFACE, SLICE, LIT, OPEN (ambient occlusion), GUESS, SKIP, CUSTOM, CUSTOM_VALUES,
// BLENDS (count) and DOUBT (values moved as far as they may be wrong; these three of SCALAR only),
// GAPS (values are missing) and what axes.glsl wants.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler3D;
precision highp usampler3D;

uniform sampler3D values;
uniform vec3 cells;              // of the grid
uniform vec3 texelFromCell;      // 1 / cells
uniform vec3 start[3], along[3]; // at pixel (0, 0), and their change a pixel in x and y
uniform float pixelStep;         // pixels a texel of the target: 2 for probes
uniform vec4 tangent;            // of the ray's angle at pixel (0, 0), and its change a pixel
uniform vec3 low, high;          // of the medium, in cells
uniform float nearest;           // least z
uniform vec3 clipLow, clipHigh;  // in clip coordinates, clipFromCell * point
uniform mat4 clipFromCell;
uniform float stepDepth;
uniform float opaque;
uniform float scale;             // optics: extinction of a texel of 1
uniform float depthOrigin;       // planar depth where z = 0
#ifdef GAPS
uniform sampler3D mask;          // 1 where a cell has data; values are 0 where it has none
#endif
#ifdef UNEVEN
uniform float stepCells;         // longest step, in cells
#endif
#ifdef SKIP
uniform usampler3D leaps;
uniform ivec3 lastBrick;
#endif
#ifdef SCALAR
uniform sampler2D table;         // row 0: integral up to an entry, row 1: mean over it
uniform vec2 entryFromTexel;     // entry = texel * x + y
#endif
#ifdef FIELDS
uniform vec4 parameters[PARAMETERS];
uniform vec4 channelOptics[CHANNELS];  // σ c, σ of a weight of 1
#ifdef GRADIENT
uniform sampler3D gradients;
#endif
#endif
#ifdef ISOSURFACE
uniform int surfaces;
uniform float isovalues[8];      // as texels, rising
uniform vec4 surfaceColors[8];   // linear RGB, opacity
#endif
#ifdef SLICE
uniform vec4 plane;              // in cells
uniform float thickness;         // world length of its opacity
#endif
#ifdef LIT
uniform mat3 eyeFromGradient;    // gradient along cells to eye space
#ifndef ISOSURFACE
uniform sampler3D gradient;      // normal.frag
#endif
uniform int lights;
uniform vec4 lightFrom[8];       // unit direction to the light in eye space, intensity
uniform vec4 material;           // ambient, diffuse, specular, shininess
#endif
#ifdef OPEN
uniform sampler3D open;
uniform float openStrength;
#endif
#ifdef GUESS
uniform sampler3D guess;
#endif

#ifdef CUSTOM
// Position-dependent classification (classification §6): parameters at a place, applied to its value and to
// its optics.
uniform mat4 customFromCell;     // to texture coordinates
uniform sampler3D customOptics;  // factor of extinction, shift of colour
#ifdef CUSTOM_VALUES
uniform sampler3D customValues;  // gamma, shares of functions
uniform vec2 rangeFromTexel;     // share of the range of values = texel * x + y
#endif
#if BLENDS > 0
uniform sampler2D blend0, blend1, blend2;  // tables as above
#endif
#endif

layout(location = 0) out vec4 color;
layout(location = 1) out vec4 info;  // r = mean planar depth, g = share of guess (ProbedRays)

const int kBrick = 8, kRun = 4;
const float kNoValue = -1e30, kNoValueEdge = -1e20, kFar = 1e30;

#pragma axes

// Trilinear between cells with data, which weigh by their shares; none where the nearest has none
// (method §1).
vec4 texelIn(vec3 cell) {
  vec3 at = cell * texelFromCell;
  vec4 texel = texture(values, at);
#ifdef GAPS
  ivec3 nearest = clamp(ivec3(floor(cell)), ivec3(0), textureSize(mask, 0) - 1);
  if (texelFetch(mask, nearest, 0).r < 0.5) return vec4(kNoValue);
  texel /= texture(mask, at).r;
#endif
  return texel;
}
vec4 texelAt(vec3 cell) { return texelIn(textureCell(cell)); }

#ifdef SCALAR
#ifdef DOUBT
uniform sampler3D wrong;         // how far values may be wrong, in `doubt`
uniform float doubt;             // in texels, either sign

float valueAt(vec3 cell) {
  return texelAt(cell).r + doubt * texture(wrong, textureCell(cell) * texelFromCell).r;
}
#else
float valueAt(vec3 cell) { return texelAt(cell).r; }
#endif
bool known(float value) { return value > kNoValueEdge; }

float entryOf(float value) {
  return clamp(value * entryFromTexel.x + entryFromTexel.y, 0.0, float(textureSize(table, 0).x - 1));
}

vec4 meanAt(float value) { return texelFetch(table, ivec2(int(entryOf(value)), 1), 0); }

struct Entry {
  float x;
  vec4 integral;
};

// The entry at a value: an even or an odd one by turns along a ray, so that two in turn differ and
// the mean between them takes no more than their integrals.
Entry entryAt(float value, float odd) {
  float x = 2.0 * floor(0.5 * entryOf(value)) + odd;
  return Entry(x, texelFetch(table, ivec2(int(x), 0), 0));
}

// Mean optics of a stretch along which the value is linear.
vec4 meanBetween(Entry a, Entry b) { return (b.integral - a.integral) / (b.x - a.x); }

#ifdef LIT
// The share of the way along such a stretch, of optical depth tau, from where its light comes on
// the mean: where a surface stands within a step is what its normal turns on.
float lightPlace(Entry a, Entry b, float tau) {
  float middle = texelFetch(table, ivec2(int(0.5 * (a.x + b.x)), 0), 0).a;
  float whole = b.integral.a - a.integral.a;
  float front = tau * (whole == 0.0 ? 0.5 : clamp((middle - a.integral.a) / whole, 0.0, 1.0));
  float near = 1.0 - exp(-front), both = 1.0 - exp(-tau);
  return 0.25 + 0.5 * clamp((both - near) / max(both, 1e-6), 0.0, 1.0);
}
#endif
#endif

#ifdef FIELDS
#pragma classifier

struct Sample {
  vec4 values;
  float gradient;
};

bool known(Sample a) { return a.values.x > kNoValueEdge; }

Sample sampleAt(vec3 cell) {
  Sample result = Sample(texelAt(cell), 0.0);
#ifdef GRADIENT
  vec3 at = textureCell(cell) * texelFromCell;
  result.gradient = texture(gradients, at).r;
#ifdef GAPS
  result.gradient /= max(texture(mask, at).r, 1e-6);
#endif
#endif
  return result;
}

// Mean optics of a stretch along which all values are linear.
vec4 opticsBetween(Sample a, Sample b) {
  if (!known(a) || !known(b)) return vec4(0.0);
  float weights[CHANNELS];
  classify(a.values, b.values, a.gradient, b.gradient, weights);
  vec4 optics = vec4(0.0);
  for (int i = 0; i < CHANNELS; ++i) optics += weights[i] * channelOptics[i];
  return optics;
}
#endif

#ifdef CUSTOM
vec3 customPlace(vec3 cell) { return (customFromCell * vec4(cell, 1.0)).xyz; }

float customValue(float value, vec3 cell) {
#ifdef CUSTOM_VALUES
  float f = value * rangeFromTexel.x + rangeFromTexel.y;
  float gamma = texture(customValues, customPlace(cell)).r;
  if (gamma != 1.0 && f > 0.0 && f < 1.0) {
    value = (pow(f, gamma) - rangeFromTexel.y) / rangeFromTexel.x;
  }
#endif
  return value;
}

#if BLENDS > 0
// Mean optics of a function between two entries, or of one entry.
vec4 blendBetween(sampler2D blend, float x0, float x1) {
  if (x0 == x1) return texelFetch(blend, ivec2(int(x0), 1), 0);
  return (texelFetch(blend, ivec2(int(x1), 0), 0) - texelFetch(blend, ivec2(int(x0), 0), 0)) /
         (x1 - x0);
}
#endif

vec4 customFunction(vec4 optics, float x0, float x1, vec3 cell) {
#if BLENDS > 0
  vec3 shares = texture(customValues, customPlace(cell)).gba;
  float share = shares.x + shares.y + shares.z;
  if (share > 0.0) {
    optics *= 1.0 - share;
    optics += shares.x * blendBetween(blend0, x0, x1);
#if BLENDS > 1
    optics += shares.y * blendBetween(blend1, x0, x1);
#endif
#if BLENDS > 2
    optics += shares.z * blendBetween(blend2, x0, x1);
#endif
  }
#endif
  return optics;
}

// (σ c, σ), or a colour and its opacity.
vec4 customLook(vec4 optics, vec3 cell) {
  vec4 custom = texture(customOptics, customPlace(cell));
  if (optics.a > 0.0 && custom.gba != vec3(0.0)) {
    optics.rgb = clamp(optics.rgb / optics.a + custom.gba, 0.0, 1.0) * optics.a;
  }
  return optics * custom.r;
}
#define CUSTOM_VALUE(value, cell) customValue(value, cell)
#define CUSTOM_FUNCTION(optics, x0, x1, cell) customFunction(optics, x0, x1, cell)
#define CUSTOM_LOOK(optics, cell) customLook(optics, cell)
#else
#define CUSTOM_VALUE(value, cell) (value)
#define CUSTOM_FUNCTION(optics, x0, x1, cell) (optics)
#define CUSTOM_LOOK(optics, cell) (optics)
#endif

// Where the ray is between two faces of a box, cut from `span`.
void cut(inout vec2 span, vec3 from, vec3 way, vec3 boxLow, vec3 boxHigh) {
  for (int axis = 0; axis < 3; ++axis) {
    float o = from[axis], d = way[axis];
    if (abs(d) < 1e-12) {
      if (o < boxLow[axis] || o > boxHigh[axis]) span.y = span.x - 1.0;
      continue;
    }
    float a = (boxLow[axis] - o) / d, b = (boxHigh[axis] - o) / d;
    span = vec2(max(span.x, min(a, b)), min(span.y, max(a, b)));
  }
}

#ifdef SCALAR
// Surfaces are where the field itself has a value.
#ifdef ISOSURFACE
#define VALUE_AT(cell) valueAt(cell)
#else
#define VALUE_AT(cell) CUSTOM_VALUE(valueAt(cell), cell)
#endif

// The colour of what is shown at opacity 1.
vec3 colorAt(vec4 optics, vec3 cell) {
#ifdef CUSTOM
  return clamp(optics.rgb + texture(customOptics, customPlace(cell)).gba, 0.0, 1.0);
#else
  return optics.rgb;
#endif
}
#endif

#ifdef LIT
// The normal in eye space, of either side; as long as 1 where it is sure, shorter the more the
// gradients of the cells around it cancel out.
vec3 normalAt(vec3 cell) {
#ifdef ISOSURFACE
  vec3 x = clamp(textureCell(cell), vec3(0.5), cells - 0.5);
  vec3 a = max(x - 1.0, 0.5), b = min(x + 1.0, cells - 0.5);
  vec3 before = vec3(texelIn(vec3(a.x, x.yz)).r, texelIn(vec3(x.x, a.y, x.z)).r,
                     texelIn(vec3(x.xy, a.z)).r);
  vec3 after = vec3(texelIn(vec3(b.x, x.yz)).r, texelIn(vec3(x.x, b.y, x.z)).r,
                    texelIn(vec3(x.xy, b.z)).r);
#ifdef GAPS
  // One-sided beside what has no data.
  vec3 here = vec3(texelIn(x).r);
  vec3 noBefore = vec3(lessThan(before, vec3(kNoValueEdge)));
  vec3 noAfter = vec3(lessThan(after, vec3(kNoValueEdge)));
  before = mix(before, here, noBefore);
  after = mix(after, here, noAfter);
  a = mix(a, x, noBefore);
  b = mix(b, x, noAfter);
#endif
  vec3 run = placeOfTexture(b) - placeOfTexture(a);
  vec3 slope = (after - before) / max(run, 1e-12) * vec3(greaterThan(run, vec3(0.0)));
  float sure = 1.0;
#else
  vec4 mean = texture(gradient, textureCell(cell) * texelFromCell);
  vec3 slope = mean.xyz;
  float sure = mean.w > 0.0 ? length(slope) / mean.w : 0.0;
#endif
  vec3 n = eyeFromGradient * slope;
  float steepness = length(n);
  return steepness > 0.0 && steepness < 1e20 ? n * (sure / steepness) : vec3(0.0);
}

// Blinn-Phong, the normal turned to the viewer: light on the own colour, and white. Where no normal
// is known, or neighbours' disagree, the full light falls.
vec2 shade(vec3 cell, vec3 toViewer) {
  vec3 n = normalAt(cell);
  float sure = length(n);
  vec2 full = vec2(material.x + material.y, 0.0);
  if (sure < 0.1) return full;
  n /= sure;
  if (dot(n, toViewer) < 0.0) n = -n;
  float diffuse = 0.0, white = 0.0;
  for (int i = 0; i < lights; ++i) {
    vec3 toLight = lightFrom[i].xyz;
    float facing = max(dot(n, toLight), 0.0);
    diffuse += lightFrom[i].w * facing;
    vec3 halfway = normalize(toLight + toViewer);
    if (facing > 0.0) white += lightFrom[i].w * pow(max(dot(n, halfway), 0.0), material.w);
  }
  return mix(full, vec2(material.x + material.y * diffuse, material.z * white),
             smoothstep(0.1, 0.5, sure));
}
#endif

// What light makes of `emission` of opacity `alpha`, both of one step.
vec3 lit(vec3 emission, float alpha, vec3 cell, vec3 toViewer) {
#ifdef LIT
  vec2 light = alpha > 1e-3 ? shade(cell, toViewer) : vec2(material.x + material.y, 0.0);
  emission = emission * light.x + alpha * light.y;
#endif
#ifdef OPEN
  emission *= 1.0 - openStrength * (1.0 - texture(open, cell * texelFromCell).r);
#endif
  return emission;
}

#ifdef SKIP
// Of a face between texture cells; those beyond the grid are far away.
vec3 facePlace(vec3 cell) {
#ifdef UNEVEN
  vec3 place = placeOfTexture(cell);
  place = mix(place, vec3(-kFar), vec3(lessThan(cell, vec3(0.5))));
  return mix(place, vec3(kFar), vec3(greaterThan(cell, cells - 0.5)));
#else
  return cell;
#endif
}
#endif

// The end of the step that begins at k steps, in steps. Steps over wide cells are 2, 4, 8, ...
// times as long, and begin at multiples of that, so that they are at the same depths on all rays.
float stepEnd(float k, vec3 cell, vec3 way) {
#ifdef UNEVEN
  vec3 room = vec3(1.0);
#ifdef AXIS_X
  room.x = roomAlong(0, cell.x);
#endif
#ifdef AXIS_Y
  room.y = roomAlong(1, cell.y);
#endif
#ifdef AXIS_Z
  room.z = roomAlong(2, cell.z);
#endif
  vec3 depths = room / max(abs(way), 1e-12);
  float steps = stepCells * min(depths.x, min(depths.y, depths.z)) / stepDepth;
  steps = exp2(floor(log2(max(steps, 1.0) * 1.0001)));
  return (floor(k / steps) + 1.0) * steps;
#else
  return k + 1.0;
#endif
}

void main() {
  vec2 pixel = (gl_FragCoord.xy - 0.5) * pixelStep + 0.5;
  vec3 from = start[0] + pixel.x * start[1] + pixel.y * start[2];
  vec3 way = along[0] + pixel.x * along[1] + pixel.y * along[2];
  vec2 angle = tangent.xy + pixel * tangent.zw;
  float rate = sqrt(1.0 + dot(angle, angle));  // length of ray a depth
  vec3 toViewer = vec3(-angle, 1.0) / rate;
  vec2 span = vec2(nearest, kFar);
  cut(span, from, way, low, high);
  cut(span, (clipFromCell * vec4(from, 1.0)).xyz, mat3(clipFromCell) * way, clipLow, clipHigh);
  color = vec4(0.0);
  info = vec4(kFar, 0.0, 0.0, 1.0);
  if (!(span.x < span.y)) return;

  vec3 sum = vec3(0.0);
  float left = 1.0, depthSum = 0.0, guessSum = 0.0;

#define ADD(emission, alpha, z, cell)                                   \
  {                                                                     \
    vec3 cell_ = cell;                                                  \
    float weight_ = left * (alpha);                                     \
    sum += left * (emission);                                           \
    depthSum += weight_ * (z);                                          \
    ADD_GUESS(weight_, cell_)                                           \
    left -= weight_;                                                    \
  }
#ifdef GUESS
#define ADD_GUESS(weight, cell) guessSum += weight * texture(guess, cell * texelFromCell).r;
#else
#define ADD_GUESS(weight, cell)
#endif

#ifdef SLICE
  float z = (plane.w - dot(plane.xyz, from)) / dot(plane.xyz, way);
  if (!(z >= span.x && z <= span.y)) return;
  vec3 cell = from + z * way;
#ifdef SCALAR
  float value = valueAt(cell);
  if (!known(value)) return;
  // A slice's table holds colours of opacity 1; a factor of the opacity has no part in it.
  value = CUSTOM_VALUE(value, cell);
  vec4 optics = meanAt(value);
  float opacity = 1.0;
  optics = CUSTOM_FUNCTION(optics, floor(entryOf(value)), floor(entryOf(value)), cell);
  vec3 own = colorAt(optics, cell);
#else
#ifdef FIELDS
  Sample here = sampleAt(cell);
  vec4 optics = opticsBetween(here, here);
#else
  vec4 optics = texelAt(cell) * scale;
#endif
  optics = CUSTOM_LOOK(optics, cell);
  float opacity = 1.0 - exp(-optics.a * thickness);
  vec3 own = optics.a > 0.0 ? optics.rgb / optics.a : vec3(0.0);
#endif
  ADD(opacity * own, opacity, z, cell)
#else

  float k = floor(span.x / stepDepth);
  float zFirst = span.x;
#ifdef SCALAR
  bool have = false;
  float value0 = 0.0;
#if !defined(ISOSURFACE) && !defined(MAXIMUM)
  Entry entry0 = Entry(0.0, vec4(0.0));
#endif
#endif
#ifdef FIELDS
  bool have = false;
  Sample sample0 = Sample(vec4(0.0), 0.0);
#endif
#ifdef MAXIMUM
  float greatest = kNoValueEdge, greatestAt = 0.0;
#endif
  bool going = true;
  while (going) {
    float z0 = max(k * stepDepth, zFirst);
    if (z0 >= span.y) break;
#ifdef SKIP
    {
      vec3 cell = from + z0 * way;
      ivec3 brick = clamp(ivec3(textureCell(cell)) / kBrick, ivec3(0), lastBrick);
      int leap = int(texelFetch(leaps, brick, 0).r);
      if (leap > 0) {
        // To the step in which the ray leaves the cube of empty bricks.
        vec3 face = vec3(brick) + mix(vec3(1 - leap), vec3(leap), greaterThan(way, vec3(0.0)));
        vec3 exits = (facePlace(face * float(kBrick)) - cell) / way;
        exits = mix(exits, vec3(kFar), lessThan(abs(way), vec3(1e-12)));
        float kExit = floor(min((z0 + min(exits.x, min(exits.y, exits.z))), span.y) / stepDepth);
        if (kExit > k) {
          k = kExit;
#if defined(SCALAR) || defined(FIELDS)
          have = false;
#endif
          continue;
        }
      }
    }
#endif
    for (int run = 0; run < kRun; ++run) {
      z0 = max(k * stepDepth, zFirst);
      float end = stepEnd(k, from + z0 * way, way);
      float z1 = min(end * stepDepth, span.y);
      float odd = k - 2.0 * floor(0.5 * k);
      k = end;
      if (z0 >= z1) break;
      float zMiddle = 0.5 * (z0 + z1), ds = (z1 - z0) * rate;
#ifdef SCALAR
      if (!have) {
        value0 = VALUE_AT(from + z0 * way);
#if !defined(ISOSURFACE) && !defined(MAXIMUM)
        entry0 = entryAt(value0, odd);
#endif
        have = true;
      }
#if defined(UNEVEN) && !defined(ISOSURFACE) && !defined(MAXIMUM)
      odd = entry0.x - 2.0 * floor(0.5 * entry0.x);
#endif
      float value1 = VALUE_AT(from + z1 * way);
      bool both = known(value0) && known(value1);
#if defined(MAXIMUM)
      if (value0 > greatest) {
        greatest = value0;
        greatestAt = z0;
      }
      if (value1 > greatest) {
        greatest = value1;
        greatestAt = z1;
      }
#elif defined(ISOSURFACE)
      // Crossings in the order of the ray, as the value is linear between its two samples.
      bool rising = value1 > value0;
      for (int i = 0; i < surfaces && both; ++i) {
        int s = rising ? i : surfaces - 1 - i;
        float v = isovalues[s];
        if ((value0 < v) == (value1 < v)) continue;
        float z = mix(z0, z1, (v - value0) / (value1 - value0));
        vec4 own = surfaceColors[s];
        vec3 cell = from + z * way;
        own = CUSTOM_LOOK(vec4(own.rgb * own.a, own.a), cell);
        own /= max(own.a, 1.0);  // a factor cannot make more than opaque
        ADD(lit(own.rgb, own.a, cell, toViewer), own.a, z, cell)
      }
#else
      Entry entry1 = entryAt(value1, 1.0 - odd);
      vec4 optics = both ? CUSTOM_FUNCTION(meanBetween(entry0, entry1), entry0.x, entry1.x,
                                           from + zMiddle * way)
                         : vec4(0.0);
#ifdef GAPS
      // Where one end has no data, the other end's half of the step is like that end.
      bool first = known(value0);
      if (!both && (first || known(value1))) {
        float x = floor(first ? entry0.x : entry1.x);
        zMiddle = mix(z0, z1, first ? 0.25 : 0.75);
        ds *= 0.5;
        optics = CUSTOM_FUNCTION(meanAt(first ? value0 : value1), x, x, from + zMiddle * way);
      }
#endif
#ifdef LIT
      if (both && optics.a > 0.0) zMiddle = mix(z0, z1, lightPlace(entry0, entry1, optics.a * ds));
#endif
      entry0 = entry1;
#endif
      value0 = value1;
#elif defined(FIELDS)
      if (!have) sample0 = sampleAt(from + z0 * way);
      have = true;
      Sample sample1 = sampleAt(from + z1 * way);
      vec4 optics = opticsBetween(sample0, sample1);
#ifdef GAPS
      bool first = known(sample0);
      if (first != known(sample1)) {
        zMiddle = mix(z0, z1, first ? 0.25 : 0.75);
        ds *= 0.5;
        if (first) optics = opticsBetween(sample0, sample0);
        else optics = opticsBetween(sample1, sample1);
      }
#endif
      sample0 = sample1;
#else
      vec4 optics = texelAt(from + zMiddle * way) * scale;
#endif
#if !defined(MAXIMUM) && !defined(ISOSURFACE)
      if (optics.a > 0.0) {
        vec3 cell = from + zMiddle * way;
        optics = CUSTOM_LOOK(optics, cell);
        float alpha = 1.0 - exp(-optics.a * ds);
        ADD(lit(optics.rgb * (alpha / max(optics.a, 1e-30)), alpha, cell, toViewer), alpha, zMiddle,
            cell)
      }
#endif
    }
    going = left > opaque;
  }
#ifdef MAXIMUM
  if (greatest > kNoValueEdge) {
    // As in slices: colours of opacity 1.
    vec3 cell = from + greatestAt * way;
    float x = floor(entryOf(greatest));
    color = vec4(colorAt(CUSTOM_FUNCTION(meanAt(greatest), x, x, cell), cell), 1.0);
    info.r = greatestAt + depthOrigin;
  }
  return;
#endif
#endif
  float alpha = 1.0 - left;
  color = vec4(sum, alpha);
  if (alpha > 0.0) info.r = depthSum / alpha + depthOrigin;
  info.g = guessSum;
}
