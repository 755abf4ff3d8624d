// SPDX-License-Identifier: BSD-3-Clause
// One ray through one block once more, for piecewise-analytic layers (method §2): where its
// transmittance passes given values, and the light of each layer, now that the transmittance in
// front of the block and at the far end of the whole ray are known. With SLICES, instead: its
// optical depth in the block up to each of so many planes, which makes shadows when the camera is a
// light.
//
// Samples, steps and parts of steps are those of march.glsl, so layers add up to its picture.
// LayerMarch defines LAYERS or SLICES (counts), and with LAYERS: REFERENCE, PHONG, SHADOWS.

layout(local_size_x = 64) in;

layout(std430, binding = 0) writeonly buffer Planes { float planes[]; };
layout(std430, binding = 1) readonly buffer Tiles { vec4 tiles[]; };  // see TilePlan
uniform int firstTile;

uniform ivec2 size;           // of the whole picture
uniform ivec2 band;           // first row, rows

int planeSize, place;

// The planes are zero to begin with.
void putAt(int plane, float value) { planes[plane * planeSize + place] = value; }

#ifdef UNEVEN
#define SAMPLE(z) fieldAt(placeAt(origin + (z) * direction))
#else
#define SAMPLE(z) fieldAt(placeOf(node0 + (z) * nodeDirection))
#endif

vec3 origin, direction;
vec2 inBox;  // z of entry and exit

#ifdef SLICES
uniform float sliceDepth;  // planes stand at z = (i + 1) * sliceDepth

int nextSlice = 0;

// Optical depth ta .. tb, as far as it is in [0, tauEnd], between depths za and zb.
void pass(float ta, float tb, float tauEnd, float za, float zb) {
  for (; nextSlice < SLICES && float(nextSlice + 1) * sliceDepth < zb; ++nextSlice) {
    float share = clamp((float(nextSlice + 1) * sliceDepth - za) / (zb - za), 0.0, 1.0);
    putAt(nextSlice, clamp(mix(ta, tb, share), 0.0, tauEnd));
  }
}
#else
layout(std430, binding = 2) readonly buffer Fronts { vec2 fronts[]; };  // T in front; at the far end

// Boundaries 0 and LAYERS stand where this share of the ray's opacity is still to come, or has been
// met. What is beyond belongs to the outermost layers all the same.
uniform float outer;
#ifdef SHADOWS
uniform sampler3D lightDepth;  // optical depth toward the light
uniform mat4 lightFromLocal;   // to its texture coordinates
uniform float ambient;
#endif

const float kHidden = 6e-5;  // nobody sees what less light than this passes

float frontT, taken;  // in front of the block; 1 - T at the far end
int layer = 0, boundary = 0;
vec3 light = vec3(0.0);  // of the layer so far

float splitT(int i) { return 1.0 - float(i) / float(LAYERS) * taken; }
float boundaryT(int i) {
  return i == 0 ? 1.0 - outer * taken : i == LAYERS ? 1.0 - (1.0 - outer) * taken : splitT(i);
}

void putBoundary(float z) {
  putAt(boundary, clamp(z, inBox.x, inBox.y) + 1.0);  // 0 stands for none
  ++boundary;
}

void putLight() {
  for (int c = 0; c < 3; ++c) {
    if (light[c] != 0.0) putAt(LAYERS + 1 + 3 * layer + c, light[c]);
  }
  light = vec3(0.0);
}

// Optical depth ta .. tb, as far as it is in [0, tauEnd], between depths za and zb, of one colour:
// light per opacity.
void pass(vec3 color, float ta, float tb, float tauEnd, float za, float zb) {
  float front = frontT * exp(-clamp(ta, 0.0, tauEnd)), back = frontT * exp(-clamp(tb, 0.0, tauEnd));
  for (; boundary <= LAYERS && back <= boundaryT(boundary);) {
    float share = (-log(boundaryT(boundary) / frontT) - ta) / max(tb - ta, 1e-30);
    putBoundary(mix(za, zb, clamp(share, 0.0, 1.0)));
  }
  for (; layer < LAYERS - 1 && back <= splitT(layer + 1);) {
    float split = min(splitT(layer + 1), front);
    light += (front - split) * color;
    front = split;
    putLight();
    ++layer;
  }
  light += (front - back) * color;
}

// What is left of a point's own colour at depth z, and white added to it.
vec2 shading(float z) {
#if defined(SHADOWS)
  vec3 at = (lightFromLocal * vec4(origin + z * direction, 1.0)).xyz;
  return vec2(ambient + (1.0 - ambient) * exp(-texture(lightDepth, at).r), 0.0);
#elif defined(PHONG)
  float facing = abs(dot(normalAt(origin + z * direction, direction), normalize(direction)));
  return vec2(0.3 + 0.7 * facing, 0.2 * pow(facing, 32.0));
#else
  return vec2(1.0, 0.0);
#endif
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
  origin = originAt[0] + at.x * originAt[1] + at.y * originAt[2];
  direction = directionAt[0] + at.x * directionAt[1] + at.y * directionAt[2];
  vec3 node0 = origin * nodesFromLocal + nodesOrigin, nodeDirection = direction * nodesFromLocal;
  float lengthPerDepth = length(direction), stepLength = stepDepth * lengthPerDepth;
  inBox = clipToBox(origin, direction);
  if (!(inBox.x < inBox.y)) return;

#ifndef SLICES
  frontT = fronts[place].x;
  taken = 1.0 - fronts[place].y;
  // What was passed in front of this block, to the last bit; blocks there say where.
  while (boundary <= LAYERS && frontT <= boundaryT(boundary)) putBoundary(inBox.x);
  while (layer < LAYERS - 1 && frontT <= splitT(layer + 1)) ++layer;
#endif

  // The march begins at the sample before the entry; what it meets before the entry counts for
  // nothing: optical depth is counted from there.
  float zIn = max(inBox.x, tile.z), zOut = min(inBox.y, tile.w);
  float index = floor(zIn / stepDepth), tau0 = 0.0;
  if (zIn < zOut) {
    float f0 = SAMPLE(index * stepDepth), f1 = SAMPLE((index + 1.0) * stepDepth);
    float shareIn = clamp(zIn / stepDepth - index, 0.0, 1.0);
    // Along a step what values become is as straight as they are, wherever it is cut.
    float valueIn =
        between(VALUE(f0, index * stepDepth), VALUE(f1, (index + 1.0) * stepDepth), shareIn);
    Base base0 = baseAt(VALUE(f0, index * stepDepth));
    tau0 = (index * stepDepth - zIn) * lengthPerDepth * FACTOR((index + 0.5) * stepDepth)
           meanUpTo(shareIn, f0, f1, base0, baseAt(valueIn));
    bool seen;
    do {
#ifdef SKIP
      // Skip bricks that hold nothing but transparent values.
      float lastSample = floor(zOut / stepDepth), to = index;
      bool skips;
      do {
        ivec3 brick = brickAt(origin + (to + 1.0) * stepDepth * direction);
        vec4 range = texelFetch(bricks, brick, 0);
        skips = range.x >= 0.0 && range.w == base0.integral && base0.extinction == 0.0 &&
                to < lastSample;
        float leaves = floor(leavesBrick(brick, origin, direction) / stepDepth);
        to = skips ? min(max(leaves, to + 1.0), lastSample) : to;
      } while (skips);
      if (to > index) {
        index = to;
        f0 = SAMPLE(index * stepDepth);
        base0 = baseAt(VALUE(f0, index * stepDepth));
      }
#endif
      float z0 = index * stepDepth, z1 = z0 + stepDepth;
      f1 = SAMPLE((index + 1.0) * stepDepth);
      Base base1 = baseAt(VALUE(f1, z1));
      float zMiddle = 0.5 * (z0 + z1);
      float tau1 = tau0 + stepLength * FACTOR(zMiddle) meanExtinction(f0, f1, base0, base1);
      float tauEnd = kInfinity;
      if (z1 >= zOut) {
        float shareOut = clamp(zOut / stepDepth - index, 0.0, 1.0);
        float valueOut = between(VALUE(f0, z0), VALUE(f1, z1), shareOut);
        tauEnd = max(tau0 + (zOut - z0) * lengthPerDepth * FACTOR(zMiddle)
                                meanUpTo(shareOut, f0, f1, base0, baseAt(valueOut)),
                     0.0);
      }
      // The depths between which there is data.
      float middle = middleOf(f0, f1);
      float zFrom = mix(z0, z1, 2.0 * max(middle - 0.5, 0.0));
      float zTo = mix(z0, z1, 2.0 * min(middle, 0.5));
#ifdef SLICES
      pass(tau0, tau1, tauEnd, zFrom, zTo);
      seen = tau0 < 60.0;
#else
      if (tau1 > tau0) {
        Base a = baseAtStart(f0, base0, base1), start = a, end = baseAtEnd(f1, base0, base1);
        float parts = segmentParts(start, end, tau0, tau1), i = 0.0;
        float weight = integralBetween(start, end), ta = tau0, za = zFrom;
        vec2 shade = shading(mix(z0, z1, middle));
        SHIFT(zMiddle)
        float value0 = VALUE(f0, z0), value1 = VALUE(f1, z1);
        do {
          i += 1.0;
          float share = min(i / parts, 1.0), zb = mix(zFrom, zTo, share), tb = tau1;
          Base b = end;
          if (share < 1.0) {
            b = baseAt(mix(value0, value1, share));
            tb = tau0 + (tau1 - tau0) *
                            (abs(weight) > 0.0 ? integralBetween(start, b) / weight : share);
          }
          pass(shade.x * meanColor(a, b) + shade.y, ta, tb, tauEnd, za, zb);
          a = b;
          ta = tb;
          za = zb;
        } while (i < parts);
      }
      seen = frontT * exp(-tau0) > kHidden;
#endif
      tau0 = min(tau1, tauEnd);
      f0 = f1;
      base0 = base1;
      index += 1.0;
    } while (index * stepDepth < zOut && seen);
  }
  tau0 = max(tau0, 0.0);
#ifdef SLICES
  while (nextSlice < SLICES) putAt(nextSlice++, tau0);
#else
  putLight();
  putAt(4 * LAYERS + 1, tau0);
#endif
}
