#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
// Epipolar ray casting of piecewise-analytic layers [Lochmann 2016, §3.3]. A ray of
// the new view is a line in the stored picture: its pixels are walked, in each the ray crosses some
// of the pixel's layers, homogeneous media that have a closed form, front to back.
//
// AnalyticLayerPass defines LAYERS (count) and CUSTOM.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;
precision highp usampler2DArray;

// Boundaries as levels of depth in 16 bits, eight a texel; after the last one the pixel's state
// (AnalyticLayerState).
uniform usampler2DArray boundaries;
uniform sampler2DArray media;  // per layer: light per opacity, extinction per unit of length
uniform sampler2D tiles;       // per kTile^2 pixels: nearest, farthest level; z = 1: some saturated
uniform ivec2 sourceSize;

// Homogeneous place in the stored picture, (x w, y w, w, level w'), of the point at depth t of the
// new ray through (x, y), both in [-1/2, 1/2] from the top left: origin + t direction, each
// [0] + x [1] + y [2]. Level is not divided by w.
uniform vec4 originAt[3], directionAt[3];
// The same in units in which the domain is [-1, 1]^3. A boundary may stand as much as `margin`
// outside of it.
uniform vec3 boxOriginAt[3], boxDirectionAt[3], margin;
uniform float marginLevels;
uniform vec3 lengthAt[3];  // the direction of length
uniform vec2 targetSize;
uniform float pixelStep;   // pixels a texel of the target: 2 for probes
uniform float firstDepth;  // t of the camera plane
uniform float opaque;      // rays end where so much light is left

#ifdef CUSTOM
// Position-dependent classification (classification §6): factor of extinction, shift of colour.
uniform highp sampler3D customOptics;
uniform vec3 customFromBox;  // texture coordinate = 1/2 + place in [-1, 1]^3 * this
#endif

layout(location = 0) out vec4 color;
layout(location = 1) out vec4 info;  // g = light that came by space that is not stored

// Boundaries of neighbours that differ by less than this are one surface, which the ray meets where
// it is between the two pixels; others end at the pixel's edge.
uniform float longestJump;

const int kTile = 8;
const int kSlots = LAYERS + 2, kState = LAYERS + 1;
const float kFar = 1e30;

struct Column {
  float at[kSlots];  // boundaries, state
};

Column columnAt(ivec2 pixel) {
  Column column;
  for (int i = 0; i < kSlots; i += 8) {
    uvec4 texel = texelFetch(boundaries, ivec3(pixel, i / 8), 0);
    for (int j = 0; j < 8; ++j) {
      if (i + j < kSlots) {
        column.at[i + j] = float((texel[j >> 1] >> uint(16 * (j & 1))) & 0xffffu);
      }
    }
  }
  return column;
}

// A boundary on the edge between its pixel and the neighbour.
float between(float own, float other, float otherState) {
  return otherState > 0.0 && abs(other - own) < longestJump ? 0.5 * (own + other) : own;
}

// Where (a + t b) is `edge` times (c + t d).
float crossing(float a, float b, float c, float d, float edge) {
  float rate = b - edge * d;
  return rate == 0.0 ? kFar : (edge * c - a) / rate;
}

// Between which t the ray is on the inner side of a + t b >= 0.
void clipTo(float a, float b, inout vec2 t) {
  if (b == 0.0) {
    if (a < 0.0) t = vec2(kFar, -kFar);
  } else if (b > 0.0) {
    t.x = max(t.x, -a / b);
  } else {
    t.y = min(t.y, -a / b);
  }
}

// Where a ray at t leaves the pixels low .. high, the next pixel, and whether that is beside them.
float leavePixels(ivec2 low, ivec2 high, vec4 o, vec4 d, float t, vec2 seen, float slack,
                  bool right, bool down, out bool across, out ivec2 to) {
  // A ray that runs beside an edge, or toward its vanishing point, does not cross.
  vec2 leave = vec2(crossing(o.x, d.x, o.z, d.z, float(right ? high.x + 1 : low.x)),
                    crossing(o.y, d.y, o.z, d.z, float(down ? high.y + 1 : low.y)));
  leave = mix(max(leave, vec2(t)), vec2(kFar), lessThan(leave, vec2(seen.x - slack)));
  float next = min(min(leave.x, leave.y), seen.y);
  // The other coordinate stays within what is passed.
  across = leave.x <= leave.y;
  vec3 there = o.xyz + next * d.xyz;
  to = clamp(ivec2(floor(there.xy / there.z)), low, min(high, sourceSize - 1));
  if (across) {
    to.x = right ? high.x + 1 : low.x - 1;
  } else {
    to.y = down ? high.y + 1 : low.y - 1;
  }
  return next;
}

void main() {
  vec2 at = ((gl_FragCoord.xy - 0.5) * pixelStep + 0.5) / targetSize - 0.5;
  vec4 o = originAt[0] + at.x * originAt[1] + at.y * originAt[2];
  vec4 d = directionAt[0] + at.x * directionAt[1] + at.y * directionAt[2];
  vec3 bo = boxOriginAt[0] + at.x * boxOriginAt[1] + at.y * boxOriginAt[2];
  vec3 bd = boxDirectionAt[0] + at.x * boxDirectionAt[1] + at.y * boxDirectionAt[2];
  float lengthPerT = length(lengthAt[0] + at.x * lengthAt[1] + at.y * lengthAt[2]);
  color = vec4(0.0);
  info = vec4(0.0);

  // In the domain; then in front of the stored camera and within its picture. What is in the domain
  // alone is not stored.
  vec2 inBox = vec2(firstDepth, kFar), seen = inBox;
  for (int axis = 0; axis < 3; ++axis) {
    clipTo(1.0 + bo[axis], bd[axis], inBox);
    clipTo(1.0 - bo[axis], -bd[axis], inBox);
    clipTo(1.0 + margin[axis] + bo[axis], bd[axis], seen);
    clipTo(1.0 + margin[axis] - bo[axis], -bd[axis], seen);
  }
  if (!(seen.x < seen.y)) return;
  vec2 picture = vec2(sourceSize);
  clipTo(o.z - 1e-6, d.z, seen);
  clipTo(o.x, d.x, seen);
  clipTo(o.y, d.y, seen);
  clipTo(picture.x * o.z - o.x, picture.x * d.z - d.x, seen);
  clipTo(picture.y * o.z - o.y, picture.y * d.z - d.y, seen);
  float slack = 1e-4 * (inBox.y - inBox.x);
  if (!(seen.x < seen.y)) {
    info.g = inBox.x < inBox.y ? 1.0 : 0.0;
    return;
  }
  float unseen = seen.x > inBox.x + slack ? 1.0 : 0.0;

  // Which way the ray goes in the picture.
  bool right = d.x * o.z - o.x * d.z > 0.0, down = d.y * o.z - o.y * d.z > 0.0;
  ivec2 way = ivec2(right ? 1 : -1, down ? 1 : -1);
  float t = seen.x;
  vec3 here = o.xyz + t * d.xyz;
  ivec2 last = sourceSize - 1;
  ivec2 pixel = clamp(ivec2(floor(here.xy / here.z)), ivec2(0), last), came = pixel;
  vec3 light = vec3(0.0);
  float left = 1.0;

  // Where rays run side by side in the lanes of a vector unit an `if` saves nothing, and a loop ends
  // with its last lane: so tiles, their pixels and the layers that are crossed are loops.
  bool ends = false;
  int most = sourceSize.x + sourceSize.y;
  for (int n = 0; n < most && !ends; ++n) {
    ivec2 tile = pixel / kTile, low = tile * kTile, high = low + kTile - 1, to;
    bool across;
    float next = leavePixels(low, high, o, d, t, seen, slack, right, down, across, to);
    vec2 level = o.w + vec2(t, next) * d.w;
    vec4 inTile = texelFetch(tiles, tile, 0);
    if (max(level.x, level.y) < inTile.x ||
        (min(level.x, level.y) > inTile.y && inTile.z == 0.0)) {
      // The ray passes by all that is in the tile.
      ends = next >= seen.y || to != clamp(to, ivec2(0), last);
      came = across ? ivec2(to.x - way.x, to.y) : ivec2(to.x, to.y - way.y);
      pixel = ends ? pixel : to;
      t = next;
      continue;
    }
    Column before = columnAt(came), own = columnAt(pixel);
    bool inside;
    do {
      next = leavePixels(pixel, pixel, o, d, t, seen, slack, right, down, across, to);
      ends = next >= seen.y || to != clamp(to, ivec2(0), last);
      to = clamp(to, ivec2(0), last);
      Column after = columnAt(to);
      float state = own.at[kState], afterState = ends ? 0.0 : after.at[kState];
      level = o.w + vec2(t, next) * d.w;
      // Which share of the way is behind each boundary. Both are straight. A layer keeps its optical
      // depth, whatever its neighbours make of its length.
      float behind[LAYERS + 2], middle[LAYERS + 2], weight[LAYERS + 2];
      float sinks = 0.0;
      for (int i = 0; i <= LAYERS; ++i) {
        vec2 above = level - vec2(between(own.at[i], before.at[i], before.at[kState]),
                                  between(own.at[i], after.at[i], afterState));
        sinks += above.y - above.x;
        middle[i] = 0.5 * (level.x + level.y - above.x - above.y);
        behind[i] = clamp(max(above.x, above.y) / max(abs(above.y - above.x), 1e-3), 0.0, 1.0);
      }
      bool away = sinks >= 0.0;
      float path = state > 0.0 ? (next - t) * lengthPerT : 0.0;
      int first = LAYERS, final = -1;  // of those that are crossed
      for (int i = 0; i < LAYERS; ++i) {
        float share = max(behind[i] - behind[i + 1], 0.0);
        weight[i] = path * share * clamp((own.at[i + 1] - own.at[i]) /
                                             max(middle[i + 1] - middle[i], 1.0), 0.25, 4.0);
        first = share > 0.0 ? min(first, i) : first;
        final = share > 0.0 ? i : final;
      }
      float far = max(level.x, level.y) - own.at[LAYERS] - marginLevels;
      bool hidden = state > 1.5 && far > 0.0 && behind[LAYERS] > 0.0;
      if (hidden && !away) unseen = max(unseen, left);
      int layer = away ? first : final;
      do {
        float along = 0.0;
        for (int i = 0; i < LAYERS; ++i) along = i == layer ? weight[i] : along;
        vec4 medium = texelFetch(media, ivec3(pixel, clamp(layer, 0, LAYERS - 1)), 0);
#ifdef CUSTOM
        float back = 0.0;
        for (int i = 0; i < LAYERS; ++i) back = i == layer ? 0.5 * (behind[i] + behind[i + 1]) : back;
        vec3 place = bo + bd * mix(t, next, away ? 1.0 - back : back);
        vec4 custom = texture(customOptics, place * customFromBox + 0.5);
        if (custom.gba != vec3(0.0)) medium.rgb = clamp(medium.rgb + custom.gba, 0.0, 1.0);
        medium.a *= custom.r;
#endif
        float passed = exp(-medium.a * along);
        light += left * (1.0 - passed) * medium.rgb;
        left *= passed;
        layer += away ? 1 : -1;
      } while (layer >= first && layer <= final);
      if (hidden && away) unseen = max(unseen, left);

      ends = ends || left < opaque;
      came = pixel;
      pixel = to;
      t = next;
      before = own;
      own = after;
      inside = pixel / kTile == tile;
    } while (inside && !ends);
  }
  if (left >= opaque && seen.y < inBox.y - slack) unseen = max(unseen, left);
  color = vec4(light, 1.0 - left);
  info.g = unseen;
}
