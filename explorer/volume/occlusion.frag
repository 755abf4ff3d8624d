#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
// Local ambient occlusion of a layer of cells: the mean transmittance from a cell to the radius
// through extinction that was reduced before. Where extinction falls off, rays start one cell
// farther out and count by the cosine to that direction, as on a surface; where it does not, all
// directions count.
precision highp float;
precision highp int;
precision highp sampler3D;

uniform sampler3D extinction;  // 1 / world unit
uniform int layer;
uniform float radius;          // world units
uniform mat3 gridFromWorld;    // of directions, to texture coordinates

out vec4 result;

const int kDirections = 24, kSteps = 6;

float extinctionOf(ivec3 cell) {
  bool inside = all(greaterThanEqual(cell, ivec3(0))) &&
                all(lessThan(cell, textureSize(extinction, 0)));
  return inside ? texelFetch(extinction, cell, 0).r : 0.0;
}

void main() {
  ivec3 cell = ivec3(gl_FragCoord.xy, layer);
  vec3 size = vec3(textureSize(extinction, 0));
  vec3 here = (vec3(cell) + 0.5) / size;
  vec3 before = vec3(extinctionOf(cell - ivec3(1, 0, 0)), extinctionOf(cell - ivec3(0, 1, 0)),
                     extinctionOf(cell - ivec3(0, 0, 1)));
  vec3 after = vec3(extinctionOf(cell + ivec3(1, 0, 0)), extinctionOf(cell + ivec3(0, 1, 0)),
                    extinctionOf(cell + ivec3(0, 0, 1)));
  float most = max(extinctionOf(cell), max(max(before.x, max(before.y, before.z)),
                                           max(after.x, max(after.y, after.z))));
  if (most == 0.0) {
    result = vec4(1.0);
    return;
  }
  vec3 fall = before - after;
  vec3 outward = fall * size * gridFromWorld;  // transposed: a gradient
  float surface = smoothstep(0.05, 0.5, length(fall) / most);
  if (dot(outward, outward) > 0.0) {
    outward = normalize(outward);
    vec3 way = abs(gridFromWorld * outward * size);
    here += gridFromWorld * outward * (surface / max(way.x, max(way.y, way.z)));
  }
  float sum = 0.0, weights = 0.0;
  for (int i = 0; i < kDirections; ++i) {
    // A spiral of even area over the sphere.
    float height = 1.0 - (float(i) + 0.5) * (2.0 / float(kDirections));
    float turn = 2.39996323 * float(i);
    vec3 direction = vec3(sqrt(1.0 - height * height) * vec2(cos(turn), sin(turn)), height);
    float weight = mix(1.0, max(dot(direction, outward), 0.0), surface);
    if (weight < 0.01) continue;
    vec3 way = gridFromWorld * direction;
    float depth = 0.0;
    for (int j = 0; j < kSteps; ++j) {
      vec3 at = here + (float(j) + 0.75) / float(kSteps) * radius * way;
      bool inside = all(greaterThanEqual(at, vec3(0.0))) && all(lessThanEqual(at, vec3(1.0)));
      depth += inside ? texture(extinction, at).r : 0.0;
    }
    sum += weight * exp(-depth * radius / float(kSteps));
    weights += weight;
  }
  // In the open half of all directions is hidden by a flat opaque face.
  result = vec4(min(1.0, mix(2.0, 1.0, surface) * sum / weights));
}
