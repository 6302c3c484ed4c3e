#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// Adds the log-likelihood of touches (Eq. 7, 13) to a slab of the belief, for any lattice: one
// invocation takes TILE_X bins of a row, which share the element's position along y. Every bin finds
// its own map nodes.

#include "interface.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 8) const uint TILE_X = 5;

const uint BINS = TILE_X;
const uint FACTORS_PER_DIVISION = 1;

#include "likelihood_buffers.glsl"
#include "segment_sum.glsl"

ObjectPlace object;
int bin_cell[BINS];  // along x, in cells of the map
float bin_fraction[BINS];
Split bin_y;
int table;  // the first element of the row's theta

// Bilinear in log odds. Outside the map both nodes are of the border and hold the prior.
void interpolate(const int element_index) {
  const ivec4 element = texelFetch(elements, table + element_index);
  const float y = bin_y.fraction + intBitsToFloat(element.w);
  const float whole_y = floor(y);
  const float fy = y - whole_y;
  const int row = clamp(bin_y.cell + element.z + int(whole_y), 0, object.map_height - 2);
  const int row_node = object.first_node + row * object.map_width;
  FOR_EACH_BIN {
    const float x = bin_fraction[b] + intBitsToFloat(element.y);
    const float whole_x = floor(x);
    const float fx = x - whole_x;
    const int column = clamp(bin_cell[b] + element.x + int(whole_x), 0, object.map_width - 2);
    const vec4 corner = corners(row_node + column, object.map_width);
    const float low = corner.x + (corner.y - corner.x) * fx;
    const float high = corner.z + (corner.w - corner.z) * fx;
    log_odds_of[b] = low + (high - low) * fy;
  }
}

void main() {
  const uint tiles_x = (push.nx + TILE_X - 1) / TILE_X;
  const uint tile = gl_GlobalInvocationID.x;
  const uint theta = gl_WorkGroupID.z;
  if (tile >= tiles_x * push.rows) {
    return;
  }
  const uint x = tile % tiles_x * TILE_X;
  const uint y = tile / tiles_x;
  object = places[push.object_first + gl_WorkGroupID.y];
  bin_y = axis[object.first_axis + push.nx + push.row_first + y];
  table = int((push.theta_first + theta) * push.elements);

  // The belief's own sum goes on, so that it does not matter which touches share a dispatch.
  const uint bin = object.first_bin + (theta * push.rows + y) * push.nx + x;
  FOR_EACH_BIN {
    const Split bin_x = axis[object.first_axis + min(x + b, push.nx - 1)];
    bin_cell[b] = bin_x.cell;
    bin_fraction[b] = bin_x.fraction;
    sum[b] = x + b < push.nx ? belief[bin + b] : vec2(0.0);
  }
  add_segments(push.segments, object.first_table_node);
  FOR_EACH_BIN {
    if (x + b < push.nx) {
      belief[bin + b] = sum[b];
    }
  }
}
