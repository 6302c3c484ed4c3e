#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// Adds the log-likelihood of touches (Eq. 7, 13) to a slab of the belief, for any lattice: one
// invocation takes TILE_X bins of a row, which share the element's position along y. Every bin finds
// its own map nodes.

#include "interface.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 5) const uint TILE_X = 5;

#include "contact_likelihood.glsl"
#include "likelihood_buffers.glsl"
#include "two_float.glsl"

#define FOR_EACH_BIN [[unroll]] for (uint i = 0; i < TILE_X; ++i)

int bin_cell[TILE_X];
float bin_fraction[TILE_X];
float log_odds_of[TILE_X];  // under one element, at every bin

// Bilinear in log odds. Outside the map both nodes are of the border and hold the prior.
void interpolate(const ObjectPlace object, const Split bin_y, const ivec4 element) {
  const float y = bin_y.fraction + intBitsToFloat(element.w);
  const float whole_y = floor(y);
  const float fy = y - whole_y;
  const int row = clamp(bin_y.cell + element.z + int(whole_y), 0, object.map_height - 2);
  const int row_node = object.first_node + row * object.map_width;
  FOR_EACH_BIN {
    const float x = bin_fraction[i] + intBitsToFloat(element.y);
    const float whole_x = floor(x);
    const float fx = x - whole_x;
    const int column = clamp(bin_cell[i] + element.x + int(whole_x), 0, object.map_width - 2);
    const vec4 corner = corners(row_node + column, object.map_width);
    const float low = corner.x + (corner.y - corner.x) * fx;
    const float high = corner.z + (corner.w - corner.z) * fx;
    log_odds_of[i] = low + (high - low) * fy;
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
  const ObjectPlace object = places[push.object_first + gl_WorkGroupID.y];
  const Split bin_y = axis[object.first_axis + push.nx + push.row_first + y];
  const int table = int((push.theta_first + theta) * push.elements);
  FOR_EACH_BIN {
    const Split bin_x = axis[object.first_axis + min(x + i, push.nx - 1)];
    bin_cell[i] = bin_x.cell;
    bin_fraction[i] = bin_x.fraction;
  }

  vec2 sum[TILE_X];
  float product[TILE_X];
  // The belief's own sum goes on, so that it does not matter which touches share a dispatch.
  const uint bin = object.first_bin + (theta * push.rows + y) * push.nx + x;
  FOR_EACH_BIN { sum[i] = x + i < push.nx ? belief[bin + i] : vec2(0.0); }
  for (uint s = 0; s < push.segments; ++s) {
    const ivec4 segment = texelFetch(segments, int(s));
    const uint reading = uint(segment.z);
    const ReadingRatio reading_says = reading_ratio(reading);
    if (IN_LOGS) {
      for (int k = segment.x; k < segment.y; ++k) {
        interpolate(object, bin_y, texelFetch(elements, table + k));
        FOR_EACH_BIN {
          sum[i] = two_float_add(sum[i], log_likelihood(reading, log_odds_of[i]));
        }
      }
    } else {
      for (int group = segment.x; group < segment.y; group += int(FACTORS_PER_LOG)) {
        const int end = min(group + int(FACTORS_PER_LOG), segment.y);
        FOR_EACH_BIN { product[i] = 1.0; }
        for (int k = group; k < end; ++k) {
          interpolate(object, bin_y, texelFetch(elements, table + k));
          FOR_EACH_BIN {
            const vec2 ratio = likelihood_ratio(reading_says, log_odds_of[i]);
            product[i] *= ratio.x / ratio.y;
          }
        }
        FOR_EACH_BIN { sum[i] = two_float_add(sum[i], log(product[i])); }
      }
    }
  }

  FOR_EACH_BIN {
    if (x + i < push.nx) {
      belief[bin + i] = sum[i];
    }
  }
}
