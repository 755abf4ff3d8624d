#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
// One triangle that covers the viewport; no attributes.
precision highp float;

void main() {
  vec2 corner = vec2(float((gl_VertexID & 1) * 4 - 1), float((gl_VertexID & 2) * 2 - 1));
  gl_Position = vec4(corner, 0.0, 1.0);
}
