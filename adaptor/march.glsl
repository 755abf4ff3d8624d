// SPDX-License-Identifier: BSD-3-Clause
// One ray through one block, marched once for every proxy (method §0, §2).
//
// Depth along the ray is z = (Z - Z_0) / scale with Z_0 of the whole domain, so every block of a
// domain samples at the same depths i * stepDepth. Values are normalised to the partition.
// Channels go by value here: 0 below, 1..L the intervals, L+1 above, L+2 no data; channel c is
// [edges[c].x, edges[c + 1].x).
//
// Steps are taken a stretch at a time: all its samples first, then a loop over the edges that the
// ray crosses in it. Where rays run side by side in the lanes of a vector unit, a loop ends with its
// last lane and an `if` saves nothing, so rare work must not stand in the loop of the samples.
//
// Marcher defines INTERVALS, LAYERS (counts); STRETCH (steps), EACH_STEP(X) = X(0, 1) X(1, 2) ...,
// EACH_STEP_BACK(X) in reverse; EACH_LAYER(X) = X(0) X(1) ...; and where requested LENGTH,
// ATTENUATION, MIP, REFERENCE, PHONG, and BASE where the base transfer function is needed.

layout(local_size_x = 64) in;

layout(std430, binding = 0) writeonly buffer Planes { float planes[]; };

uniform ivec2 size;           // of the whole picture
uniform ivec2 band;           // first row, rows
uniform vec3 originAt[3];     // local position at z = 0: [0] + x [1] + y [2], x, y in [-1/2, 1/2]
uniform vec3 directionAt[3];  // change of local position with z, likewise
uniform vec3 boxLow, boxHigh, domainHigh;
uniform float stepDepth;
uniform float firstDepth;   // z of the camera plane
uniform float depthOrigin;  // Z_0
uniform mat3 eyeFromWorld;

const int kChannels = INTERVALS + 3;
const int kNoData = INTERVALS + 2;
uniform vec2 edges[INTERVALS + 4];  // value, and the base function's integral up to it

// Channels as the partition numbers them (intervals, below, above, no data) from ours, and back.
#define OUTER(c) ((c) == 0 ? INTERVALS : (c) <= INTERVALS ? (c) - 1 : (c))
#define INNER(k) ((k) < INTERVALS ? (k) + 1 : (k) == INTERVALS ? 0 : (k))

#if defined(LENGTH) || defined(ATTENUATION)
#define RUNS
#endif

// The entry and exit of a ray in the owned box; x >= y: it misses. A ray within a face that two
// blocks share belongs to one of them.
vec2 clipToBox(vec3 origin, vec3 direction) {
  vec2 z = vec2(firstDepth, kInfinity);
  for (int axis = 0; axis < 3; ++axis) {
    float o = origin[axis], d = direction[axis];
    float low = boxLow[axis], high = boxHigh[axis];
    if (d == 0.0) {
      bool outside = o < low || o > high || (o == high && high < domainHigh[axis]);
      z.y = outside ? -kInfinity : z.y;
    } else {
      float a = (low - o) / d, b = (high - o) / d;
      z = vec2(max(z.x, min(a, b)), min(z.y, max(a, b)));
    }
  }
  return z;
}

#ifdef UNEVEN
#define SAMPLE(z) sampleAt(textureAt(origin + (z) * direction))
#else
#define SAMPLE(z) sampleAt(textureOrigin0 + (z) * textureDirection)
#endif

#if LAYERS > 0
uniform float isovalues[LAYERS];

// Where the trilinear field passes `iso` between samples a and b that lie on its two sides: regula
// falsi on the field itself.
float refine(float iso, float za, float zb, float a, float b, vec3 origin, vec3 direction) {
  for (int i = 0; i < 3; ++i) {
    float z = mix(za, zb, clamp((iso - a) / (b - a), 0.0, 1.0));
    float f = sampleAt(textureAt(origin + z * direction));
    if (f > kGapEdge) break;
    bool before = (f < iso) == (a < iso);
    za = before ? z : za;
    a = before ? f : a;
    zb = before ? zb : z;
    b = before ? b : f;
  }
  return a == b ? za : mix(za, zb, clamp((iso - a) / (b - a), 0.0, 1.0));
}
#endif

#ifdef REFERENCE
// The colour of the step between samples `raw` and `fresh`: its extinction-weighted mean, of the
// whole step even where only a part is in the box, so that blocks add up.
vec3 stepColor(float raw, float fresh, float z, vec3 origin, vec3 direction) {
  vec3 color = meanColor(raw, fresh, baseAt(raw).integral, baseAt(fresh).integral);
#ifdef PHONG
  // Blinn-Phong with a headlight: light, viewer and half vector are one.
  float facing = abs(dot(normalAt(origin + z * direction, direction), normalize(direction)));
  color = color * (0.3 + 0.7 * facing) + 0.2 * pow(facing, 32.0);
#endif
  return color;
}
#endif

int planeSize, place, plane = 0;

void put(float value) {
  planes[plane * planeSize + place] = value;
  ++plane;
}

void main() {
  // A workgroup is a tile of 8x8 pixels; each eight consecutive invocations are 4x2 of them.
  int lane = int(gl_LocalInvocationIndex);
  ivec2 inTile = ivec2((lane & 3) | ((lane >> 1) & 4), ((lane >> 2) & 1) | ((lane >> 3) & 6));
  ivec2 pixel = ivec2(gl_WorkGroupID.xy) * 8 + inTile;
  if (pixel.x >= size.x || pixel.y >= band.y) return;
  planeSize = size.x * band.y;
  place = pixel.y * size.x + pixel.x;

  vec2 at = (vec2(pixel.x, pixel.y + band.x) + 0.5) / vec2(size) - 0.5;
  vec3 origin = originAt[0] + at.x * originAt[1] + at.y * originAt[2];
  vec3 direction = directionAt[0] + at.x * directionAt[1] + at.y * directionAt[2];
  vec3 textureOrigin0 = origin * textureFromLocal + textureOrigin;
  vec3 textureDirection = direction * textureFromLocal;
  float lengthPerDepth = length(direction);
  vec2 inBox = clipToBox(origin, direction);
  bool miss = !(inBox.x < inBox.y);
  float zIn = miss ? 0.0 : inBox.x, zOut = miss ? 0.0 : inBox.y;

  // The entry stands between two samples; the value is linear there.
  float index = floor(zIn / stepDepth);
  float raw = SAMPLE(index * stepDepth);
  float f0 = SAMPLE((index + 1.0) * stepDepth);
  f0 = max(raw, f0) > kGapEdge ? kGap : mix(raw, f0, clamp(zIn / stepDepth - index, 0.0, 1.0));
  float z0 = zIn;

  // The run that the ray is in: its channel, that channel's edges, where it began.
  int channel = 0;
  while (f0 >= edges[channel + 1].x) ++channel;
  vec2 low = edges[channel], high = edges[channel + 1];
  float runStart = zIn;
#ifdef RUNS
  int firstRun = -1, lastRun = channel;  // channels of the first and last run longer than nothing
  vec4 sums[kChannels];  // length, moment, runs, attenuation
  for (int c = 0; c < kChannels; ++c) sums[c] = vec4(0.0);
#endif
#ifdef BASE
  float tau0 = 0.0, runTransmittance = 1.0;
  Base base0 = baseAt(f0);
#endif
#ifdef MIP
  float largest = f0 < kGapEdge ? f0 : -kInfinity;
#endif
#ifdef REFERENCE
  vec3 light = vec3(0.0);
#endif
  // Of the step where a layer is first met: index (negative: none yet) and the samples at its ends.
#define LAYER_START(m) float hit##m = -1e30, hitLow##m = 0.0, hitHigh##m = 1.0;
  EACH_LAYER(LAYER_START)

  while (z0 < zOut) {
    // Names end in the number of the sample in this stretch.
    float F0 = f0, Z0 = z0;
#ifdef BASE
    Base BASE0 = base0;
    float TAU0 = tau0;
#define BASE_STEP(i, j)                                                             \
  Base BASE##j = baseAt(F##j);                                                      \
  float TAU##j = TAU##i + (Z##j - Z##i) * lengthPerDepth *                          \
                              meanExtinction(F##i, F##j, BASE##i, BASE##j);
#else
#define BASE_STEP(i, j)
#endif
#ifdef MIP
#define MIP_STEP(j) largest = max(largest, F##j < kGapEdge ? F##j : -kInfinity);
#else
#define MIP_STEP(j)
#endif
#ifdef REFERENCE
    vec3 color;
#define REFERENCE_STEP(i, j)                                                                   \
  light += max(exp(-TAU##i) - exp(-TAU##j), 0.0) * color;
#define COLOR_STEP                                                                             \
  color = stepColor(raw, fresh, (index + 0.5) * stepDepth, origin, direction);
#else
#define REFERENCE_STEP(i, j)
#define COLOR_STEP
#endif
#define LAYER_STEP(m)                                                              \
  if (hit##m < -1e29 && (fa < isovalues[m]) != (fb < isovalues[m])) {              \
    hit##m = index;                                                                \
    hitLow##m = raw;                                                               \
    hitHigh##m = fresh;                                                            \
  }

    // The last step ends at the exit, between two samples; steps after it stand still.
#define STEP(i, j)                                                                 \
  float F##j, Z##j;                                                                \
  {                                                                                \
    float next = (index + 1.0) * stepDepth;                                        \
    float fresh = SAMPLE(next);                                                    \
    COLOR_STEP                                                                     \
    float cut = mix(raw, fresh, zOut / stepDepth - index);                         \
    F##j = next <= zOut ? fresh                                                    \
           : Z##i < zOut ? (max(raw, fresh) > kGapEdge ? kGap : cut) : F##i;       \
    Z##j = clamp(next, Z##i, zOut);                                                \
    float fa = F##i, fb = max(F##i, F##j) > kGapEdge ? F##i : F##j;                \
    EACH_LAYER(LAYER_STEP)                                                         \
    raw = fresh;                                                                   \
    index += 1.0;                                                                  \
  }                                                                                \
  MIP_STEP(j)                                                                      \
  BASE_STEP(i, j)                                                                  \
  REFERENCE_STEP(i, j)

    EACH_STEP(STEP)

#ifdef RUNS
    // Leave the channel where the ray crosses one of its edges, one crossing a turn.
    int from = 0;  // the first step of this stretch that may hold one
    while (true) {
      int where = STRETCH;
      float fa = 0.0, fb = 1.0, za = 0.0, zb = 0.0, sa = 0.0, sb = 0.0, ta = 0.0, tb = 0.0;
#ifdef BASE
#define FIND_BASE(i, j) \
  sa = BASE##i.integral, sb = BASE##j.integral, ta = TAU##i, tb = TAU##j
#else
#define FIND_BASE(i, j)
#endif
#define FIND(i, j)                                                \
  if (i >= from && (F##j < low.x || F##j >= high.x)) {            \
    where = i, fa = F##i, fb = F##j, za = Z##i, zb = Z##j;        \
    FIND_BASE(i, j);                                              \
  }
      EACH_STEP_BACK(FIND)
      if (where == STRETCH) break;

      // A step with an end without data has none as a whole.
      bool intoGap = fb > kGapEdge, outOfGap = channel == kNoData, up = fb >= high.x;
      vec2 edge = up ? high : low;
      float t = clamp((edge.x - fa) / (fb - fa), 0.0, 1.0);
      t = intoGap ? 0.0 : outOfGap ? 1.0 : t;
      float z = mix(za, zb, t);
      float run = z - runStart;
      vec4 add = vec4(run, 0.5 * run * (z + runStart), run > 0.0 ? 1.0 : 0.0, 0.0);
      runStart = z;
      lastRun = run > 0.0 ? channel : lastRun;
      firstRun = firstRun < 0 && run > 0.0 ? channel : firstRun;
#ifdef BASE
      // Optical depth within the step follows the integral over the values that were passed.
      float share = sa == sb || intoGap || outOfGap ? t : clamp((edge.y - sa) / (sb - sa), 0.0, 1.0);
      float transmittance = exp(-mix(ta, tb, share));
      add.w = runTransmittance - transmittance;
      runTransmittance = transmittance;
#endif
      sums[channel] += add;

      from = outOfGap ? where + 1 : where;
      channel = intoGap ? kNoData : outOfGap ? 0 : up ? channel + 1 : channel - 1;
      while (outOfGap && fb >= edges[channel + 1].x) ++channel;
      low = edges[channel];
      high = edges[channel + 1];
    }
#endif

#define LAST(i, j) f0 = F##j, z0 = Z##j;
    EACH_STEP(LAST)
#ifdef BASE
#define LAST_BASE(i, j) base0 = BASE##j, tau0 = TAU##j;
    EACH_STEP(LAST_BASE)
#endif
  }

  put(miss ? kInfinity : depthOrigin + scale * zIn);
  put(miss ? -kInfinity : depthOrigin + scale * zOut);
#ifdef RUNS
  {
    // The last run ends at the exit.
    float run = zOut - runStart;
    vec4 add = vec4(run, 0.5 * run * (zOut + runStart), run > 0.0 ? 1.0 : 0.0, 0.0);
#ifdef BASE
    add.w = runTransmittance - exp(-tau0);
#endif
    sums[channel] += add;
    lastRun = run > 0.0 ? channel : lastRun;
    firstRun = firstRun < 0 ? lastRun : firstRun;
  }
  put(miss ? 255.0 : float(OUTER(firstRun)));
  put(miss ? 255.0 : float(OUTER(lastRun)));
#ifdef LENGTH
  float worldPerDepth = scale * lengthPerDepth;
  for (int k = 0; k < kChannels; ++k) put(worldPerDepth * sums[INNER(k)].x);
  for (int k = 0; k < kChannels; ++k) {
    put(worldPerDepth * (depthOrigin * sums[INNER(k)].x + scale * sums[INNER(k)].y));
  }
  for (int k = 0; k < kChannels; ++k) put(sums[INNER(k)].z);
#endif
#ifdef ATTENUATION
  for (int k = 0; k < kChannels; ++k) put(sums[INNER(k)].w);
#endif
#endif
#ifdef BASE
  put(exp(-tau0));
#endif
#define LAYER_DEPTH(m)                                                                        \
  float depth##m = kInfinity;                                                                 \
  if (hit##m > -1e29) {                                                                       \
    depth##m = refine(isovalues[m], hit##m * stepDepth, (hit##m + 1.0) * stepDepth, hitLow##m, \
                      hitHigh##m, origin, direction);                                         \
  }                                                                                           \
  put(depthOrigin + scale * depth##m);
  EACH_LAYER(LAYER_DEPTH)
#define LAYER_NORMAL(m)                                                                       \
  {                                                                                           \
    bool found = hit##m > -1e29;                                                              \
    vec3 n = eyeFromWorld * normalAt(origin + (found ? depth##m : 0.0) * direction, direction); \
    put(found ? n.x : 0.0);                                                                   \
    put(found ? n.y : 0.0);                                                                   \
    put(found ? n.z : 0.0);                                                                   \
  }
  EACH_LAYER(LAYER_NORMAL)
#ifdef MIP
  put(miss ? -kInfinity : largest);
#endif
#ifdef REFERENCE
  put(light.r);
  put(light.g);
  put(light.b);
#endif
}
