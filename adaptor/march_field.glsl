#version 430 core
// SPDX-License-Identifier: BSD-3-Clause
// The samples of a block as a field over local space: (world - centre) / scale, with the centre and
// the scale of the whole domain. Marcher puts this file, march_base.glsl and march.glsl together
// and defines AXIS_X, AXIS_Y, AXIS_Z for axes whose nodes are not evenly spaced, FILTER where the
// device does not filter float textures in full precision, and GAPS where samples without data
// occur.

uniform sampler3D volume;
uniform ivec3 nodeCount;
uniform vec3 textureFromLocal, textureOrigin;  // even axes: coordinate = local * from + origin
uniform sampler2D nodesX, nodesY, nodesZ;      // row 0: node, 1 / width, next node; row 1: guesses
uniform vec3 guesses[3];                       // per axis: low, cells / length, cells
uniform float scale;

const float kGap = 3e38;      // stands for a sample without data
const float kGapEdge = 2e38;  // everything above is such a sample
const float kInfinity = uintBitsToFloat(0x7f800000u);

#if defined(AXIS_X) || defined(AXIS_Y) || defined(AXIS_Z)
#define UNEVEN
#endif

// Along an axis of uneven nodes, the texture coordinate. A table of guesses names a node at or
// before x; the search goes on from there.
float searchNodes(sampler2D nodes, vec3 guess, int count, float x) {
  int cell = int(clamp((x - guess.x) * guess.y, 0.0, guess.z - 1.0));
  int i = int(texelFetch(nodes, ivec2(cell, 1), 0).x);
  vec4 node = texelFetch(nodes, ivec2(i, 0), 0);
  while (x >= node.z && i < count - 2) {
    ++i;
    node = texelFetch(nodes, ivec2(i, 0), 0);
  }
  float u = clamp((x - node.x) * node.y, 0.0, 1.0);
  return (float(i) + u + 0.5) / float(count);
}

// The way from coordinate a to b along such an axis.
float nodesBetween(sampler2D nodes, int count, float a, float b) {
  vec2 x = vec2(a, b) * float(count) - 0.5;
  ivec2 i = clamp(ivec2(x), 0, count - 2);
  vec4 from = texelFetch(nodes, ivec2(i.x, 0), 0), to = texelFetch(nodes, ivec2(i.y, 0), 0);
  return mix(to.x, to.z, x.y - float(i.y)) - mix(from.x, from.z, x.x - float(i.x));
}

vec3 textureAt(vec3 local) {
  vec3 t = local * textureFromLocal + textureOrigin;
#ifdef AXIS_X
  t.x = searchNodes(nodesX, guesses[0], nodeCount.x, local.x);
#endif
#ifdef AXIS_Y
  t.y = searchNodes(nodesY, guesses[1], nodeCount.y, local.y);
#endif
#ifdef AXIS_Z
  t.z = searchNodes(nodesZ, guesses[2], nodeCount.z, local.z);
#endif
  return t;
}

// Trilinear (method §1); NaN where a neighbour has no data.
float fieldAt(vec3 t) {
#ifdef FILTER
  vec3 x = clamp(t * vec3(nodeCount) - 0.5, vec3(0.0), vec3(nodeCount - 1));
  ivec3 a = ivec3(x);
  ivec3 b = min(a + 1, nodeCount - 1);
  vec3 u = x - vec3(a);
  vec4 low = vec4(texelFetch(volume, a, 0).x, texelFetch(volume, ivec3(b.x, a.yz), 0).x,
                  texelFetch(volume, ivec3(a.x, b.y, a.z), 0).x,
                  texelFetch(volume, ivec3(b.xy, a.z), 0).x);
  vec4 high = vec4(texelFetch(volume, ivec3(a.xy, b.z), 0).x,
                   texelFetch(volume, ivec3(b.x, a.y, b.z), 0).x,
                   texelFetch(volume, ivec3(a.x, b.yz), 0).x, texelFetch(volume, b, 0).x);
  vec4 plane = mix(low, high, u.z);
  vec2 row = mix(plane.xy, plane.zw, u.y);
  return mix(row.x, row.y, u.x);
#else
  return textureLod(volume, t, 0.0).x;
#endif
}

#ifdef SKIP
// The grid of bricks, SKIP cells a side: (channel, least, largest value, integral of
// the base function); see BrickGrid.
uniform sampler3D bricks;
uniform ivec3 lastBrick;
uniform vec3 brickLow, brickWidth;  // even axes: the lower face of brick i is at low + i * width

ivec3 brickAt(vec3 local) {
  vec3 node = textureAt(local) * vec3(nodeCount) - 0.5;
  return clamp(ivec3(max(node, vec3(0.0)) / float(SKIP)), ivec3(0), lastBrick);
}

// Where the ray leaves the brick; the outermost ones go on for ever, as the samples do.
float leavesBrick(ivec3 brick, vec3 origin, vec3 direction) {
  ivec3 face = brick + ivec3(greaterThan(direction, vec3(0.0)));
  vec3 at = brickLow + vec3(face) * brickWidth;
#ifdef AXIS_X
  at.x = texelFetch(nodesX, ivec2(face.x * SKIP, 0), 0).x;
#endif
#ifdef AXIS_Y
  at.y = texelFetch(nodesY, ivec2(face.y * SKIP, 0), 0).x;
#endif
#ifdef AXIS_Z
  at.z = texelFetch(nodesZ, ivec2(face.z * SKIP, 0), 0).x;
#endif
  vec3 z = (at - origin) / direction;
  z.x = direction.x == 0.0 || face.x == 0 || face.x > lastBrick.x ? kInfinity : z.x;
  z.y = direction.y == 0.0 || face.y == 0 || face.y > lastBrick.y ? kInfinity : z.y;
  z.z = direction.z == 0.0 || face.z == 0 || face.z > lastBrick.z ? kInfinity : z.z;
  return min(z.x, min(z.y, z.z));
}
#endif

float sampleAt(vec3 t) {
  float f = fieldAt(t);
#ifdef GAPS
  f = abs(f) < kGapEdge ? f : kGap;
#endif
  return f;
}

bool isGap(float f) {
#ifdef GAPS
  return f > kGapEdge;
#else
  return false;
#endif
}

// Differences between the points one node before and one after, in local units; at the border, to
// the outermost node only (method §1). Exact for linear fields on any nodes.
vec3 gradientAt(vec3 local) {
  vec3 voxel = 1.0 / vec3(nodeCount);
  vec3 first = 0.5 * voxel, last = 1.0 - first;
  vec3 t = clamp(textureAt(local), first, last);
  vec3 a = max(t - voxel, first), b = min(t + voxel, last), run = (b - a) / textureFromLocal;
#ifdef AXIS_X
  run.x = nodesBetween(nodesX, nodeCount.x, a.x, b.x);
#endif
#ifdef AXIS_Y
  run.y = nodesBetween(nodesY, nodeCount.y, a.y, b.y);
#endif
#ifdef AXIS_Z
  run.z = nodesBetween(nodesZ, nodeCount.z, a.z, b.z);
#endif
  vec3 rise = vec3(fieldAt(vec3(b.x, t.yz)) - fieldAt(vec3(a.x, t.yz)),
                   fieldAt(vec3(t.x, b.y, t.z)) - fieldAt(vec3(t.x, a.y, t.z)),
                   fieldAt(vec3(t.xy, b.z)) - fieldAt(vec3(t.xy, a.z)));
  return vec3(run.x > 0.0 ? rise.x / run.x : 0.0, run.y > 0.0 ? rise.y / run.y : 0.0,
              run.z > 0.0 ? rise.z / run.z : 0.0);
}

// Unit normal of the level set in world space, turned to the viewer of a ray along `direction`;
// straight at the viewer where the field has no slope or none that is known.
vec3 normalAt(vec3 local, vec3 direction) {
  vec3 toViewer = -normalize(direction);
  vec3 g = gradientAt(local);
  float steepest = max(abs(g.x), max(abs(g.y), abs(g.z)));
  if (!(steepest > 0.0 && steepest < kInfinity && dot(g, g) == dot(g, g))) return toViewer;
  vec3 n = normalize(g / steepest);
  return dot(n, toViewer) < 0.0 ? -n : n;
}
