#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// Adds the log-likelihood of touches (Eq. 7, 13) to a slab of the belief, for lattices of which
// several neighbouring bins lie within a cell of the map or two: one invocation takes TILE_X x TILE_Y
// of one theta, which span at most CELLS cells along each axis, so that for each element the same few
// nodes serve all of them.

#include "interface.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 5) const uint TILE_X = 5;
layout(constant_id = 6) const uint TILE_Y = 5;
layout(constant_id = 7) const float STEP_X = 0.2;  // between bins, in cells
layout(constant_id = 8) const float STEP_Y = 0.2;
layout(constant_id = 9) const uint CELLS = 1;  // 1 or 2

const uint NODES = CELLS + 2;

#include "contact_likelihood.glsl"
#include "likelihood_buffers.glsl"
#include "two_float.glsl"

float log_odds_of[TILE_Y][TILE_X];  // under one element, at every bin of the tile

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
void interpolate(const ObjectPlace object, const Split bin_x, const Split bin_y,
                 const ivec4 element) {
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
      log_odds_of[j][i] = along(column_nodes, shares(fy + float(j) * STEP_Y));
    }
  }
}

#define FOR_EACH_BIN                            \
  [[unroll]] for (uint j = 0; j < TILE_Y; ++j) \
  [[unroll]] for (uint i = 0; i < TILE_X; ++i)

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
  const ObjectPlace object = places[push.object_first + gl_WorkGroupID.y];
  const Split bin_x = axis[object.first_axis + x];
  const Split bin_y = axis[object.first_axis + push.nx + push.row_first + y];
  const int table = int((push.theta_first + theta) * push.elements);

  vec2 sum[TILE_Y][TILE_X];
  float product[TILE_Y][TILE_X];
  float numerator[TILE_Y][TILE_X];
  float denominator[TILE_Y][TILE_X];
  // The belief's own sum goes on, so that it does not matter which touches share a dispatch.
  const uint bin = object.first_bin + (theta * push.rows + y) * push.nx + x;
  FOR_EACH_BIN {
    sum[j][i] = x + i < push.nx && y + j < push.rows ? belief[bin + j * push.nx + i] : vec2(0.0);
  }

  for (uint s = 0; s < push.segments; ++s) {
    const ivec4 segment = texelFetch(segments, int(s));
    const uint reading = uint(segment.z);
    const ReadingRatio reading_says = reading_ratio(reading);
    if (IN_LOGS) {
      for (int k = segment.x; k < segment.y; ++k) {
        interpolate(object, bin_x, bin_y, texelFetch(elements, table + k));
        FOR_EACH_BIN {
          sum[j][i] = two_float_add(sum[j][i], log_likelihood(reading, log_odds_of[j][i]));
        }
      }
    } else {
      for (int group = segment.x; group < segment.y; group += int(FACTORS_PER_LOG)) {
        const int group_end = min(group + int(FACTORS_PER_LOG), segment.y);
        FOR_EACH_BIN { product[j][i] = 1.0; }
        for (int quotient = group; quotient < group_end; quotient += int(FACTORS_PER_DIVISION)) {
          const int end = min(quotient + int(FACTORS_PER_DIVISION), group_end);
          FOR_EACH_BIN {
            numerator[j][i] = 1.0;
            denominator[j][i] = 1.0;
          }
          for (int k = quotient; k < end; ++k) {
            interpolate(object, bin_x, bin_y, texelFetch(elements, table + k));
            FOR_EACH_BIN {
              const vec2 ratio = likelihood_ratio(reading_says, log_odds_of[j][i]);
              numerator[j][i] *= ratio.x;
              denominator[j][i] *= ratio.y;
            }
          }
          FOR_EACH_BIN { product[j][i] *= numerator[j][i] / denominator[j][i]; }
        }
        FOR_EACH_BIN { sum[j][i] = two_float_add(sum[j][i], log(product[j][i])); }
      }
    }
  }

  FOR_EACH_BIN {
    if (x + i < push.nx && y + j < push.rows) {
      belief[bin + j * push.nx + i] = sum[j][i];
    }
  }
}
