#version 430 core
// SPDX-License-Identifier: BSD-3-Clause
// Natural neighbours of the nodes of a grid, a node an invocation (proxy/customization/natural_neighbours.h). The
// nodes of a workgroup are in one row along x, so that all of them pass over the same runs of cells.
// MANHATTAN: that metric instead of the Euclidean one.

layout(local_size_x = 32) in;

layout(std430, binding = 0) writeonly buffer Means { vec4 means[]; };  // two a node
layout(std430, binding = 1) readonly buffer Cells { ivec4 cells[]; };  // two a cell, see below
layout(std430, binding = 2) readonly buffer Slices { ivec4 slices[]; };  // two each
layout(std430, binding = 3) readonly buffer Runs { ivec4 runs[]; };
layout(std430, binding = 4) readonly buffer Rows { vec4 rows[]; };  // two a row of values
layout(std430, binding = 5) readonly buffer Starts { int starts[]; };  // runs, by slice and y
uniform ivec3 nodes;
uniform int cellCount;
uniform int firstZ;  // of this dispatch

#ifdef MANHATTAN
int measured(int d) { return abs(d); }
int reachOf(int rest) { return rest; }
#else
int measured(int d) { return d * d; }
// Not less than the root; negative like `rest`.
int reachOf(int rest) { return rest < 0 ? -1 : int(sqrt(float(rest))) + 1; }
#endif

// cell_counts.h "ThresholdTable", for x >= 0.
int threshold(int k, int x, float inverse) {
#ifdef MANHATTAN
  if (k >= x) return -256;
  return k < -x ? 256 : (x - k + 1) >> 1;
#else
  if (x == 0) return k >= 0 ? -256 : 256;
  // Half a unit from any quotient that is whole: rounding does no harm where |threshold| <= 256.
  float quotient = floor((float(x * x - k + 2 * x) - 0.5) * inverse);
  return int(clamp(quotient, -256.0, 256.0));
#endif
}

// How many nodes of a cell count for the node at `place` relative to its seed.
int countOf(ivec3 place, int firstSlice, int endSlice) {
  int x = abs(place.x);
  float inverse = 0.5 / float(max(x, 1));
  int count = 0;
  for (int s = firstSlice; s < endSlice; ++s) {
    // z, first and last y, greatest measure of a node but for z; where its starts are.
    ivec4 slice = slices[2 * s];
    int acrossZ = measured(slice.x) - measured(place.z - slice.x);
    int reach = reachOf(acrossZ + slice.w);
    // Rows that some ball reaches. Software rasterisers do skip a loop, but no branch.
    int low = max(place.y - reach, slice.y), high = min(place.y + reach, slice.z);
    if (low > high) continue;
    int start = slices[2 * s + 1].x - slice.y;
    int end = starts[start + high + 1];
    for (int r = starts[start + low]; r < end; ++r) {
      // y, first and last x.
      ivec4 run = runs[r];
      int k = acrossZ + measured(run.x) - measured(place.y - run.x);
      ivec2 ends = place.x < 0 ? -run.zy : run.yz;
      count += max(ends.y + 1 - max(threshold(k, x, inverse), ends.x), 0);
    }
  }
  return count;
}

void main() {
  ivec3 node = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, firstZ);
  if (node.x >= nodes.x) return;
  dvec4 first = dvec4(0.0), second = dvec4(0.0);
  int total = 0, count = 0;
  for (int c = 0; c < cellCount; ++c) {
    // The seed's node and row; first and last slice, whether the next cell has another row.
    ivec4 seed = cells[2 * c], range = cells[2 * c + 1];
    count += countOf(node - seed.xyz, range.x, range.y);
    if (range.z == 0) continue;
    // Products are exact, so that fusing them with the sum changes nothing.
    first += double(count) * dvec4(rows[2 * seed.w]);
    second += double(count) * dvec4(rows[2 * seed.w + 1]);
    total += count;
    count = 0;
  }
  int at = 2 * ((node.z * nodes.y + node.y) * nodes.x + node.x);
  means[at] = vec4(first / double(total));
  means[at + 1] = vec4(second / double(total));
}
