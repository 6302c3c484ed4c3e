#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// Finds, for the bins of each workgroup, the largest log-likelihood, the first index that has it,
// and the sum of exp(log-likelihood - max) (Eq. 14, 15), in one pass: the sum is relative to the
// largest value so far. gl_WorkGroupID.y is the object. The host combines the workgroups' results
// in float64 and in order, so that equal input gives equal bits.

#include "interface.h"
#include "two_float.glsl"

layout(local_size_x_id = 0) in;  // a power of two
layout(constant_id = 1) const uint SIDE_BY_SIDE = 8;      // lanes that read one stretch of memory
layout(constant_id = 2) const uint TEXELS_PER_LANE = 128;  // a multiple of REDUCE_BATCH

// [object, bin]; a texel holds two bins, which halves the fetches. A bin's log-likelihood is high +
// low with |low| <= ulp(high) / 2.
layout(binding = 0) uniform samplerBuffer belief;
layout(std430, binding = 1) writeonly buffer Partials { Partial partials[]; };
layout(push_constant) uniform Push { ReducePush push; };

shared vec2 best_value[gl_WorkGroupSize.x];
shared uint best_index[gl_WorkGroupSize.x];
shared float sums[gl_WorkGroupSize.x];

void main() {
  const uint lane = gl_LocalInvocationID.x;
  const uint lanes = gl_WorkGroupSize.x;
  const uint bins = 2 * lanes * TEXELS_PER_LANE;
  const int object_texel = int(gl_WorkGroupID.y * push.stride / 2);
  const uint begin = gl_WorkGroupID.x * bins;
  const uint end = min(begin + bins, push.bins);

  // A lane past the end repeats the last bin without counting it, which changes no result.
  const uint last = (end - 1) / 2;
  const uint first =
      begin / 2 + lane / SIDE_BY_SIDE * SIDE_BY_SIDE * TEXELS_PER_LANE + lane % SIDE_BY_SIDE;
  uint index = min(2 * first, end - 1);
  const vec4 first_pair = texelFetch(belief, object_texel + int(index / 2));
  vec2 best = index % 2 == 0 ? first_pair.xy : first_pair.zw;
  float sum = 0.0;
  const uint past = first + SIDE_BY_SIDE * TEXELS_PER_LANE;
  for (uint i = first; i < past; i += SIDE_BY_SIDE * REDUCE_BATCH) {
    vec2 value[2 * REDUCE_BATCH];
    const vec2 before = best;
    [[unroll]] for (uint b = 0; b < REDUCE_BATCH; ++b) {
      const vec4 pair = texelFetch(belief, object_texel + int(min(i + b * SIDE_BY_SIDE, last)));
      value[2 * b] = pair.xy;
      value[2 * b + 1] = pair.zw;
      [[unroll]] for (uint k = 0; k < 2; ++k) {
        const uint at = 2 * (i + b * SIDE_BY_SIDE) + k;
        const bool more = at < end && exceeds(value[2 * b + k], best);
        best = more ? value[2 * b + k] : best;
        index = more ? at : index;
      }
    }
    sum *= relative(before, best);
    [[unroll]] for (uint b = 0; b < 2 * REDUCE_BATCH; ++b) {
      const uint at = 2 * (i + b / 2 * SIDE_BY_SIDE) + b % 2;
      sum += at < end ? relative(value[b], best) : 0.0;
    }
  }

  best_value[lane] = best;
  best_index[lane] = index;
  sums[lane] = sum;
  barrier();
  for (uint reach = lanes / 2; reach > 0; reach /= 2) {
    if (lane < reach) {
      const vec2 mine = best_value[lane];
      const vec2 other = best_value[lane + reach];
      const uint other_index = best_index[lane + reach];
      const bool more = exceeds(other, mine) || (other == mine && other_index < best_index[lane]);
      const vec2 largest = more ? other : mine;
      sums[lane] =
          sums[lane] * relative(mine, largest) + sums[lane + reach] * relative(other, largest);
      best_value[lane] = largest;
      best_index[lane] = more ? other_index : best_index[lane];
    }
    barrier();
  }
  if (lane == 0) {
    partials[push.partial_first + gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x] =
        Partial(best_value[0].x, best_value[0].y, best_index[0], sums[0]);
  }
}
