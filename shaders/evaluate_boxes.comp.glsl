#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// The log-likelihood of elements (Eq. 7, 13) at the bins of a list of boxes: one invocation takes a
// run of up to RUN bins of a box's row, which share the element's position along y.

#include "interface.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 9) const uint RUN = 5;

const uint BINS = RUN;
const uint FACTORS_PER_DIVISION = 1;

layout(binding = 2) uniform isamplerBuffer elements;  // RotatedElement, [theta, element]
layout(std430, binding = 5) readonly buffer Axes { Split axis[]; };
layout(std430, binding = 6) readonly buffer Boxes { BoxPlace boxes[]; };
layout(std430, binding = 7) writeonly buffer Results { float result[]; };  // in nats
layout(push_constant) uniform Push { BoxPush push; };

#include "map_corners.glsl"
#include "segment_sum.glsl"

BoxPlace box;
int bin_cell[BINS];  // along x, in cells of the map
float bin_fraction[BINS];
Split bin_y;

// Bilinear in log odds. Outside the map both nodes are of the border and hold the prior.
void interpolate(const int element_index) {
  const ivec4 element = texelFetch(elements, int(box.first_element) + element_index);
  const float y = bin_y.fraction + intBitsToFloat(element.w);
  const float whole_y = floor(y);
  const float fy = y - whole_y;
  const int row = clamp(bin_y.cell + element.z + int(whole_y), 0, box.map_height - 2);
  const int row_node = box.first_node + row * box.map_width;
  FOR_EACH_BIN {
    const float x = bin_fraction[b] + intBitsToFloat(element.y);
    const float whole_x = floor(x);
    const float fx = x - whole_x;
    const int column = clamp(bin_cell[b] + element.x + int(whole_x), 0, box.map_width - 2);
    const vec4 corner = corners(row_node + column, box.map_width);
    const float low = corner.x + (corner.y - corner.x) * fx;
    const float high = corner.z + (corner.w - corner.z) * fx;
    log_odds_of[b] = low + (high - low) * fy;
  }
}

// The last box whose first run is not beyond `run`.
uint box_of(const uint run) {
  uint first = 0;
  uint end = push.boxes;
  while (end - first > 1) {
    const uint middle = (first + end) / 2;
    if (boxes[middle].first_run <= run) {
      first = middle;
    } else {
      end = middle;
    }
  }
  return first;
}

void main() {
  const uint run = gl_GlobalInvocationID.x;
  if (run >= push.runs) {
    return;
  }
  box = boxes[box_of(run)];
  const uint runs_x = (box.x_count + RUN - 1) / RUN;
  const uint x = (run - box.first_run) % runs_x * RUN;
  const uint y = (run - box.first_run) / runs_x;
  bin_y = axis[box.y_axis + y];
  FOR_EACH_BIN {
    const Split bin_x = axis[box.x_axis + min(x + b, box.x_count - 1)];
    bin_cell[b] = bin_x.cell;
    bin_fraction[b] = bin_x.fraction;
    sum[b] = vec2(0.0);
  }
  add_segments(push.segments, box.first_table_node);
  const uint bin = box.first_bin + y * box.x_count + x;
  FOR_EACH_BIN {
    if (x + b < box.x_count) {
      result[bin + b] = sum[b].x;
    }
  }
}
