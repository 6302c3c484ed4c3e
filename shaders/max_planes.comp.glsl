#version 450
#extension GL_GOOGLE_include_directive : require

// Finds the largest log-likelihood of every plane (object, theta) of a slab, relative to a reference
// of the object. One workgroup takes a plane.

#include "interface.h"

layout(local_size_x_id = 0) in;  // a power of two
layout(constant_id = 1) const uint SOURCE = BLUR_TOUCH;

layout(binding = 0) uniform samplerBuffer source;  // two bins a texel
layout(binding = 1) uniform samplerBuffer references;  // [object] log-likelihood in two floats
layout(std430, binding = 2) writeonly buffer PlaneMax { float plane_max[]; };  // [object, theta]
layout(push_constant) uniform Push { PlanesPush push; };

#include "blurred_bin.glsl"

shared float largest[gl_WorkGroupSize.x];

void main() {
  const uint theta = gl_WorkGroupID.z;
  const uint object = gl_WorkGroupID.y;
  const uint lane = gl_LocalInvocationID.x;
  const uint plane = push.nx * push.ny;
  const uint first = object * push.stride + theta * plane;
  const vec2 reference = texelFetch(references, int(push.object_first + object)).xy;
  float highest = LOWEST;
  for (uint i = lane; i < plane; i += gl_WorkGroupSize.x) {
    highest = max(highest, word_of(first + i, reference));
  }
  largest[lane] = highest;
  barrier();
  for (uint reach = gl_WorkGroupSize.x / 2; reach > 0; reach /= 2) {
    if (lane < reach) {
      largest[lane] = max(largest[lane], largest[lane + reach]);
    }
    barrier();
  }
  if (lane == 0) {
    plane_max[(push.object_first + object) * push.all_thetas + push.theta_first + theta] =
        largest[0];
  }
}
