#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// Sums exp(log-likelihood - max) of an object's bins in a slab over theta and over (x, y), in one
// pass. A workgroup takes a block of (x, y) places and a chunk of thetas, and writes its part of
// both sums. The host adds the parts in order.

#include "interface.h"
#include "two_float.glsl"

layout(local_size_x_id = 0) in;
layout(constant_id = 1) const uint SIDE_BY_SIDE = 8;  // lanes that read one stretch of memory
layout(constant_id = 2) const uint PAIRS_PER_LANE = 16;
layout(constant_id = 3) const uint THETAS = 64;  // at most the workgroup's lanes
// If the planes have an even number of bins, every pair of bins of a plane is one texel.
layout(constant_id = 4) const bool EVEN_PLANES = false;

layout(binding = 0) uniform samplerBuffer belief;  // two bins a texel
layout(std430, binding = 1) writeonly buffer OverTheta { float over_theta[]; };  // [chunk, plane]
layout(std430, binding = 2) writeonly buffer OverPlane { float over_plane[]; };  // [block, theta]
layout(push_constant) uniform Push { MarginalPush push; };

// [theta, lane]. A row has one word more than lanes: lanes that sum a row each use separate banks.
const uint ROW = gl_WorkGroupSize.x + 1;
shared float parts[THETAS * ROW];

// The log-likelihoods of `bin` and of the next bin, as two floats each.
vec4 fetch_pair(const uint bin, const uint last) {
  const int object_texel = int(push.first_bin / 2);
  const vec4 texel = texelFetch(belief, object_texel + int(bin / 2));
  if (EVEN_PLANES) {
    return texel;
  }
  const vec4 next = texelFetch(belief, object_texel + int(min(bin + 1, last) / 2));
  return bin % 2 == 0 ? texel : vec4(texel.zw, next.xy);
}

void main() {
  const vec2 most = vec2(push.max_high, push.max_low);
  const uint lane = gl_LocalInvocationID.x;
  const uint block = gl_WorkGroupID.x;
  const uint chunk = gl_WorkGroupID.y;
  const uint first = block * 2 * gl_WorkGroupSize.x * PAIRS_PER_LANE +
                     2 * (lane / SIDE_BY_SIDE * SIDE_BY_SIDE * PAIRS_PER_LANE + lane % SIDE_BY_SIDE);
  const uint theta = chunk * THETAS;
  const uint thetas = min(THETAS, push.thetas - theta);
  const uint last = push.thetas * push.plane - 1;

  vec2 sum[PAIRS_PER_LANE];
  [[unroll]] for (uint i = 0; i < PAIRS_PER_LANE; ++i) { sum[i] = vec2(0.0); }
  for (uint t = 0; t < thetas; ++t) {
    float part = 0.0;
    [[unroll]] for (uint i = 0; i < PAIRS_PER_LANE; ++i) {
      const uint at = first + 2 * i * SIDE_BY_SIDE;
      const uint bin = (theta + t) * push.plane + at;
      const vec4 pair = fetch_pair(min(bin, last), last);
      const vec2 probability =
          vec2(at < push.plane ? relative(pair.xy, most) : 0.0,
               at + 1 < push.plane ? relative(pair.zw, most) : 0.0);
      sum[i] += probability;
      part += probability.x + probability.y;
    }
    parts[t * ROW + lane] = part;
  }
  [[unroll]] for (uint i = 0; i < PAIRS_PER_LANE; ++i) {
    const uint at = first + 2 * i * SIDE_BY_SIDE;
    if (at < push.plane) {
      over_theta[chunk * push.plane + at] = sum[i].x;
    }
    if (at + 1 < push.plane) {
      over_theta[chunk * push.plane + at + 1] = sum[i].y;
    }
  }
  barrier();
  if (lane < thetas) {
    float total = 0.0;
    for (uint i = 0; i < gl_WorkGroupSize.x; ++i) {
      total += parts[lane * ROW + i];
    }
    over_plane[block * push.thetas + theta + lane] = total;
  }
}
