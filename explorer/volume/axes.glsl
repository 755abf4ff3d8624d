// Axes whose nodes are not evenly spaced (AXIS_X, AXIS_Y, AXIS_Z; UNEVEN: any). Places are in cells
// of equal width; of a place in texture cells, node i is at i + 1/2. See GridAxes.
#ifdef UNEVEN
uniform highp sampler2D axes;  // rows 3 a: node, 1 / width, next; 3 a + 1: width before, own, after;
uniform vec3 guessesPerCell;   // 3 a + 2: nodes at or before equal places
uniform ivec3 guesses, lastNode;

int nodeBefore(int axis, float place) {
  int guess = clamp(int(place * guessesPerCell[axis]), 0, guesses[axis] - 1);
  int i = int(texelFetch(axes, ivec2(guess, 3 * axis + 2), 0).x);
  while (i < lastNode[axis] - 1 && place >= texelFetch(axes, ivec2(i, 3 * axis), 0).z) ++i;
  return i;
}

float textureAlong(int axis, float place) {
  int i = nodeBefore(axis, place);
  vec4 node = texelFetch(axes, ivec2(i, 3 * axis), 0);
  return float(i) + 0.5 + (place - node.x) * node.y;
}

float placeAlong(int axis, float cell) {
  int i = clamp(int(floor(cell - 0.5)), 0, lastNode[axis] - 1);
  vec4 node = texelFetch(axes, ivec2(i, 3 * axis), 0);
  return node.x + (cell - 0.5 - float(i)) / node.y;
}

// How long a step may be that ends in no other cell by more than that one's width.
float roomAlong(int axis, float place) {
  int i = nodeBefore(axis, place);
  vec4 node = texelFetch(axes, ivec2(i, 3 * axis), 0);
  vec4 width = texelFetch(axes, ivec2(i, 3 * axis + 1), 0);
  return min(width.y, min(width.x + max(place - node.x, 0.0), width.z + max(node.z - place, 0.0)));
}
#endif

vec3 textureCell(vec3 place) {
#ifdef AXIS_X
  place.x = textureAlong(0, place.x);
#endif
#ifdef AXIS_Y
  place.y = textureAlong(1, place.y);
#endif
#ifdef AXIS_Z
  place.z = textureAlong(2, place.z);
#endif
  return place;
}

// The inverse.
vec3 placeOfTexture(vec3 cell) {
#ifdef AXIS_X
  cell.x = placeAlong(0, cell.x);
#endif
#ifdef AXIS_Y
  cell.y = placeAlong(1, cell.y);
#endif
#ifdef AXIS_Z
  cell.z = placeAlong(2, cell.z);
#endif
  return cell;
}
