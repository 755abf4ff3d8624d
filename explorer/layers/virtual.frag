#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
// Volumetric view synthesis of a multi-perspective view [Tikhonova 2010, §4.3.1]: a new ray is
// marched through the box; at each point the intervals of the stored pixel that saw it are looked
// up, and those whose start the ray has passed, but not their end, are added, each once.
precision highp float;
precision highp int;
precision highp usampler2D;

uniform usampler2D firstEntry;  // [pixel] index of the first word, 0xffffffff = none
uniform usampler2D entries;     // explorer/layers/virtual_pass.h SheetTextures
uniform int listWidthLog2;
uniform vec4 channels[67];      // linear rgb; w = -strength * unit * log2(e)

// Rays of the new view through (x, y), both in [-1/2, 1/2] from the top left: origin + t direction,
// each [0] + x [1] + y [2], t the planar depth. In the stored camera's eye space, and in units in
// which the domain is [-1, 1]^3.
uniform vec3 originAt[3], directionAt[3], boxOriginAt[3], boxDirectionAt[3];
uniform vec2 targetSize;
uniform vec2 pixelWorld;       // width and height of a stored pixel on the camera plane
uniform float lean;            // 1 / κ
uniform bool undistorted;      // look up at the undistorted place instead

layout(location = 0) out vec4 color;
layout(location = 1) out vec4 info;  // r = depth where half of the light is gone, g = guess

const float kFar = 1e30, kOpaque = 1.0 / 4096.0;
const int kMostSteps = 8192;

uint wordAt(uint index) {
  uint mask = (1u << uint(listWidthLog2)) - 1u;
  return texelFetch(entries, ivec2(index & mask, index >> uint(listWidthLog2)), 0).r;
}

// explorer/recomposition/segments.h amountBits.
float amountOf(uint word) { return uintBitsToFloat(((word & 0xffffu) << 12) + 0x33000000u); }

void main() {
  vec2 at = gl_FragCoord.xy / targetSize - 0.5;
  vec3 o = originAt[0] + at.x * originAt[1] + at.y * originAt[2];
  vec3 d = directionAt[0] + at.x * directionAt[1] + at.y * directionAt[2];
  vec3 bo = boxOriginAt[0] + at.x * boxOriginAt[1] + at.y * boxOriginAt[2];
  vec3 bd = boxDirectionAt[0] + at.x * boxDirectionAt[1] + at.y * boxDirectionAt[2];
  bd = mix(bd, vec3(1e-20), lessThan(abs(bd), vec3(1e-20)));
  vec3 a = (-sign(bd) - bo) / bd, b = (sign(bd) - bo) / bd;
  float enter = max(max(a.x, max(a.y, a.z)), 0.0), leave = min(b.x, min(b.y, b.z));

  ivec2 size = textureSize(firstEntry, 0);
  float stepT = min(pixelWorld.x, pixelWorld.y) / length(d);
  int steps = leave > enter ? int(min(ceil((leave - enter) / stepT), float(kMostSteps))) : 0;
  if (steps > 0) stepT = (leave - enter) / float(steps);
  float tolerance = abs(d.z) * stepT + max(pixelWorld.x, pixelWorld.y);

  vec3 sum = vec3(0.0);
  float left = 1.0, guess = 0.0, half_ = kFar;
  uint taken[3] = uint[3](0u, 0u, 0u);
  bool outside = false;
  for (int i = 0; i < steps && left > kOpaque; ++i) {
    float t = enter + (float(i) + 0.5) * stepT;
    vec3 p = o + t * d;
    float depth = -p.z, rho = max(length(p.xy), 1e-30);
    float stretch = undistorted ? 1.0 : 1.0 + lean * max(depth, 0.0) / rho;
    vec2 place = vec2(p.x, -p.y) * stretch / pixelWorld + 0.5 * vec2(size);
    ivec2 pixel = ivec2(floor(place));
    if (any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, size))) {
      if (!outside) guess += left;  // what is there nobody saw
      outside = true;
      continue;
    }
    uint index = texelFetch(firstEntry, pixel, 0).r;
    if (index == 0xffffffffu) continue;
    for (;;) {
      uint word = wordAt(index);
      float start = uintBitsToFloat(wordAt(index + 1u));
      float end = uintBitsToFloat(wordAt(index + 2u));
      index += 3u;
      if (depth < start) break;  // the rest starts farther away
      int channel = int((word >> 16) & 8191u);
      uint bit = 1u << uint(channel & 31);
      if (depth <= end + tolerance && (taken[channel >> 5] & bit) == 0u) {
        taken[channel >> 5] |= bit;
        vec4 look = channels[channel];
        float amount = amountOf(word), through = exp2(amount * look.w);
        float share = left * (1.0 - through);
        if ((word & 0x40000000u) != 0u) guess += share;
        sum += share * look.rgb;
        left *= through;
        if (left < 0.5) half_ = min(half_, t);
      }
      if ((word & 0x80000000u) != 0u) break;
    }
  }
  color = vec4(sum, 1.0 - left);
  info = vec4(half_, min(guess, 1.0), 0.0, 1.0);
}
