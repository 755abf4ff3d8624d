#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
// A depth layer drawn from another camera ([Tikhonova 2010, §4.3]: undistortion, eq. 3-4, and
// projection). No attributes. Whole surface: each pixel is a quad whose corners lie at the mean depth of the pixels
// around that belong to the same surface, so that neighbours join and silhouettes break. Mesh: the
// triangles between pixel centres; they close the cracks between quads that disagree about a corner,
// are stretched surface where silhouettes tear them, and bound unseen space where the gap is too
// long for that. Unseen: what bounds, with these, the space behind the layer, which no stored ray saw
// of it: its far ends where rays leave the domain, and walls from there to the silhouettes against
// nothing and to where the layer gets more opaque.
precision highp float;
precision highp int;
precision highp sampler2DArray;

uniform sampler2DArray depth;
uniform sampler2DArray normals;
uniform sampler2DArray colors;
uniform int layer;
uniform vec4 unproject;      // as in light.frag; z: jump in pixels that any slope may have
uniform mat4 clipFromEye;    // eye space of the layers' camera to clip space of the new one
uniform vec4 planarDepth;    // dot with the eye position (w = 1): planar Z from the new camera
uniform int part;            // 0 whole surface, 1 mesh, 2 unseen
uniform mat4 domainFromEye;  // of the layers' camera, to world axes from the domain's centre
uniform vec3 domainHalf;     // half the domain's extents
uniform float longestGap;    // a longer stretch would draw what is not there

flat out ivec2 ownPixel;
flat out int kind;           // 0 surface, 1 stretched surface, 2 bound of unseen space
out vec2 sourcePixel;        // in units of pixels, 0 at the centre of the first
out float newDepth;

float pixelWorld(float z) { return unproject.x * (unproject.y > 0.5 ? z : 1.0); }

// Of a pixel's centre, on the camera plane or, in perspective, at depth 1.
vec2 acrossAt(vec2 center) {
  return (center + 0.5 - 0.5 * vec2(textureSize(depth, 0).xy)) * vec2(unproject.x, -unproject.x);
}

vec3 eyeAt(vec2 center, float z) {
  vec2 across = acrossAt(center);
  float radius = max(length(across), 1e-30);
  across *= max(1.0 - unproject.w * z / radius, 0.0);
  return vec3(across * (unproject.y > 0.5 ? z : 1.0), -z);
}

float depthAt(ivec2 pixel) { return texelFetch(depth, ivec3(pixel, layer), 0).r; }

// Of the surface against the picture; a moderate one where no normal tells.
float slopeAt(ivec2 pixel) {
  vec3 n = texelFetch(normals, ivec3(pixel, layer), 0).xyz;
  // Against the ray, which leans toward the pole where rays converge.
  vec2 across = acrossAt(vec2(pixel));
  float facing = n.z + unproject.w * dot(n.xy, across) / max(length(across), 1e-30);
  return dot(n, n) < 0.25 ? 2.5 : min(length(n.xy) / max(facing, 0.05), 8.0);
}

// How far depth may differ between neighbours of one surface.
float jumpAt(ivec2 pixel, float z) {
  return pixelWorld(z) * (unproject.z + 2.0 * slopeAt(pixel));
}

const float kVisible = 1.0 / 255.0;

void place(bool present, vec2 center, float z) {
  float opacity = texelFetch(colors, ivec3(ownPixel, layer), 0).a;
  if (kind == 2 && opacity <= kVisible) present = false;  // what is not seen hides nothing
  vec3 eye = eyeAt(center, present ? z : 1.0);
  gl_Position = present ? clipFromEye * vec4(eye, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
  // Whole surface, mesh and unseen take a third of the depth range each: a guess never hides a
  // sample. Of the bounds of unseen space that of the most opaque pixel wins.
  float third = kind == 2 ? 1.0 - 2.0 * min(opacity, 1.0) : gl_Position.z / gl_Position.w;
  int range = kind == 2 ? 2 : part;
  if (present) gl_Position.z = (third + float(2 * range - 2)) * gl_Position.w / 3.0;
  newDepth = dot(planarDepth, vec4(eye, 1.0));
  sourcePixel = center;
}

void placeQuadCorner(int quad, ivec2 corner) {
  ivec2 size = textureSize(depth, 0).xy;
  ivec2 pixel = ivec2(quad % size.x, quad / size.x);
  float z = depthAt(pixel);
  ownPixel = pixel;
  if (z > 1e29) {
    place(false, vec2(pixel), z);
    return;
  }
  float sum = 0.0, count = 0.0, jump = jumpAt(pixel, z);
  for (int i = 0; i < 4; ++i) {
    ivec2 other = pixel + corner - ivec2(i & 1, i >> 1);
    if (any(lessThan(other, ivec2(0))) || any(greaterThanEqual(other, size))) continue;
    float zo = depthAt(other);
    if (zo > 1e29 || abs(zo - z) > max(jump, jumpAt(other, zo))) continue;
    sum += zo;
    count += 1.0;
  }
  place(true, vec2(pixel) + vec2(corner) - 0.5, sum / count);
}

void placeMeshCorner(int quad, int which, bool second) {
  int columns = textureSize(depth, 0).x - 1;
  ivec2 base = ivec2(quad % columns, quad / columns);
  // Two triangles: (0,0) (1,0) (0,1) and (1,1) (0,1) (1,0).
  ivec2 a = base + (second ? ivec2(1, 1) : ivec2(0, 0));
  ivec2 b = base + (second ? ivec2(0, 1) : ivec2(1, 0));
  ivec2 c = base + (second ? ivec2(1, 0) : ivec2(0, 1));
  float za = depthAt(a), zb = depthAt(b), zc = depthAt(c);
  float high = max(za, max(zb, zc)), low = min(za, min(zb, zc));
  bool present = high < 1e29;
  if (present) {
    float jump = max(jumpAt(a, za), max(jumpAt(b, zb), jumpAt(c, zc)));
    kind = high - low <= jump ? 0 : high - low <= longestGap ? 1 : 2;
  }
  ownPixel = za == low ? a : zb == low ? b : c;  // unseen space lies behind the nearest
  place(present, vec2(which == 0 ? a : which == 1 ? b : c),
        which == 0 ? za : which == 1 ? zb : zc);
}

// Planar depth at which a ray leaves the domain.
float exitDepth(vec2 center) {
  vec2 across = acrossAt(center);
  float radius = length(across);
  bool perspective = unproject.y > 0.5;
  vec3 start = perspective ? vec3(0.0) : vec3(across, 0.0);
  vec2 lean = perspective ? across : -unproject.w * across / max(radius, 1e-30);
  vec3 origin = (domainFromEye * vec4(start, 1.0)).xyz;
  vec3 along = (domainFromEye * vec4(lean, -1.0, 0.0)).xyz;
  along = mix(along, vec3(1e-12), lessThan(abs(along), vec3(1e-12)));
  vec3 far = (sign(along) * domainHalf - origin) / along;
  float exit = min(far.x, min(far.y, far.z));
  return unproject.w > 0.0 ? min(exit, radius / unproject.w) : exit;
}

// Walls stand where opacity passes a power of two, so that a ray that only crosses the shadow meets
// one of nearly the largest opacity in it.
int levelAt(ivec2 pixel) {
  float opacity = texelFetch(colors, ivec3(pixel, layer), 0).a;
  return depthAt(pixel) > 1e29 || opacity <= kVisible ? -9 : int(floor(log2(opacity)));
}

void placeUnseenCorner(int quad, int side, int which, bool second) {
  ivec2 size = textureSize(depth, 0).xy;
  ivec2 pixel = ivec2(quad % size.x, quad / size.x);
  float z = depthAt(pixel);
  ownPixel = pixel;
  ivec2 corner = which == 0 ? ivec2(0, 0) : which == 1 ? ivec2(1, 0) : ivec2(0, 1);
  if (second) corner = ivec2(1, 1) - corner;
  bool present = z < 1e29;
  bool isFar = true;
  if (side > 0) {  // toward the right or lower neighbour: corner.x runs along the edge, y in depth
    ivec2 other = pixel + (side == 1 ? ivec2(1, 0) : ivec2(0, 1));
    int steps = any(greaterThanEqual(other, size)) ? 0 : levelAt(other) - levelAt(pixel);
    present = steps != 0;
    if (steps > 0) ownPixel = other;
    z = depthAt(ownPixel);
    isFar = corner.y == 1;
    corner = side == 1 ? ivec2(1, corner.x) : ivec2(corner.x, 1);
  }
  vec2 center = vec2(pixel) + vec2(corner) - 0.5;
  place(present, center, isFar ? max(z, exitDepth(center)) : z);
}

void main() {
  int corners = part == 2 ? 18 : 6;
  int quad = gl_VertexID / corners, vertex = gl_VertexID - corners * quad;
  int side = vertex / 6;
  vertex -= 6 * side;
  kind = part == 2 ? 2 : 0;
  bool second = vertex >= 3;
  int which = vertex - (second ? 3 : 0);
  if (part == 2) {
    placeUnseenCorner(quad, side, which, second);
  } else if (part == 1) {
    placeMeshCorner(quad, which, second);
  } else {
    ivec2 corner = which == 0 ? ivec2(0, 0) : which == 1 ? ivec2(1, 0) : ivec2(0, 1);
    placeQuadCorner(quad, second ? ivec2(1, 1) - corner : corner);
  }
}
