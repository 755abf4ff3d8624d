#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
// Light on a depth layer: Blinn-Phong with movable lights and proxy ambient occlusion
// [Tikhonova 2010, §5, eq. 5]. rgb = ambient and diffuse light, a = specular.
precision highp float;
precision highp int;
precision highp sampler2DArray;

uniform sampler2DArray depth;   // planar Z, +inf = nothing
uniform sampler2DArray normals; // eye space; zero = derive from depth
uniform int layer;
uniform vec4 unproject;         // eye xy = (pixel - size / 2) * (x, -x) * (perspective ? Z : 1), made
                                // shorter by w Z: x = world per pixel, y = perspective ? 1 : 0,
                                // z = silhouette jump, w = 1 / κ of a multi-perspective camera or 0
uniform int lights;
uniform vec4 lightFrom[8];      // unit direction to the light, intensity
uniform vec4 material;          // ambient, diffuse, specular, shininess
uniform vec4 viewer;            // direction to the viewer (w = 0) or position (w = 1)
uniform mat4 stretch;           // eye space to the scene, where a look stretches the world
uniform mat3 stretchNormal;
uniform bool shade;
uniform bool derive;
uniform vec2 ao;                // strength (0 = off), radius in world units

out vec4 result;

const float kPi = 3.14159265;
const int kSlices = 8, kSteps = 6;
const float kFlat = 0.01;  // a rise that is none, as a sine

ivec2 size() { return textureSize(depth, 0).xy; }

float depthAt(ivec2 pixel) {
  if (any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, size()))) return 1e30;
  return min(texelFetch(depth, ivec3(pixel, layer), 0).r, 1e30);
}

vec3 positionAt(vec2 center, float z) {
  vec2 across = (center - 0.5 * vec2(size())) * vec2(unproject.x, -unproject.x);
  across *= max(1.0 - unproject.w * z / max(length(across), 1e-30), 0.0);
  return (stretch * vec4(across * (unproject.y > 0.5 ? z : 1.0), -z, 1.0)).xyz;
}

float pixelWorld(float z) { return unproject.x * (unproject.y > 0.5 ? z : 1.0); }

// The difference of positions along one axis on the side where depth changes less; never across
// a silhouette. Zero where both sides are cut off.
vec3 tangent(ivec2 pixel, ivec2 axis, float z) {
  float before = depthAt(pixel - axis), after = depthAt(pixel + axis);
  float jump = unproject.z * pixelWorld(z);
  bool useBefore = abs(before - z) < jump, useAfter = abs(after - z) < jump;
  vec2 here = vec2(pixel) + 0.5;
  vec3 center = positionAt(here, z);
  vec3 low = useBefore ? positionAt(here - vec2(axis), before) : center;
  vec3 high = useAfter ? positionAt(here + vec2(axis), after) : center;
  return high - low;
}

vec3 derivedNormal(ivec2 pixel, float z) {
  vec3 right = tangent(pixel, ivec2(1, 0), z), down = tangent(pixel, ivec2(0, 1), z);
  if (dot(right, right) == 0.0) right = mat3(stretch) * vec3(pixelWorld(z), 0.0, 0.0);
  if (dot(down, down) == 0.0) down = mat3(stretch) * vec3(0.0, -pixelWorld(z), 0.0);
  return normalize(cross(down, right));  // rows run downward: this side faces the viewer
}

// The integral of cos(angle - tilt) |sin(angle)| from 0, the viewer's direction, to `angle`.
float arc(float angle, float tilt) {
  return 0.25 * (cos(tilt) - cos(2.0 * angle - tilt) + 2.0 * angle * sin(tilt));
}

// The share of the hemisphere around n, by the cosine rule, that the layer's own neighbourhood
// covers. The kernel is the projection of that hemisphere into the picture, hence anisotropic: it is
// cut into slices through the line of sight, and what a neighbour covers of its slice is all below
// its rise above the tangent plane, the clamped <P(q) - P(p), n> of eq. 5. Neighbours behind one
// another cover the same directions, so the greatest rise on each side counts.
float occlusion(vec2 pixel, float depth, vec3 position, vec3 n) {
  vec2 across = (pixel - 0.5 * vec2(size())) * vec2(1.0, -1.0);
  vec2 fromPole = across / max(length(across), 1e-30);
  vec3 sight = unproject.y > 0.5 ? vec3(-across * unproject.x, 1.0)
                                 : vec3(unproject.w * fromPole, 1.0);
  sight = normalize(mat3(stretch) * sight);
  float least = min(length(stretch[0].xyz), length(stretch[1].xyz));
  float reach = ao.y / (pixelWorld(depth) * least);
  float sum = 0.0;
  for (int i = 0; i < kSlices; ++i) {
    float turn = kPi * float(i) / float(kSlices);
    vec2 along = vec2(cos(turn), sin(turn));
    vec3 side = mat3(stretch) * vec3(along.x, -along.y, 0.0);
    side = normalize(side - dot(side, sight) * sight);
    vec2 inSlice = vec2(dot(n, side), dot(n, sight));
    float steepest = max(length(inSlice), 1e-6);  // the greatest sine of a rise in this slice
    float tilt = atan(inSlice.x, inSlice.y);
    float first = fract(0.61803399 * float(i));
    for (float way = -1.0; way < 2.0; way += 2.0) {
      float greatest = 0.0;
      for (int j = 0; j < kSteps; ++j) {
        float t = (float(j) + first) / float(kSteps);
        vec2 at = floor(pixel + way * (1.0 + (reach - 1.0) * t) * along);
        float z = depthAt(ivec2(at));
        vec3 toward = positionAt(at + 0.5, z) - position;
        float far = length(toward) / ao.y;
        if (far > 0.0 && far < 1.0) {
          greatest = max(greatest, dot(toward, n) / (ao.y * far) - kFlat);
        }
      }
      // From the tangent plane up to the horizon, which cannot hide the viewer.
      float plane = max(0.5 * kPi + way * tilt, 0.0);
      float horizon = max(plane - asin(min(greatest / steepest, 1.0)), 0.0);
      sum += steepest * (arc(plane, way * tilt) - arc(horizon, way * tilt));
    }
  }
  return sum / float(kSlices);
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float z = depthAt(pixel);
  if (z > 1e29) {
    result = vec4(1.0, 1.0, 1.0, 0.0);
    return;
  }
  vec3 position = positionAt(vec2(pixel) + 0.5, z);
  vec3 n = texelFetch(normals, ivec3(pixel, layer), 0).xyz;
  n = derive || dot(n, n) < 0.25 ? derivedNormal(pixel, z) : stretchNormal * n;
  n = normalize(n);
  float open = ao.x > 0.0 ? max(0.0, 1.0 - ao.x * occlusion(vec2(pixel) + 0.5, z, position, n)) : 1.0;
  if (!shade) {
    result = vec4(vec3(open), 0.0);
    return;
  }
  vec3 toViewer = viewer.w > 0.5 ? normalize(viewer.xyz - position) : viewer.xyz;
  float diffuse = 0.0, specular = 0.0;
  for (int i = 0; i < lights; ++i) {
    vec3 toLight = lightFrom[i].xyz;
    float facing = max(dot(n, toLight), 0.0);
    diffuse += lightFrom[i].w * facing;
    vec3 halfway = normalize(toLight + toViewer);
    if (facing > 0.0) specular += lightFrom[i].w * pow(max(dot(n, halfway), 0.0), material.w);
  }
  result = vec4(vec3(open * (material.x + material.y * diffuse)), open * material.z * specular);
}
