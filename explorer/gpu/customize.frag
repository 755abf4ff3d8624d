#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
// Position-dependent classification of a depth layer (classification §6): each pixel's surface has a place,
// at which the factor and the shift of colour are looked up.
precision highp float;
precision highp int;
precision highp sampler3D;
precision highp sampler2DArray;

uniform sampler2DArray colors, depth;
uniform int layer;
uniform vec4 unproject;         // as in light.frag
uniform mat4 customFromEye;     // to texture coordinates
uniform sampler3D customOptics;

layout(location = 0) out vec4 color;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  color = texelFetch(colors, ivec3(pixel, layer), 0);
  float z = texelFetch(depth, ivec3(pixel, layer), 0).r;
  if (color.a <= 0.0 || z > 1e29) return;
  vec2 across = (vec2(pixel) + 0.5 - 0.5 * vec2(textureSize(depth, 0).xy)) *
                vec2(unproject.x, -unproject.x);
  float radius = max(length(across), 1e-30);
  across *= max(1.0 - unproject.w * z / radius, 0.0);
  vec3 eye = vec3(across * (unproject.y > 0.5 ? z : 1.0), -z);
  vec4 custom = texture(customOptics, (customFromEye * vec4(eye, 1.0)).xyz);
  vec3 own = color.rgb / color.a;
  if (custom.gba != vec3(0.0)) own = clamp(own + custom.gba, 0.0, 1.0);
  float alpha = custom.r == 1.0   ? color.a
                : custom.r <= 0.0 ? 0.0
                                  : 1.0 - pow(max(1.0 - color.a, 1e-9), custom.r);
  color = vec4(own * alpha, alpha);
}
