// SPDX-License-Identifier: BSD-3-Clause
// One ray through one block: integrals of a classifier's weights (method §5, classification §4), depth slab by
// depth slab or along the whole ray. Samples stand where march.glsl has them.
//
// FeatureMarcher puts march_field.glsl, the classifier's classify() and this file together and
// defines FIELDS, VOLUMES (FIELDS or one more: the gradient norm, GRADIENT), CHANNELS, PARAMETERS;
// SLABS for slabs; SKIP, GAPS, CONVERGING and AXIS_* as for march.glsl.

layout(local_size_x = 64) in;

layout(std430, binding = 0) writeonly buffer Planes { float planes[]; };
layout(std430, binding = 1) readonly buffer Tiles { vec4 tiles[]; };  // see TilePlan
uniform int firstTile;

uniform ivec2 size;  // of the whole picture
uniform ivec2 band;  // first row, rows
uniform float depthOrigin;
#ifdef CONVERGING
uniform float lean;  // see MarchRays
#endif
uniform sampler2DArray volumes[VOLUMES];
#ifdef SLABS
uniform float faces[SLABS + 1];  // depths z
#else
uniform float extinction[CHANNELS];  // 1 / world unit
uniform float rate[CHANNELS];        // of attenuation
#endif

// ∫ Z ds of local sums (length, moment), before the ray's length a depth.
float momentOf(vec2 sums) {
  return perMoment * depthOrigin * sums.x + perMoment * scale * sums.y;
}

struct Values {
  vec4 fields;
  float gradient;
};

float trilinear(sampler2DArray field, vec3 corner, vec3 share) {
  return trilinear(textureGather(field, corner),
                   textureGather(field, vec3(corner.xy, corner.z + 1.0)), share);
}

Values valuesAt(Place p) {
  vec3 corner = vec3(p.node.xy * texelSize + cornerOrigin, p.node.z - firstNode.z);
  Values v = Values(vec4(0.0), 0.0);
  v.fields.x = trilinear(volumes[0], corner, p.share);
#if FIELDS > 1
  v.fields.y = trilinear(volumes[1], corner, p.share);
#endif
#if FIELDS > 2
  v.fields.z = trilinear(volumes[2], corner, p.share);
#endif
#if FIELDS > 3
  v.fields.w = trilinear(volumes[3], corner, p.share);
#endif
#ifdef GRADIENT
  v.gradient = trilinear(volumes[FIELDS], corner, p.share);
#endif
  return v;
}

#ifdef UNEVEN
#define SAMPLE(z) valuesAt(placeAt(origin + (z) * direction))
#else
#define SAMPLE(z) valuesAt(placeOf(node0 + (z) * nodeDirection))
#endif

// No data in one field is none at all.
bool hasData(Values v) {
#ifdef GAPS
  vec4 f = v.fields;
  return !isGap(max(max(max(f.x, f.y), max(f.z, f.w)), v.gradient));
#else
  return true;
#endif
}

int planeSize, place;
float sums[CHANNELS];

#ifdef SLABS
// The planes are zero to begin with.
void putSlab(int slab) {
  for (int c = 0; c < CHANNELS; ++c) {
    if (sums[c] > 0.0) planes[(slab * CHANNELS + c) * planeSize + place] = sums[c];
    sums[c] = 0.0;
  }
}
#endif

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
  vec3 fromPole = at.x * originAt[1] + at.y * originAt[2];
  float radius = length(fromPole);
  vec3 leaning = radius > 0.0 ? fromPole * (-lean / radius) : vec3(0.0);
  direction += leaning;
  origin -= firstDepth * leaning;
#endif
  vec3 node0 = origin * nodesFromLocal + nodesOrigin, nodeDirection = direction * nodesFromLocal;
  float worldPerDepth = scale * length(direction);
  vec2 inBox = clipToBox(origin, direction);
#ifdef CONVERGING
  inBox.y = min(inBox.y, firstDepth + radius / lean);
#endif
#ifdef SLABS
  inBox = vec2(max(inBox.x, faces[0]), min(inBox.y, faces[SLABS]));
#endif
  if (!(inBox.x < inBox.y)) return;
  for (int c = 0; c < CHANNELS; ++c) sums[c] = 0.0;
#ifndef SLABS
  planes[place] = depthOrigin + scale * inBox.x;
  planes[planeSize + place] = depthOrigin + scale * inBox.y;
  float moments[CHANNELS], attenuation[CHANNELS], left = 1.0;
  for (int c = 0; c < CHANNELS; ++c) moments[c] = attenuation[c] = 0.0;
#endif
  // In front of and behind these depths there is nothing in the tile.
  float z = max(inBox.x, tile.z), zOut = min(inBox.y, tile.w);
  float index = floor(z / stepDepth);
#ifdef SLABS
  int slab = 0;
#endif
  bool loaded = false;
  Values a, b;
  while (z < zOut) {
#ifdef SKIP
    // From sample to sample within a brick in which all channels vanish.
    if (z == index * stepDepth || !loaded) {
      vec3 local = origin + index * stepDepth * direction;
      ivec3 brick = brickAt(local);
      if (texelFetch(bricks, brick, 0).x >= 0.0) {
        float to = min(floor(leavesBrick(brick, origin, direction) / stepDepth),
                       ceil(zOut / stepDepth));
        if (to > index) {
          index = to;
          z = max(z, index * stepDepth);
          loaded = false;
          continue;
        }
      }
    }
#endif
    if (!loaded) {
      a = SAMPLE(index * stepDepth);
      b = SAMPLE((index + 1.0) * stepDepth);
      loaded = true;
    }
    float stepEnd = (index + 1.0) * stepDepth, end = min(stepEnd, zOut);
#ifdef SLABS
    while (slab < SLABS - 1 && z >= faces[slab + 1]) {
      putSlab(slab);
      ++slab;
    }
    end = slab < SLABS - 1 ? min(end, faces[slab + 1]) : end;
#endif
    bool aHas = hasData(a), bHas = hasData(b);
    if (aHas || bHas) {
      vec2 share = clamp(vec2(z, end) / stepDepth - index, 0.0, 1.0);
      // Where one end has no data, the other end's half of the step is like that end.
      Values from = a, to = b;
      if (!aHas) from = b, share = max(share, 0.5);
      if (!bHas) to = a, share = min(share, 0.5);
      float gradient = 0.5 * (from.gradient + to.gradient), weights[CHANNELS];
      classify(mix(from.fields, to.fields, share.x), mix(from.fields, to.fields, share.y), gradient,
               gradient, weights);
      bool whole = aHas && bHas;
      vec2 ends = whole ? vec2(z, end) : (index + share) * stepDepth;
      float run = max(ends.y - ends.x, 0.0);
#ifdef SLABS
      for (int c = 0; c < CHANNELS; ++c) sums[c] += run * weights[c] * worldPerDepth;
#else
      float tau = 0.0;
      for (int c = 0; c < CHANNELS; ++c) tau += extinction[c] * weights[c];
      tau *= run * worldPerDepth;
      // The mean transmittance of a homogeneous segment; what it takes and what it leaves add up.
      float mean = left * (tau > 0.01 ? (1.0 - exp(-tau)) / tau : 1.0 - tau * (0.5 - tau / 6.0));
      for (int c = 0; c < CHANNELS; ++c) {
        float add = run * weights[c];
        sums[c] += add;
        moments[c] += 0.5 * (ends.x + ends.y) * add;
        attenuation[c] += rate[c] * worldPerDepth * add * mean;
      }
      left = max(left - mean * tau, 0.0);
#endif
    }
    z = max(z, end);
    if (end == stepEnd) {
      index += 1.0;
      a = b;
      b = SAMPLE((index + 1.0) * stepDepth);
    }
  }
#ifdef SLABS
  putSlab(slab);
#else
  planes[2 * planeSize + place] = 1.0 - left;
  for (int c = 0; c < CHANNELS; ++c) {
    float world = worldPerDepth * sums[c];
    int to = (3 + c) * planeSize + place;
    planes[to] = world;
    planes[to + CHANNELS * planeSize] =
        worldPerDepth * momentOf(vec2(sums[c], moments[c]));
    planes[to + 2 * CHANNELS * planeSize] = attenuation[c];
  }
#endif
}
