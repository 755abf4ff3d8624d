#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
// Colour of a warped depth layer: the premultiplied colours of the four source pixels around,
// bilinear among those of the same surface, lit.
precision highp float;
precision highp int;
precision highp sampler2DArray;

uniform sampler2DArray depth;
uniform sampler2DArray normals;  // a = 1: the depth is no more than likely
uniform sampler2DArray colors;
uniform sampler2DArray light;
uniform vec4 unproject;
uniform bool lit;
uniform int layer;

flat in ivec2 ownPixel;
flat in int kind;                // as in warp.vert
in vec2 sourcePixel;
in float newDepth;

layout(location = 0) out vec4 color;
layout(location = 1) out vec4 position;  // r = planar Z in the new view, g = 1 where nothing was
                                         // sampled, b = how much of it is a guess

vec4 litColor(ivec2 pixel) {
  vec4 value = texelFetch(colors, ivec3(pixel, layer), 0);
  if (lit) {
    vec4 shine = texelFetch(light, ivec3(pixel, layer), 0);
    value.rgb = value.rgb * shine.rgb + value.a * shine.a;
  }
  return value;
}

void main() {
  if (kind == 2) {
    // No more of the layer lies behind a pixel than its whole ray holds.
    color = vec4(0.0);
    position = vec4(newDepth, 1.0, texelFetch(colors, ivec3(ownPixel, layer), 0).a, 1.0);
    return;
  }
  bool stretched = kind == 1;
  ivec2 last = textureSize(depth, 0).xy - 1;
  if (stretched) {
    // A mixture of both sides of a silhouette would be neither.
    color = litColor(clamp(ivec2(floor(sourcePixel + 0.5)), ivec2(0), last));
  } else {
    float own = texelFetch(depth, ivec3(ownPixel, layer), 0).r;
    float jump = unproject.x * (unproject.y > 0.5 ? own : 1.0) * (unproject.z + 4.0);
    ivec2 base = ivec2(floor(sourcePixel));
    vec2 part = sourcePixel - vec2(base);
    vec4 sum = vec4(0.0);
    float weights = 0.0;
    for (int i = 0; i < 4; ++i) {
      ivec2 step = ivec2(i & 1, i >> 1);
      ivec2 pixel = clamp(base + step, ivec2(0), last);
      float weight = (step.x == 1 ? part.x : 1.0 - part.x) * (step.y == 1 ? part.y : 1.0 - part.y);
      if (weight <= 0.0 || abs(texelFetch(depth, ivec3(pixel, layer), 0).r - own) > jump) continue;
      sum += weight * litColor(pixel);
      weights += weight;
    }
    color = weights > 0.0 ? sum / weights : litColor(ownPixel);
  }
  if (color.a <= 0.0) discard;  // what is not seen hides nothing
  // A surface seen from behind bounds space that no stored ray saw.
  bool likely = stretched || !gl_FrontFacing ||
                texelFetch(normals, ivec3(ownPixel, layer), 0).a > 0.5;
  position = vec4(newDepth, stretched ? 1.0 : 0.0, likely ? color.a : 0.0, 1.0);
}
