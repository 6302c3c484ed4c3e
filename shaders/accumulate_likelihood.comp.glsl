#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// Adds the log-likelihood of touches (Eq. 7, 13) to a slab of the belief: one invocation takes
// TILE_X x TILE_Y bins of one theta. On a lattice of which several neighbouring bins lie within a cell
// of the map or two, a tile spans at most CELLS cells along each axis, so that for each element the
// same few nodes serve all of its bins. On any other, CELLS is 0, and an invocation takes a run of bins
// of a row, which share the element's position along y and find their own nodes. Workgroups differ by
// theta along z and by object along y.

#include "interface.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 8) const uint TILE_X = 5;
layout(constant_id = 9) const uint TILE_Y = 5;  // 1 where CELLS is 0
layout(constant_id = 10) const float STEP_X = 0.2;  // between bins, in cells
layout(constant_id = 11) const float STEP_Y = 0.2;
layout(constant_id = 12) const uint CELLS = 1;  // 0, 1 or 2

const uint NODES = CELLS + 2;
const uint BINS = TILE_X * TILE_Y;  // row by row
const uint FACTORS_PER_DIVISION = CELLS == 0 ? 1 : 4;

layout(binding = 2) uniform isamplerBuffer elements;  // RotatedElement, [theta, element]
layout(std430, binding = 5) readonly buffer Axes { Split axis[]; };  // [object], nx of x, then ny of y
layout(std430, binding = 6) readonly buffer Places { ObjectPlace places[]; };
layout(std430, binding = 7) buffer Belief { vec2 belief[]; };  // [object, theta, y, x] of the slab
layout(push_constant) uniform Push { LikelihoodPush push; };

#include "segment_sum.glsl"

ObjectPlace object;
Split bin_x[TILE_X];  // the tile's bins, in cells of the map
Split bin_y;          // its first row
int table;            // the first element of the tile's theta

// How far along it lies in each of the cells that the tile may reach, from 0 to 1.
vec3 shares(const float place) {
  return CELLS == 1 ? vec3(min(place, 1.0), max(place - 1.0, 0.0), 0.0)
                    : clamp(place - vec3(0.0, 1.0, 2.0), 0.0, 1.0);
}

float along(const vec4 nodes, const vec3 share) {
  const float first = nodes.x + (nodes.y - nodes.x) * share.x + (nodes.z - nodes.y) * share.y;
  return CELLS == 1 ? first : first + (nodes.w - nodes.z) * share.z;
}

// `cell` and `f`: where the element meets the map at the tile's first bin.
void interpolate_tile(const ivec2 cell, const vec2 f) {
  const int column = clamp(cell.x, 0, object.map_width - 4);
  const int row = clamp(cell.y, 0, object.map_height - 4);

  // Four fetches hold sixteen nodes.
  const int node = object.first_node + row * object.map_width + column;
  const int above = node + 2 * object.map_width;
  const vec4 left = corners(node, object.map_width);
  const vec4 right = corners(node + 2, object.map_width);
  const vec4 above_left = corners(above, object.map_width);
  const vec4 above_right = corners(above + 2, object.map_width);
  const vec4 node_rows[4] = {vec4(left.xy, right.xy), vec4(left.zw, right.zw),
                             vec4(above_left.xy, above_right.xy),
                             vec4(above_left.zw, above_right.zw)};

  [[unroll]] for (uint i = 0; i < TILE_X; ++i) {
    const vec3 share = shares(f.x + float(i) * STEP_X);
    vec4 column_nodes = vec4(0.0);  // between the map's columns
    [[unroll]] for (uint r = 0; r < NODES; ++r) {
      column_nodes[r] = along(node_rows[r], share);
    }
    [[unroll]] for (uint j = 0; j < TILE_Y; ++j) {
      log_odds_of[j * TILE_X + i] = along(column_nodes, shares(f.y + float(j) * STEP_Y));
    }
  }
}

void interpolate_run(const ivec4 element, const int cell_y, const float fy) {
  const int row_node =
      object.first_node + clamp(cell_y, 0, object.map_height - 2) * object.map_width;
  FOR_EACH_BIN {
    const float x = bin_x[b].fraction + intBitsToFloat(element.y);
    const float whole_x = floor(x);
    const int column =
        clamp(bin_x[b].cell + element.x + int(whole_x), 0, object.map_width - 2);
    log_odds_of[b] =
        between(corners(row_node + column, object.map_width), vec2(x - whole_x, fy));
  }
}

// Bilinear in log odds. Outside the map all nodes are of the border and hold the prior.
void interpolate(const int element_index) {
  const ivec4 element = texelFetch(elements, table + element_index);
  const vec2 place = vec2(bin_x[0].fraction, bin_y.fraction) +
                     vec2(intBitsToFloat(element.y), intBitsToFloat(element.w));
  const vec2 whole = floor(place);
  const ivec2 cell = ivec2(bin_x[0].cell, bin_y.cell) + element.xz + ivec2(whole);
  if (CELLS == 0) {
    interpolate_run(element, cell.y, place.y - whole.y);
  } else {
    interpolate_tile(cell, place - whole);
  }
}

void main() {
  const uint tiles_x = (push.nx + TILE_X - 1) / TILE_X;
  const uint tiles_y = (push.rows + TILE_Y - 1) / TILE_Y;
  const uint tile = gl_GlobalInvocationID.x;
  const uint theta = gl_WorkGroupID.z;
  if (tile >= tiles_x * tiles_y) {
    return;
  }
  const uint x = tile % tiles_x * TILE_X;
  const uint y = tile / tiles_x * TILE_Y;
  object = places[push.object_first + gl_WorkGroupID.y];
  [[unroll]] for (uint i = 0; i < TILE_X; ++i) {
    bin_x[i] = axis[object.first_axis + min(x + i, push.nx - 1)];
  }
  bin_y = axis[object.first_axis + push.nx + push.row_first + y];
  table = int((push.theta_first + theta) * push.elements);

  // The belief's own sum goes on, so that it does not matter which touches share a dispatch.
  const uint bin = object.first_bin + (theta * push.rows + y) * push.nx + x;
  FOR_EACH_BIN {
    const uint i = b % TILE_X;
    const uint j = b / TILE_X;
    sum[b] = x + i < push.nx && y + j < push.rows ? belief[bin + j * push.nx + i] : vec2(0.0);
  }
  add_segments(push.segments, object.first_table_node);
  FOR_EACH_BIN {
    const uint i = b % TILE_X;
    const uint j = b / TILE_X;
    if (x + i < push.nx && y + j < push.rows) {
      belief[bin + j * push.nx + i] = sum[b];
    }
  }
}
