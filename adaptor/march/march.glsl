// SPDX-License-Identifier: BSD-3-Clause
// One ray through one block, marched once for every proxy (method §1 and §2).
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
// Before a stretch, bricks in which the ray can meet nothing are skipped (SKIP). In EMPTY_TILE tiles
// rays meet nothing but the block's background.
//
// Marcher defines INTERVALS, LAYERS (counts); STRETCH (steps), EACH_STEP(X) = X(0, 1) X(1, 2) ...,
// EACH_STEP_BACK(X) in reverse; EACH_LAYER(X) = X(0) X(1) ...; and where requested LENGTH,
// ATTENUATION, MIP, REFERENCE, PHONG, and BASE where the base transfer function is needed; or SLAB
// alone: lengths between two depths, which slab_march.cpp reads; with DIRECT where its samples are
// nodes of the grid.

layout(local_size_x = 64) in;

layout(std430, binding = 0) writeonly buffer Planes { float planes[]; };
layout(std430, binding = 1) readonly buffer Tiles { vec4 tiles[]; };  // see TilePlan
uniform int firstTile;

uniform ivec2 size;           // of the whole picture
uniform ivec2 band;           // first row, rows
uniform float depthOrigin;  // Z_0
uniform mat3 eyeFromWorld;
#ifdef CONVERGING
uniform float lean;  // see MarchRays
#endif
#ifdef SLAB
uniform vec2 slab;  // the depths z between which rays are followed
#endif

const int kChannels = INTERVALS + 3;
const int kNoData = INTERVALS + 2;
#ifdef EMPTY_TILE
uniform int backgroundChannel;
uniform float backgroundHigh;
#endif
uniform vec2 edges[INTERVALS + 4];  // value, and the base function's integral up to it

// ∫ Z ds of local sums (length, moment), before the ray's length a depth.
float momentOf(vec2 sums) {
  return perMoment * depthOrigin * sums.x + perMoment * scale * sums.y;
}

#ifndef VALUE
#define VALUE(f, z) (f)
#endif

#ifdef SLAB
const int kNoRank = 128;  // more than there are; slab_march.cpp
#endif

// Channels as the partition numbers them (intervals, below, above, no data) from ours.
#define OUTER(c) ((c) == 0 ? INTERVALS : (c) <= INTERVALS ? (c) - 1 : (c))

#if defined(LENGTH) || defined(ATTENUATION) || defined(SLAB)
#define RUNS
#endif

#if defined(DIRECT)
// Samples stand on nodes, or so near that the difference does not count.
float voxelAt(vec3 node) {
  float f = texelFetch(volume, clamp(ivec3(node - firstNode + 0.5), ivec3(0), nodeCount - 1), 0).x;
#ifdef GAPS
  f = abs(f) < kGapEdge ? f : kGap;
#endif
  return f;
}
#define SAMPLE(z) voxelAt(node0 + (z) * nodeDirection)
#elif defined(UNEVEN)
#define SAMPLE(z) fieldAt(placeAt(origin + (z) * direction))
#else
#define SAMPLE(z) fieldAt(placeOf(node0 + (z) * nodeDirection))
#endif

#if LAYERS > 0
uniform float isovalues[LAYERS];

// Where the trilinear field first passes `iso` in step `hit` (negative: in none): regula falsi on
// the field itself, between the samples at its ends. +infinity unless the straight line between
// them passes it before the exit.
float layerDepth(float hit, float iso, float zIn, float zOut, vec3 origin, vec3 direction) {
  bool found = hit > -1e29;
  float za = found ? hit * stepDepth : zIn, zb = za + stepDepth;
  float a = fieldAt(placeAt(origin + za * direction));
  float b = fieldAt(placeAt(origin + zb * direction));
  found = found && mix(za, zb, (iso - a) / (b - a)) <= zOut;
  float z = za;
  for (int i = 0; i < 3; ++i) {
    z = mix(za, zb, clamp((iso - a) / (b - a), 0.0, 1.0));
    float f = fieldAt(placeAt(origin + z * direction));
    if (isGap(f) || f == iso) break;
    bool before = (f < iso) == (a < iso);
    za = before ? z : za;
    a = before ? f : a;
    zb = before ? zb : z;
    b = before ? b : f;
    z = mix(za, zb, clamp((iso - a) / (b - a), 0.0, 1.0));
  }
  return found ? z : kInfinity;
}
#endif

#ifdef REFERENCE
// What a headlight makes of the light of a step with middle z whose opacity is `alpha`. Blinn-Phong:
// light, viewer and half vector are one.
vec3 headlit(vec3 light, float alpha, float z, vec3 origin, vec3 direction) {
#ifdef PHONG
  float facing = abs(dot(normalAt(origin + z * direction, direction), normalize(direction)));
  light = light * (0.3 + 0.7 * facing) + alpha * 0.2 * pow(facing, 32.0);
#endif
  return light;
}
#endif

int planeSize, place, plane = 0;

// The planes are zero to begin with: most channels of most rays stay so, and a store costs.
void putAt(int at, float value) {
  if (value != 0.0) planes[at * planeSize + place] = value;
}
void put(float value) { putAt(plane++, value); }

void main() {
  // A workgroup is a tile of 8x8 pixels; each eight consecutive invocations are 4x2 of them.
  vec4 tile = tiles[firstTile + int(gl_WorkGroupID.x)];
  int lane = int(gl_LocalInvocationIndex);
  ivec2 inTile = ivec2((lane & 3) | ((lane >> 1) & 4), ((lane >> 2) & 1) | ((lane >> 3) & 6));
  ivec2 pixel = ivec2(tile.xy) * 8 + inTile - ivec2(0, band.x);
  if (pixel.x >= size.x || pixel.y >= band.y) return;
  planeSize = size.x * band.y;
  place = pixel.y * size.x + pixel.x;

  vec2 at = (vec2(pixel.x, pixel.y + band.x) + 0.5) / vec2(size) - 0.5;
  vec3 origin = originAt[0] + at.x * originAt[1] + at.y * originAt[2];
  vec3 direction = directionAt[0] + at.x * directionAt[1] + at.y * directionAt[2];
#ifdef CONVERGING
  // From the camera plane to the pole line at depth κ times the start's distance from the pole.
  vec3 fromPole = at.x * originAt[1] + at.y * originAt[2];
  float radius = length(fromPole);
  vec3 leaning = radius > 0.0 ? fromPole * (-lean / radius) : vec3(0.0);
  direction += leaning;
  origin -= firstDepth * leaning;
#endif
  vec3 node0 = origin * nodesFromLocal + nodesOrigin, nodeDirection = direction * nodesFromLocal;
  float lengthPerDepth = length(direction), stepLength = stepDepth * lengthPerDepth;
  vec2 inBox = clipToBox(origin, direction);
#ifdef CONVERGING
  inBox.y = min(inBox.y, firstDepth + radius / lean);
#endif
#ifdef SLAB
  inBox = vec2(max(inBox.x, slab.x), min(inBox.y, slab.y));
#endif
  bool miss = !(inBox.x < inBox.y);
  float zIn = miss ? 0.0 : inBox.x, zOut = miss ? 0.0 : inBox.y;

#ifdef EMPTY_TILE
#ifdef RUNS
  int channel = backgroundChannel, firstRun = -1, lastRun = channel;
  int lowest = channel, highest = channel;
  float runStart = zIn, runTransmittance = 1.0;
  vec4 sums[kChannels];
  sums[channel] = vec4(0.0);
#endif
  float tauOut = 0.0, largest = backgroundHigh;
  vec3 light = vec3(0.0);
#else
  // The march begins at the sample before the entry, which stands between two samples with the
  // value linear in between; what it meets before the entry counts for nothing.
  float index = floor(zIn / stepDepth);
  float f0 = SAMPLE(index * stepDepth);
  float fIn = SAMPLE((index + 1.0) * stepDepth);
  float shareIn = clamp(zIn / stepDepth - index, 0.0, 1.0);
  // Along a step what values become is as straight as they are, wherever it is cut.
  float valueIn =
      between(VALUE(f0, index * stepDepth), VALUE(fIn, (index + 1.0) * stepDepth), shareIn);

#ifdef RUNS
  // The run that the ray is in: its channel, that channel's edges, where it began.
  int channel = 0;
  while (f0 >= edges[channel + 1].x) ++channel;
  vec2 low = edges[channel], high = edges[channel + 1];
  float runStart = zIn;
  int firstRun = -1, lastRun = channel;  // channels of the first and last run longer than nothing
  int lowest = channel, highest = channel;
  vec4 sums[kChannels];                  // length, moment, runs, attenuation
  for (int c = 0; c < kChannels; ++c) sums[c] = vec4(0.0);
#endif
#ifdef BASE
  // Optical depth is counted from the entry.
  Base base0 = baseAt(VALUE(f0, index * stepDepth));
  float tau0 = (index * stepDepth - zIn) * lengthPerDepth * FACTOR((index + 0.5) * stepDepth)
               meanUpTo(shareIn, f0, fIn, base0, baseAt(valueIn));
  float runTransmittance = 1.0;
#endif
  fIn = between(f0, fIn, shareIn);
#ifdef MIP
  float largest = isGap(fIn) ? -kInfinity : valueIn;
#endif
#ifdef REFERENCE
  vec3 light = vec3(0.0);
#endif
#ifdef SKIP
  float lastSample = floor(zOut / stepDepth);
  float passedLargest = -kInfinity;  // of what was skipped
#endif
  // Of each layer, the index of the step where it is first met; negative: none yet.
  float layerFrom = fIn;
#define LAYER_START(m) float hit##m = -1e30, iso##m = isovalues[m];
  EACH_LAYER(LAYER_START)

  // The state at the start of the last stretch: from there the exit is walked to in the end.
  float lastIndex = index, lastF = f0;
#ifdef BASE
  Base lastBase = base0;
  float lastTau = tau0;
#endif

  // Loops test at their end: a test at the head costs the vector unit one more turn.
  do {
#ifdef SKIP
    // Skip bricks while the next sample is in one that holds nothing but the ray's channel,
    // is transparent with all that lies between, and on this side of every isovalue still unmet.
    {
      float to = index;
      bool skips;
      do {
        vec3 local = origin + (to + 1.0) * stepDepth * direction;
        ivec3 brick = brickAt(local);
        vec4 range = texelFetch(bricks, brick, 0);
#ifdef RUNS
        skips = range.x == float(channel);
#else
        skips = range.x >= 0.0;
#endif
#ifdef BASE
        skips = skips && range.w == base0.integral && base0.extinction == 0.0;
#endif
#define LAYER_SKIP(m)                                                     \
  skips = skips && (hit##m > -1e29 ||                                     \
                    ((layerFrom < iso##m) == (range.y < iso##m) &&        \
                     (layerFrom < iso##m) == (max(range.y, range.z) < iso##m)));
        EACH_LAYER(LAYER_SKIP)
        skips = skips && to < lastSample;
        float z = (to + 1.0) * stepDepth, leaves = leavesBrick(brick, origin, direction);
        leaves = z < tile.z ? max(leaves, tile.z) : z > tile.w ? kInfinity : leaves;
        leaves = floor(leaves / stepDepth);
        to = skips ? min(max(leaves, to + 1.0), lastSample) : to;
        passedLargest = skips ? max(passedLargest, range.z) : passedLargest;
      } while (skips);
      if (to > index) {
        index = to;
        f0 = SAMPLE(index * stepDepth);
        layerFrom = f0;
#ifdef BASE
        base0 = baseAt(VALUE(f0, index * stepDepth));
#endif
      }
    }
#endif

    lastIndex = index;
    lastF = f0;
#ifdef BASE
    lastBase = base0;
    lastTau = tau0;
#endif

    // Names end in the number of the sample in this stretch.
    float F0 = f0;
#ifdef BASE
    Base BASE0 = base0;
    float TAU0 = tau0;
#define BASE_STEP(i, j)                                                                       \
  Base BASE##j = baseAt(VALUE(F##j, (index + float(j)) * stepDepth));                         \
  float TAU##j = TAU##i + stepLength * FACTOR((index + float(i) + 0.5) * stepDepth)           \
                          meanExtinction(F##i, F##j, BASE##i, BASE##j);
#else
#define BASE_STEP(i, j)
#endif
#ifdef MIP
#define MIP_STEP(j)                                                              \
  largest = max(largest, (index + float(j)) * stepDepth <= zOut && !isGap(F##j)  \
                             ? VALUE(F##j, (index + float(j)) * stepDepth)       \
                             : -kInfinity);
#else
#define MIP_STEP(j)
#endif
#ifdef REFERENCE
    // Steps of one part here, those of several after the stretch. The last step, which may end after
    // the exit, is left for the end.
#define REFERENCE_STEP(i, j)                                                                    \
  bool counts##i = (index + float(j)) * stepDepth < zOut;                                       \
  Base START##i = baseAtStart(F##i, BASE##i, BASE##j);                                          \
  Base END##i = baseAtEnd(F##j, BASE##i, BASE##j);                                              \
  bool divides##i = counts##i && segmentParts(START##i, END##i, TAU##i, TAU##j) > 1.0;          \
  float alpha##i =                                                                              \
      counts##i && !divides##i ? exp(-max(TAU##i, 0.0)) - exp(-max(TAU##j, 0.0)) : 0.0;         \
  SHIFT((index + float(i) + 0.5) * stepDepth)                                                   \
  light += headlit(alpha##i * meanColor(START##i, END##i), alpha##i,                            \
                   (index + float(i) + middleOf(F##i, F##j)) * stepDepth, origin, direction);
#else
#define REFERENCE_STEP(i, j)
#endif
#if LAYERS > 0
#define LAYER_STEP(m) \
  if (hit##m < -1e29 && (layerFrom < iso##m) != (layerTo < iso##m)) hit##m = layerStep;
#define LAYER_STEPS(i, j)                                            \
  {                                                                  \
    float layerStep = index + float(i);                              \
    float layerTo = isGap(max(layerFrom, F##j)) ? layerFrom : F##j;  \
    EACH_LAYER(LAYER_STEP)                                           \
    layerFrom = F##j;                                                \
  }
#else
#define LAYER_STEPS(i, j)
#endif

#define STEP(i, j)                                           \
  float F##j = SAMPLE((index + float(j)) * stepDepth);       \
  LAYER_STEPS(i, j)                                          \
  MIP_STEP(j)                                                \
  BASE_STEP(i, j)                                            \
  REFERENCE_STEP(i, j)

    EACH_STEP(STEP)

#ifdef RUNS
    // Leave the channel where the ray crosses one of its edges, one crossing a turn.
    int from = 0;  // the first step of this stretch that may hold one
    bool crosses;
    do {
      int where = STRETCH;
      float fa = 0.0, fb = 1.0, sa = 0.0, sb = 0.0, ta = 0.0, tb = 0.0;
#ifdef BASE
#define FIND_BASE(i, j) \
  sa = BASE##i.integral, sb = BASE##j.integral, ta = TAU##i, tb = TAU##j
#else
#define FIND_BASE(i, j)
#endif
#define FIND(i, j)                                      \
  if (i >= from && (F##j < low.x || F##j >= high.x)) {  \
    where = i, fa = F##i, fb = F##j;                    \
    FIND_BASE(i, j);                                    \
  }
#define MORE(i, j) (i >= from && (F##j < low.x || F##j >= high.x)) ||
      EACH_STEP_BACK(FIND)

      bool up = fb >= high.x;
      vec2 edge = up ? high : low;
      float t = clamp((edge.x - fa) / (fb - fa), 0.0, 1.0);
#ifdef GAPS
      bool intoGap = fb > kGapEdge, outOfGap = channel == kNoData;
      t = intoGap || outOfGap ? 0.5 : t;
#endif
      float z = max((index + float(where) + t) * stepDepth, zIn);
      crosses = where < STRETCH && z < zOut;
      if (crosses) {
        float run = z - runStart;
        vec4 add = vec4(run, 0.5 * run * (z + runStart), run > 0.0 ? 1.0 : 0.0, 0.0);
        runStart = z;
        lastRun = run > 0.0 ? channel : lastRun;
        firstRun = firstRun < 0 && run > 0.0 ? channel : firstRun;
#ifdef BASE
        // Optical depth within the step follows the integral over the values that were passed.
        float share = clamp((edge.y - sa) / (sb - sa), 0.0, 1.0);
        share = sa == sb ? t : share;
#ifdef CUSTOM_VALUES
        // Edges are of values as they are, integrals of what they become.
        float becomes = mix(VALUE(fa, (index + float(where)) * stepDepth),
                            VALUE(fb, (index + float(where) + 1.0) * stepDepth), t);
        share = sa == sb ? t : clamp((baseAt(becomes).integral - sa) / (sb - sa), 0.0, 1.0);
#endif
#ifdef GAPS
        share = intoGap ? 1.0 : outOfGap ? 0.0 : share;
#endif
        float transmittance = exp(-max(mix(ta, tb, share), 0.0));
        add.w = runTransmittance - transmittance;
        runTransmittance = transmittance;
#endif
        sums[channel] += add;

        from = where;
        channel += up ? 1 : -1;
        vec2 other = edges[up ? channel + 1 : channel];
        low = up ? high : other;
        high = up ? other : edge;
#ifdef GAPS
        if (intoGap || outOfGap) {
          from = outOfGap ? where + 1 : where;
          channel = intoGap ? kNoData : 0;
          while (outOfGap && fb >= edges[channel + 1].x) ++channel;
          low = edges[channel];
          high = edges[channel + 1];
        }
#endif
        lowest = min(lowest, channel);
        highest = max(highest, channel);
        crosses = EACH_STEP(MORE) false;
      }
    } while (crosses);
#endif

#ifdef REFERENCE
    // One step of several parts a turn.
    int next = 0;
    bool divides;
    do {
      int where = STRETCH;
      float fa = f0, fb = f0, ta = 0.0, tb = 0.0;
#define FIND_DIVIDED(i, j) \
  if (i >= next && divides##i) where = i, fa = F##i, fb = F##j, ta = TAU##i, tb = TAU##j;
      EACH_STEP_BACK(FIND_DIVIDED)
      divides = where < STRETCH;
      float middle = middleOf(fa, fb);
      fa = VALUE(fa, (index + float(where)) * stepDepth);
      fb = VALUE(fb, (index + float(where) + 1.0) * stepDepth);
      SHIFT((index + float(where) + 0.5) * stepDepth)
      vec3 parts = headlit(segmentLight(fa, fb, ta, tb, tb), exp(-max(ta, 0.0)) - exp(-max(tb, 0.0)),
                           (index + float(where) + middle) * stepDepth, origin, direction);
      light += divides ? parts : vec3(0.0);
      next = where + 1;
    } while (divides);
#endif

#define LAST(i, j) f0 = F##j;
    EACH_STEP(LAST)
#ifdef BASE
#define LAST_BASE(i, j) base0 = BASE##j, tau0 = TAU##j;
    EACH_STEP(LAST_BASE)
#endif
    index += float(STRETCH);
  } while (index * stepDepth < zOut);

  // Walk to the exit, which stands between two samples like the entry.
#if defined(BASE) || defined(MIP)
  float fEnd = SAMPLE((lastIndex + 1.0) * stepDepth);
  while ((lastIndex + 1.0) * stepDepth < zOut) {
#ifdef BASE
    Base baseEnd = baseAt(VALUE(fEnd, (lastIndex + 1.0) * stepDepth));
    lastTau += stepLength * FACTOR((lastIndex + 0.5) * stepDepth)
               meanExtinction(lastF, fEnd, lastBase, baseEnd);
    lastBase = baseEnd;
#endif
    lastF = fEnd;
    lastIndex += 1.0;
    fEnd = SAMPLE((lastIndex + 1.0) * stepDepth);
  }
  float shareOut = clamp(zOut / stepDepth - lastIndex, 0.0, 1.0);
  float fOut = between(lastF, fEnd, shareOut);
  float valueOut = between(VALUE(lastF, lastIndex * stepDepth),
                           VALUE(fEnd, (lastIndex + 1.0) * stepDepth), shareOut);
#endif
#ifdef MIP
  largest = max(largest, isGap(fOut) ? -kInfinity : valueOut);
#ifdef SKIP
  // Where what was skipped may hold more: the least values of the bricks on the way bound the
  // result from below, and only bricks that reach above the bound are sampled.
  float mipEnd = passedLargest > largest + 1e-7 ? lastSample : -kInfinity;
  float at0 = ceil(zIn / stepDepth), sampleIndex = at0;
  do {
    vec3 local = origin + sampleIndex * stepDepth * direction;
    ivec3 brick = brickAt(local);
    vec2 range = texelFetch(bricks, brick, 0).yz;
    float leaves = floor(leavesBrick(brick, origin, direction) / stepDepth);
    bool counts = sampleIndex <= mipEnd && range.x <= range.y;
    largest = counts ? max(largest, range.x) : largest;
    sampleIndex = max(leaves, sampleIndex) + 1.0;
  } while (sampleIndex <= mipEnd);
  sampleIndex = at0;
  do {
    vec3 local = origin + sampleIndex * stepDepth * direction;
    ivec3 brick = brickAt(local);
    float f = fieldAt(placeAt(local));
    bool hopeful = texelFetch(bricks, brick, 0).z > largest;
    float leaves = floor(leavesBrick(brick, origin, direction) / stepDepth);
    largest = sampleIndex <= mipEnd && !isGap(f) ? max(largest, f) : largest;
    sampleIndex = (hopeful ? sampleIndex : max(leaves, sampleIndex)) + 1.0;
  } while (sampleIndex <= mipEnd);
#endif
#endif
#ifdef BASE
  float tauOut = max(lastTau + (zOut - lastIndex * stepDepth) * lengthPerDepth *
                                   FACTOR((lastIndex + 0.5) * stepDepth)
                                   meanUpTo(shareOut, lastF, fEnd, lastBase, baseAt(valueOut)),
                     0.0);
#ifdef REFERENCE
  float endZ = (lastIndex + 1.0) * stepDepth;
  Base baseEnd = baseAt(VALUE(fEnd, endZ));
  float tauEnd = lastTau + stepLength * FACTOR((lastIndex + 0.5) * stepDepth)
                           meanExtinction(lastF, fEnd, lastBase, baseEnd);
  SHIFT((lastIndex + 0.5) * stepDepth)
  light += headlit(segmentLight(VALUE(lastF, lastIndex * stepDepth), VALUE(fEnd, endZ), lastTau,
                                tauEnd, tauOut),
                   exp(-max(lastTau, 0.0)) - exp(-tauOut),
                   (lastIndex + middleOf(lastF, fEnd)) * stepDepth, origin, direction);
#endif
#endif
#endif  // EMPTY_TILE

#ifdef SLAB
  // The last run ends at the exit. Only the ranks between the lowest and the highest are stored.
  float run = zOut - runStart;
  sums[channel] += vec4(run, 0.5 * run * (zOut + runStart), 0.0, 0.0);
  lastRun = run > 0.0 ? channel : lastRun;
  firstRun = firstRun < 0 ? lastRun : firstRun;
  float worldPerDepth = scale * lengthPerDepth;
  int least = kNoRank - 1, most = 0, c = lowest;
  do {
    bool met = sums[c].x > 0.0 && c < kNoData;
    least = met ? min(least, c) : least;
    most = met ? max(most, c) : most;
    planes[(4 + c) * planeSize + place] = worldPerDepth * sums[c].x;
    ++c;
  } while (c <= highest);
  bool gaps = highest == kNoData;
  vec4 low0 = sums[min(least, kNoData)], high0 = sums[most];
  planes[place] = miss ? -1.0 : float(firstRun + kNoRank * (lastRun + (gaps ? kNoRank : 0)));
  planes[planeSize + place] = float(least + kNoRank * most);
  planes[2 * planeSize + place] = worldPerDepth * momentOf(low0.xy);
  planes[3 * planeSize + place] = worldPerDepth * momentOf(high0.xy);
#else
  put(miss ? kInfinity : depthOrigin + scale * zIn);
  put(miss ? -kInfinity : depthOrigin + scale * zOut);
#ifdef RUNS
  {
    // The last run ends at the exit.
    float run = zOut - runStart;
    vec4 add = vec4(run, 0.5 * run * (zOut + runStart), run > 0.0 ? 1.0 : 0.0, 0.0);
#ifdef BASE
    add.w = runTransmittance - exp(-tauOut);
#endif
    sums[channel] += add;
    lastRun = run > 0.0 ? channel : lastRun;
    firstRun = firstRun < 0 ? lastRun : firstRun;
  }
  put(miss ? 255.0 : float(OUTER(firstRun)));
  put(miss ? 255.0 : float(OUTER(lastRun)));
  // Only the channels that the ray was in, from the lowest to the highest.
  int c = lowest;
  do {
    int at = plane + OUTER(c);
    vec4 sum = sums[c];
#ifdef LENGTH
    float worldPerDepth = scale * lengthPerDepth;
    putAt(at, worldPerDepth * sum.x);
    at += kChannels;
    putAt(at, worldPerDepth * momentOf(sum.xy));
    at += kChannels;
    putAt(at, sum.z);
    at += kChannels;
#endif
#ifdef ATTENUATION
    putAt(at, sum.w);
#endif
    ++c;
  } while (c <= highest);
#ifdef LENGTH
  plane += 3 * kChannels;
#endif
#ifdef ATTENUATION
  plane += kChannels;
#endif
#endif
#ifdef BASE
  put(exp(-tauOut));
#endif
#if LAYERS > 0 && !defined(EMPTY_TILE)
  // Only the layers that were met; 0 stands for none.
  float hits[LAYERS + 1];
#define LAYER_HIT(m) hits[m] = hit##m;
  EACH_LAYER(LAYER_HIT)
  hits[LAYERS] = 0.0;
  int m = -1;
  do {
    do ++m; while (hits[m] < -1e29);
    int met = min(m, LAYERS - 1);
    float z = layerDepth(m < LAYERS ? hits[m] : -1e30, isovalues[met], zIn, zOut, origin, direction);
    bool found = z < kInfinity;
    vec3 n = eyeFromWorld * normalAt(origin + (found ? z : 0.0) * direction, direction);
    float depth = depthOrigin + scale * z;
    putAt(plane + met, found ? (depth == 0.0 ? 1e-37 : depth) : 0.0);
    putAt(plane + LAYERS + 3 * met, found ? n.x : 0.0);
    putAt(plane + LAYERS + 3 * met + 1, found ? n.y : 0.0);
    putAt(plane + LAYERS + 3 * met + 2, found ? n.z : 0.0);
  } while (m < LAYERS - 1);
#endif
  plane += 4 * LAYERS;
#ifdef MIP
  put(miss ? -kInfinity : largest);
#endif
#ifdef REFERENCE
  put(light.r);
  put(light.g);
  put(light.b);
#endif
#endif  // SLAB
}
