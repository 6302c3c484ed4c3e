#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// Sums a slab's probabilities, relative to exp(max), over theta and over (x, y) in one pass. A
// workgroup takes MARGINAL_PLANE (x, y) indices and MARGINAL_THETAS thetas and writes its parts of
// both sums, which the host adds in order.

#include "interface.h"

layout(local_size_x = MARGINAL_WORKGROUP) in;

layout(binding = 0) uniform samplerBuffer belief;  // two bins a texel
layout(std430, binding = 1) writeonly buffer OverTheta { float over_theta[]; };  // [chunk, plane]
layout(std430, binding = 2) writeonly buffer OverPlane { float over_plane[]; };  // [block, theta]
layout(push_constant) uniform Push { MarginalPush push; };

const uint PER_LANE = MARGINAL_PLANE / MARGINAL_WORKGROUP;

shared float parts[MARGINAL_THETAS][MARGINAL_WORKGROUP];

void main() {
  const uint lane = gl_LocalInvocationID.x;
  const uint block = gl_WorkGroupID.x;
  const uint chunk = gl_WorkGroupID.y;
  const uint first = block * MARGINAL_PLANE + lane;
  const uint theta = chunk * MARGINAL_THETAS;
  const uint thetas = min(MARGINAL_THETAS, push.thetas - theta);

  float sum[PER_LANE];
  [[unroll]] for (uint i = 0; i < PER_LANE; ++i) { sum[i] = 0.0; }
  for (uint t = 0; t < thetas; ++t) {
    float part = 0.0;
    [[unroll]] for (uint i = 0; i < PER_LANE; ++i) {
      const uint at = first + i * MARGINAL_WORKGROUP;
      const uint bin = (theta + t) * push.plane + min(at, push.plane - 1);
      const vec4 pair = texelFetch(belief, int(bin / 2));
      const vec2 value = bin % 2 == 0 ? pair.xy : pair.zw;
      precise float difference = (value.x - push.max_high) + (value.y - push.max_low);
      const float probability = at < push.plane ? exp(difference) : 0.0;
      sum[i] += probability;
      part += probability;
    }
    parts[t][lane] = part;
  }
  [[unroll]] for (uint i = 0; i < PER_LANE; ++i) {
    const uint at = first + i * MARGINAL_WORKGROUP;
    if (at < push.plane) {
      over_theta[chunk * push.plane + at] = sum[i];
    }
  }
  barrier();
  if (lane < thetas) {
    float total = 0.0;
    for (uint i = 0; i < MARGINAL_WORKGROUP; ++i) {
      total += parts[lane][i];
    }
    over_plane[block * push.thetas + theta + lane] = total;
  }
}
