#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
// One layer of the optics of a grid of fields, (σ c, σ) / scale: each cell by itself.
precision highp float;
precision highp int;
precision highp sampler3D;

uniform sampler3D values;
uniform int layer;
uniform vec4 parameters[PARAMETERS];
uniform vec4 channelOptics[CHANNELS];  // of a weight of 1, / scale
#ifdef GRADIENT
uniform sampler3D gradients;
#endif
#ifdef GAPS
uniform sampler3D mask;
#endif

out vec4 result;

#pragma classifier

void main() {
  ivec3 cell = ivec3(gl_FragCoord.xy, layer);
  vec4 own = texelFetch(values, cell, 0);
  float gradient = 0.0;
#ifdef GRADIENT
  gradient = texelFetch(gradients, cell, 0).r;
#endif
  result = vec4(0.0);
#ifdef GAPS
  if (texelFetch(mask, cell, 0).r < 0.5) return;
#endif
  float weights[CHANNELS];
  classify(own, own, gradient, gradient, weights);
  for (int i = 0; i < CHANNELS; ++i) result += weights[i] * channelOptics[i];
}
