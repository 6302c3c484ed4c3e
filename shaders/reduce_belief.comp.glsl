#version 450
#extension GL_GOOGLE_include_directive : require

// The largest log-likelihood of every REDUCE_BINS bins, its first index, and the sum of
// exp(log-likelihood - max) over them (Eq. 14, 15). The host combines the partial results in
// float64 and in order, so equal input gives equal bits.

#include "interface.h"

layout(local_size_x_id = 0) in;

layout(std430, binding = 0) readonly buffer Belief { vec2 belief[]; };
layout(std430, binding = 1) writeonly buffer Partials { Partial partials[]; };
layout(push_constant) uniform Push { ReducePush push; };

shared vec2 best_value[gl_WorkGroupSize.x];
shared uint best_index[gl_WorkGroupSize.x];
shared float sums[gl_WorkGroupSize.x];

bool better(const vec2 a, const uint a_index, const vec2 b, const uint b_index) {
  precise float difference = (a.x - b.x) + (a.y - b.y);
  return difference > 0.0 || (difference == 0.0 && a_index < b_index);
}

void main() {
  const uint lane = gl_LocalInvocationID.x;
  const uint lanes = gl_WorkGroupSize.x;
  const uint begin = gl_WorkGroupID.x * REDUCE_BINS;
  const uint end = min(begin + REDUCE_BINS, push.bins);

  // A lane past the end repeats the first bin, which changes no maximum.
  uint index = begin + lane < end ? begin + lane : begin;
  vec2 value = belief[index];
  for (uint i = begin + lane + lanes; i < end; i += lanes) {
    if (better(belief[i], i, value, index)) {
      value = belief[i];
      index = i;
    }
  }
  best_value[lane] = value;
  best_index[lane] = index;
  barrier();
  for (uint half_lanes = lanes / 2; half_lanes > 0; half_lanes /= 2) {
    if (lane < half_lanes) {
      const uint other = lane + half_lanes;
      if (better(best_value[other], best_index[other], best_value[lane], best_index[lane])) {
        best_value[lane] = best_value[other];
        best_index[lane] = best_index[other];
      }
    }
    barrier();
  }

  const vec2 most = best_value[0];
  float sum = 0.0;
  for (uint i = begin + lane; i < end; i += lanes) {
    precise float difference = (belief[i].x - most.x) + (belief[i].y - most.y);
    sum += exp(difference);
  }
  sums[lane] = sum;
  barrier();
  for (uint half_lanes = lanes / 2; half_lanes > 0; half_lanes /= 2) {
    if (lane < half_lanes) {
      sums[lane] += sums[lane + half_lanes];
    }
    barrier();
  }
  if (lane == 0) {
    partials[push.partial_first + gl_WorkGroupID.x] =
        Partial(most.x, most.y, best_index[0], sums[0]);
  }
}
