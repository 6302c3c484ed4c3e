#version 450
#extension GL_GOOGLE_include_directive : require

// Adds the log-likelihood of touches (Eq. 7, 13) to a slab of one object's belief: one pose bin per
// invocation, one theta per workgroup. Positions are added in cells and fractions of a cell, both
// rotated in float64 on the host, so that the distance to a map node is exact to 1e-7 cells wherever
// the robot's origin lies.

#include "interface.h"

layout(local_size_x_id = 0) in;

#include "contact_likelihood.glsl"
#include "two_float.glsl"

layout(std430, binding = 0) readonly buffer Map { float log_odds[]; };
layout(std430, binding = 1) readonly buffer Axes { Split axis[]; };  // nx of x, then ny of y
layout(std430, binding = 2) readonly buffer Elements { RotatedElement rotated[]; };
layout(std430, binding = 3) readonly buffer Segments { Segment segment[]; };
layout(std430, binding = 4) buffer Belief { vec2 belief[]; };
layout(push_constant) uniform Push { LikelihoodPush push; };

// Bilinear in log odds. Outside the map both nodes are of the border and hold the prior.
float interpolate(const Split bin_x, const Split bin_y, const RotatedElement element) {
  const float x = bin_x.fraction + element.x.fraction;
  const float y = bin_y.fraction + element.y.fraction;
  const float whole_x = floor(x);
  const float whole_y = floor(y);
  const float fx = x - whole_x;
  const float fy = y - whole_y;
  const int column = clamp(bin_x.cell + element.x.cell + int(whole_x), 0, push.map_width - 2);
  const int row = clamp(bin_y.cell + element.y.cell + int(whole_y), 0, push.map_height - 2);
  const int node = row * push.map_width + column;
  const float lower = mix(log_odds[node], log_odds[node + 1], fx);
  const float upper =
      mix(log_odds[node + push.map_width], log_odds[node + push.map_width + 1], fx);
  return mix(lower, upper, fy);
}

void main() {
  const uint in_slab = gl_GlobalInvocationID.x;
  const uint theta = gl_WorkGroupID.z;
  if (in_slab >= push.plane_count) {
    return;
  }
  const uint in_plane = push.plane_first + in_slab;
  const Split bin_x = axis[in_plane % push.nx];
  const Split bin_y = axis[push.nx + in_plane / push.nx];
  const uint table = (push.theta_first + theta) * push.elements;
  const uint bin = theta * push.plane_count + in_slab;

  vec2 sum = belief[bin];
  for (uint s = 0; s < push.segments; ++s) {
    float part = 0.0;
    for (uint k = segment[s].begin; k < segment[s].end; ++k) {
      part += log_likelihood(segment[s].reading, interpolate(bin_x, bin_y, rotated[table + k]));
    }
    sum = two_float_add(sum, part);
  }
  belief[bin] = sum;
}
