#version 430 core
// SPDX-License-Identifier: BSD-3-Clause
// The samples of a block as a field over local space: (world - centre) / scale, with the centre and
// the scale of the whole domain. Marcher puts this file, march_base.glsl and march.glsl together
// and defines AXIS_X, AXIS_Y, AXIS_Z for axes whose nodes are not evenly spaced, and GAPS where
// samples without data occur.
//
// Nodes of even axes are counted from the domain's, so that blocks with ghost layers get the same
// bits for the same place: where a ray grazes a bound, how long it is in the interval turns on the
// last one.

uniform sampler2DArray volume;
uniform ivec3 nodeCount;
uniform vec3 nodesFromLocal, nodesOrigin;  // even axes: node = local * from + origin
uniform vec3 firstNode, lastNode;          // of the block; uneven axes count from 0
uniform vec2 texelSize, cornerOrigin;      // texture coordinates of the corner after a node
uniform sampler2D nodesX, nodesY, nodesZ;  // row 0: node, 1 / width, next node; row 1: guesses
uniform vec3 guesses[3];                   // per axis: low, cells / length, cells
uniform float scale;
uniform float perMoment;     // moments are of depths in units of 1 / this, lest squares overflow

const float kGap = 3e38;      // stands for a sample without data
const float kGapEdge = 2e38;  // everything above is such a sample
const float kInfinity = uintBitsToFloat(0x7f800000u);

#if defined(AXIS_X) || defined(AXIS_Y) || defined(AXIS_Z)
#define UNEVEN
#endif

// A point between nodes: the node before it and the share of the way to the next. It may be after
// the last node: the texture is clamped there.
struct Place {
  vec3 node, share;
};

Place placeOf(vec3 node) {
  vec3 x = max(node, firstNode);
  vec3 before = floor(x);
  return Place(before, x - before);
}

// Along an axis of uneven nodes: (node before x, share). A table of guesses names a node at or
// before x; the search goes on from there.
vec2 searchNodes(sampler2D nodes, vec3 guess, int count, float x) {
  int cell = int(clamp((x - guess.x) * guess.y, 0.0, guess.z - 1.0));
  int i = int(texelFetch(nodes, ivec2(cell, 1), 0).x);
  vec4 node = texelFetch(nodes, ivec2(i, 0), 0);
  while (x >= node.z && i < count - 2) {
    ++i;
    node = texelFetch(nodes, ivec2(i, 0), 0);
  }
  return vec2(float(i), clamp((x - node.x) * node.y, 0.0, 1.0));
}

// The way from node a to b along such an axis.
float nodesBetween(sampler2D nodes, int count, float a, float b) {
  vec2 x = vec2(a, b);
  ivec2 i = clamp(ivec2(x), 0, count - 2);
  vec4 from = texelFetch(nodes, ivec2(i.x, 0), 0), to = texelFetch(nodes, ivec2(i.y, 0), 0);
  return mix(to.x, to.z, x.y - float(i.y)) - mix(from.x, from.z, x.x - float(i.x));
}

Place placeAt(vec3 local) {
  Place p = placeOf(local * nodesFromLocal + nodesOrigin);
#ifdef AXIS_X
  vec2 x = searchNodes(nodesX, guesses[0], nodeCount.x, local.x);
  p.node.x = x.x, p.share.x = x.y;
#endif
#ifdef AXIS_Y
  vec2 y = searchNodes(nodesY, guesses[1], nodeCount.y, local.y);
  p.node.y = y.x, p.share.y = y.y;
#endif
#ifdef AXIS_Z
  vec2 z = searchNodes(nodesZ, guesses[2], nodeCount.z, local.z);
  p.node.z = z.x, p.share.z = z.y;
#endif
  return p;
}

// Trilinear between eight nodes (method §1), gathered a plane each. With GAPS those with data weigh
// by their shares, and kGap is where the nearest one has none. Devices' own filters round shares.
#ifdef GAPS
bvec4 haveData(vec4 f) {
  // By their bits: compilers may turn comparisons round, which NaN does not survive.
  return notEqual(floatBitsToUint(f) & 0x7f800000u, uvec4(0x7f800000u));
}
#endif

float trilinear(vec4 low, vec4 high, vec3 share) {
#ifdef GAPS
  bvec4 lowHas = haveData(low), highHas = haveData(high);
  low = mix(vec4(0.0), low, lowHas);
  high = mix(vec4(0.0), high, highHas);
#endif
  vec4 plane = low + share.z * (high - low);
  vec2 row = plane.wz + share.y * (plane.xy - plane.wz);
  float f = row.x + share.x * (row.y - row.x);
#ifdef GAPS
  if (!(all(lowHas) && all(highHas))) {
    vec2 x = vec2(1.0 - share.x, share.x), y = vec2(1.0 - share.y, share.y);
    vec4 weight = x.xyyx * y.yyxx;
    f /= (1.0 - share.z) * dot(weight, vec4(lowHas)) + share.z * dot(weight, vec4(highHas));
    bvec3 after = greaterThanEqual(share, vec3(0.5));
    bvec4 has = after.z ? highHas : lowHas;
    bvec2 rowHas = after.y ? has.xy : has.wz;
    f = (after.x ? rowHas.y : rowHas.x) ? f : kGap;
  }
#endif
  return f;
}

float fieldAt(Place p) {
  vec3 corner = vec3(p.node.xy * texelSize + cornerOrigin, p.node.z - firstNode.z);
  return trilinear(textureGather(volume, corner),
                   textureGather(volume, vec3(corner.xy, corner.z + 1.0)), p.share);
}

#ifdef SKIP
// The grid of bricks, SKIP cells a side: (channel, least, largest value, integral of
// the base function); see BrickGrid.
uniform sampler3D bricks;
uniform ivec3 lastBrick;
uniform vec3 brickLow, brickWidth;  // even axes: the lower face of brick i is at low + i * width

ivec3 brickAt(vec3 local) {
  return min(ivec3(placeAt(local).node - firstNode) / SKIP, lastBrick);
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

bool isGap(float f) {
#ifdef GAPS
  return f > kGapEdge;
#else
  return false;
#endif
}

// The value after a share of a step: linear between its samples. Where one of them has no data, its
// half of the step has none, and the other half the other's value (method §1).
float between(float f0, float f1, float share) {
#ifdef GAPS
  if (isGap(max(f0, f1))) return share < 0.5 ? f0 : f1;
#endif
  return mix(f0, f1, share);
}

// The share of a step at which the middle of what has data lies.
float middleOf(float f0, float f1) {
#ifdef GAPS
  return 0.5 + (isGap(f0) ? 0.25 : 0.0) - (isGap(f1) ? 0.25 : 0.0);
#else
  return 0.5;
#endif
}

// Differences between the points one node before and one after, in local units; at the border, to
// the outermost node only, and beside what has no data, to the point itself (method §1). Exact for
// linear fields on any nodes.
vec3 gradientAt(vec3 local) {
  Place p = placeAt(local);
  vec3 x = min(p.node + p.share, lastNode);
  vec3 a = max(x - 1.0, firstNode), b = min(x + 1.0, lastNode);
  vec3 before = vec3(fieldAt(placeOf(vec3(a.x, x.yz))), fieldAt(placeOf(vec3(x.x, a.y, x.z))),
                     fieldAt(placeOf(vec3(x.xy, a.z))));
  vec3 after = vec3(fieldAt(placeOf(vec3(b.x, x.yz))), fieldAt(placeOf(vec3(x.x, b.y, x.z))),
                    fieldAt(placeOf(vec3(x.xy, b.z))));
#ifdef GAPS
  float here = fieldAt(p);
  bvec3 noBefore = greaterThan(before, vec3(kGapEdge)), noAfter = greaterThan(after, vec3(kGapEdge));
  before = mix(before, vec3(here), noBefore);
  after = mix(after, vec3(here), noAfter);
  a = mix(a, x, noBefore);
  b = mix(b, x, noAfter);
  // Where there is nothing on one side and here, no slope.
  bvec3 none = greaterThan(max(before, after), vec3(kGapEdge));
  b = mix(b, a, none);
  after = mix(after, before, none);
#endif
  vec3 run = (b - a) / nodesFromLocal;
#ifdef AXIS_X
  run.x = nodesBetween(nodesX, nodeCount.x, a.x, b.x);
#endif
#ifdef AXIS_Y
  run.y = nodesBetween(nodesY, nodeCount.y, a.y, b.y);
#endif
#ifdef AXIS_Z
  run.z = nodesBetween(nodesZ, nodeCount.z, a.z, b.z);
#endif
  vec3 rise = after - before;
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

// Rays: depth along them is z, and samples stand at multiples of stepDepth.
uniform vec3 originAt[3];     // local position at z = 0: [0] + x [1] + y [2], x, y in [-1/2, 1/2]
uniform vec3 directionAt[3];  // change of local position with z, likewise
uniform vec3 boxLow, boxHigh, domainHigh;
uniform float stepDepth;
uniform float firstDepth;  // z of the camera plane

// The entry and exit of a ray in the owned box; x >= y: it misses. A ray within a face that two
// blocks share belongs to one of them.
vec2 clipToBox(vec3 origin, vec3 direction) {
  vec2 z = vec2(firstDepth, kInfinity);
  for (int axis = 0; axis < 3; ++axis) {
    float o = origin[axis], d = direction[axis];
    float low = boxLow[axis], high = boxHigh[axis];
    if (d == 0.0) {
      bool outside = o < low || o > high || (o == high && high < domainHigh[axis]);
      z.y = outside ? -kInfinity : z.y;
    } else {
      float a = (low - o) / d, b = (high - o) / d;
      z = vec2(max(z.x, min(a, b)), min(z.y, max(a, b)));
    }
  }
  return z;
}
