#version 450
#extension GL_GOOGLE_include_directive : require

// Adds a slab's probabilities, relative to exp(max), to the marginal over (x, y): one (x, y) per
// invocation.

#include "interface.h"

layout(local_size_x_id = 0) in;

layout(std430, binding = 0) readonly buffer Belief { vec2 belief[]; };
layout(std430, binding = 1) buffer Marginal { float marginal[]; };
layout(push_constant) uniform Push { MarginalPush push; };

void main() {
  const uint in_slab = gl_GlobalInvocationID.x;
  if (in_slab >= push.plane_count) {
    return;
  }
  float sum = 0.0;
  for (uint theta = 0; theta < push.theta_count; ++theta) {
    const vec2 value = belief[theta * push.plane_count + in_slab];
    precise float difference = (value.x - push.max_high) + (value.y - push.max_low);
    sum += exp(difference);
  }
  marginal[push.plane_first + in_slab] += sum;
}
