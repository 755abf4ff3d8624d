#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
// Lays probes and the pixels between them that are to be believed (between.frag) out over the
// picture, near; the others far, for rays to be cast there.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

uniform sampler2D probes, probeInfo;
uniform sampler2DArray between;  // right, below, across
uniform sampler2D betweenInfo;

layout(location = 0) out vec4 color;
layout(location = 1) out vec4 info;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy), at = pixel / 2, odd = pixel & 1;
  bool own = odd == ivec2(0);
  vec4 known = texelFetch(betweenInfo, at, 0);
  color = own ? texelFetch(probes, at, 0)
              : texelFetch(between, ivec3(at, max(odd.x + 2 * odd.y - 1, 0)), 0);
  info = own ? texelFetch(probeInfo, at, 0) : known;
  gl_FragDepth = own || known.b > 0.5 ? 0.0 : 1.0;
}
