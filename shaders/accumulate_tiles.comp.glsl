#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// Adds the log-likelihood of touches (Eq. 7, 13) to a slab of the belief, for lattices of which
// several neighbouring bins lie within a cell of the map or two: one invocation takes TILE_X x TILE_Y
// of one theta, which span at most CELLS cells along each axis, so that for each element the same few
// nodes serve all of them.

#include "interface.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 8) const uint TILE_X = 5;
layout(constant_id = 9) const uint TILE_Y = 5;
layout(constant_id = 10) const float STEP_X = 0.2;  // between bins, in cells
layout(constant_id = 11) const float STEP_Y = 0.2;
layout(constant_id = 12) const uint CELLS = 1;  // 1 or 2

const uint NODES = CELLS + 2;
const uint BINS = TILE_X * TILE_Y;  // row by row
const uint FACTORS_PER_DIVISION = 4;

#include "likelihood_buffers.glsl"
#include "segment_sum.glsl"

ObjectPlace object;
Split bin_x;  // the tile's first bin, in cells of the map
Split bin_y;
int table;  // the first element of the tile's theta

// How far along it lies in each of the cells that the tile may reach, from 0 to 1.
vec3 shares(const float place) {
  return CELLS == 1 ? vec3(min(place, 1.0), max(place - 1.0, 0.0), 0.0)
                    : clamp(place - vec3(0.0, 1.0, 2.0), 0.0, 1.0);
}

float along(const vec4 nodes, const vec3 share) {
  const float first = nodes.x + (nodes.y - nodes.x) * share.x + (nodes.z - nodes.y) * share.y;
  return CELLS == 1 ? first : first + (nodes.w - nodes.z) * share.z;
}

// Bilinear in log odds, for all bins of the tile.
void interpolate(const int element_index) {
  const ivec4 element = texelFetch(elements, table + element_index);
  const float x = bin_x.fraction + intBitsToFloat(element.y);
  const float y = bin_y.fraction + intBitsToFloat(element.w);
  const float whole_x = floor(x);
  const float whole_y = floor(y);
  const float fx = x - whole_x;
  const float fy = y - whole_y;
  const int column = clamp(bin_x.cell + element.x + int(whole_x), 0, object.map_width - 4);
  const int row = clamp(bin_y.cell + element.z + int(whole_y), 0, object.map_height - 4);

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
    const vec3 share = shares(fx + float(i) * STEP_X);
    vec4 column_nodes = vec4(0.0);  // between the map's columns
    [[unroll]] for (uint r = 0; r < NODES; ++r) {
      column_nodes[r] = along(node_rows[r], share);
    }
    [[unroll]] for (uint j = 0; j < TILE_Y; ++j) {
      log_odds_of[j * TILE_X + i] = along(column_nodes, shares(fy + float(j) * STEP_Y));
    }
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
  bin_x = axis[object.first_axis + x];
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
