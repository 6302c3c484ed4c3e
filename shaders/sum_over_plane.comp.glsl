#version 450
#extension GL_GOOGLE_include_directive : require

// Adds a slab's probabilities, relative to exp(max), to the marginal over theta: one theta per
// workgroup.

#include "interface.h"

layout(local_size_x_id = 0) in;

layout(std430, binding = 0) readonly buffer Belief { vec2 belief[]; };
layout(std430, binding = 1) buffer Marginal { float marginal[]; };
layout(push_constant) uniform Push { MarginalPush push; };

shared float sums[gl_WorkGroupSize.x];

void main() {
  const uint lane = gl_LocalInvocationID.x;
  const uint theta = gl_WorkGroupID.x;
  float sum = 0.0;
  for (uint i = lane; i < push.plane_count; i += gl_WorkGroupSize.x) {
    const vec2 value = belief[theta * push.plane_count + i];
    precise float difference = (value.x - push.max_high) + (value.y - push.max_low);
    sum += exp(difference);
  }
  sums[lane] = sum;
  barrier();
  for (uint half_lanes = gl_WorkGroupSize.x / 2; half_lanes > 0; half_lanes /= 2) {
    if (lane < half_lanes) {
      sums[lane] += sums[lane + half_lanes];
    }
    barrier();
  }
  if (lane == 0) {
    marginal[push.theta_first + theta] += sums[0];
  }
}
