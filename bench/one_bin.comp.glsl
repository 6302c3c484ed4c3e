#version 450
#extension GL_GOOGLE_include_directive : require

// The straightforward kernel for Eq. 7 and 13, to measure the product's against: one pose bin per
// invocation, one theta per workgroup, everything in storage buffers, one exp and one log per
// element.

#include "one_bin_push.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 1) const float RANDOM_FLOOR = 0.02;  // gamma m
layout(constant_id = 2) const float TRUST = 0.9;          // 1 - gamma

#include "../shaders/two_float.glsl"

layout(std430, binding = 0) readonly buffer Map { float log_odds[]; };
layout(std430, binding = 1) readonly buffer Axes { Split axis[]; };  // nx of x, then ny of y
layout(std430, binding = 2) readonly buffer Elements { RotatedElement rotated[]; };
layout(std430, binding = 3) readonly buffer Segments { Segment segment[]; };
layout(std430, binding = 4) buffer Belief { vec2 belief[]; };  // [theta, y, x]
layout(push_constant) uniform Push { OneBinPush push; };

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

float log_likelihood(const uint reading, const float log_odds) {
  const float l = reading == IN_CONTACT ? log_odds : -log_odds;
  const float z = exp(-abs(l));
  return log(RANDOM_FLOOR + TRUST * ((l >= 0.0 ? 1.0 : z) / (1.0 + z)));
}

void main() {
  const uint in_plane = gl_GlobalInvocationID.x;
  const uint theta = gl_WorkGroupID.z;
  if (in_plane >= push.nx * push.ny) {
    return;
  }
  const Split bin_x = axis[in_plane % push.nx];
  const Split bin_y = axis[push.nx + in_plane / push.nx];
  const uint table = theta * push.elements;
  const uint bin = theta * push.nx * push.ny + in_plane;

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
