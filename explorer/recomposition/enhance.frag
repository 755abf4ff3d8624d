#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
// Depth-aware enhancement [Tikhonova 2010, §6.5, eq. 11]: r = λ Σ_k ‖∇_xy a_k‖^γ.
precision highp float;
precision highp int;
precision highp sampler2DArray;

uniform sampler2DArray attenuation;  // [group] a_k of channels 4 group .. 4 group + 3
uniform int groups;
uniform float lambda;
uniform float gamma;
uniform float gradientScale;         // pixels per unit of length of the gradient

out vec4 result;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  ivec2 last = textureSize(attenuation, 0).xy - 1;
  ivec2 low = max(pixel - 1, ivec2(0)), high = min(pixel + 1, last);
  // One-sided at the border; a picture one pixel wide has no gradient across.
  vec2 scale = gradientScale / vec2(max(high - low, ivec2(1)));
  float sum = 0.0;
  for (int g = 0; g < groups; ++g) {
    vec4 dx = texelFetch(attenuation, ivec3(high.x, pixel.y, g), 0) -
              texelFetch(attenuation, ivec3(low.x, pixel.y, g), 0);
    vec4 dy = texelFetch(attenuation, ivec3(pixel.x, high.y, g), 0) -
              texelFetch(attenuation, ivec3(pixel.x, low.y, g), 0);
    vec4 size = sqrt(dx * dx * scale.x * scale.x + dy * dy * scale.y * scale.y);
    sum += dot(pow(max(size, vec4(1e-12)), vec4(gamma)), vec4(1.0));
  }
  result = vec4(clamp(lambda * sum, 0.0, 1.0), 0.0, 0.0, 1.0);
}
