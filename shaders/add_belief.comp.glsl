#version 450
#extension GL_GOOGLE_include_directive : require

// Adds one slab of log-likelihoods to another, bin by bin.

#include "interface.h"

layout(local_size_x_id = 0) in;

#include "two_float.glsl"

layout(binding = 0) uniform samplerBuffer added;  // two bins a texel
layout(std430, binding = 1) buffer Belief { vec2 belief[]; };
layout(push_constant) uniform Push { AddPush push; };

void main() {
  // Workgroups form rows: the largest row that a device allows may be shorter than a slab.
  const uint bin = gl_WorkGroupID.y * push.row + gl_GlobalInvocationID.x;
  if (gl_GlobalInvocationID.x < push.row && bin < push.bins) {
    const vec4 pair = texelFetch(added, int(bin / 2));
    belief[bin] = two_float_sum(belief[bin], bin % 2 == 0 ? pair.xy : pair.zw);
  }
}
