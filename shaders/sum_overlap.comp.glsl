#version 450
#extension GL_GOOGLE_include_directive : require

// Sums the likelihood of a touch over the bins at which the array overlaps the object: at which the
// rectangle around the array's elements meets the box around the object's cells. gl_WorkGroupID.x is
// theta, gl_WorkGroupID.y the object. The host combines the workgroups' results.

#include "interface.h"

layout(local_size_x_id = 0) in;  // a power of two

layout(binding = 0) uniform samplerBuffer source;  // two bins a texel
layout(binding = 1) uniform samplerBuffer arrays;  // ArrayAtTheta, [theta]
layout(binding = 2) uniform samplerBuffer boxes;   // ObjectBox, [object]
layout(std430, binding = 3) writeonly buffer Partials { OverlapPartial partials[]; };
layout(push_constant) uniform Push { OverlapPush push; };

const uint SOURCE = BLUR_TOUCH;
#include "blurred_bin.glsl"

// Rectangles that come as close count as overlapping, so that rounding decides nothing on round
// numbers.
const float SLACK_MM = 1e-3;

shared vec2 sums[gl_WorkGroupSize.x];
shared uint counts[gl_WorkGroupSize.x];

void main() {
  const uint theta = gl_WorkGroupID.x;
  const uint object = gl_WorkGroupID.y;
  const uint lane = gl_LocalInvocationID.x;
  const uint plane = push.slab.nx * push.slab.ny;
  const uint first = object * push.slab.stride + theta * plane;
  const vec4 array = texelFetch(arrays, int(push.slab.theta_first + theta));
  const vec4 box = texelFetch(boxes, int(push.slab.object_first + object));
  const vec2 half_array = vec2(push.half_x_mm, push.half_y_mm);
  const float c = abs(array.z);
  const float s = abs(array.w);
  // Two rectangles overlap where their shadows do on the axes of both.
  const vec2 reach = box.zw + vec2(c * half_array.x + s * half_array.y,
                                   s * half_array.x + c * half_array.y) + SLACK_MM;
  const vec2 turned_reach =
      half_array + vec2(c * box.z + s * box.w, s * box.z + c * box.w) + SLACK_MM;
  vec2 sum = vec2(LOWEST, 0.0);
  uint count = 0;
  for (uint i = lane; i < plane; i += gl_WorkGroupSize.x) {
    const vec2 pivot = vec2(push.first_x_mm + float(i % push.slab.nx) * push.step_x_mm,
                            push.first_y_mm + float(i / push.slab.nx) * push.step_y_mm);
    const vec2 apart = pivot + array.xy - box.xy;
    const vec2 turned = vec2(array.z * apart.x + array.w * apart.y,
                             array.z * apart.y - array.w * apart.x);
    const bool overlaps = all(lessThanEqual(abs(apart), reach)) &&
                          all(lessThanEqual(abs(turned), turned_reach));
    const vec2 more = log_sum_add(sum, word_of(first + i, vec2(0.0)), 1.0);
    sum = overlaps ? more : sum;
    count += overlaps ? 1 : 0;
  }
  sums[lane] = sum;
  counts[lane] = count;
  barrier();
  for (uint reach_lanes = gl_WorkGroupSize.x / 2; reach_lanes > 0; reach_lanes /= 2) {
    if (lane < reach_lanes) {
      const vec2 other = sums[lane + reach_lanes];
      sums[lane] = log_sum_add(sums[lane], other.x, other.y);
      counts[lane] += counts[lane + reach_lanes];
    }
    barrier();
  }
  if (lane == 0) {
    partials[push.partial_first + object * push.slab.thetas + theta] =
        OverlapPartial(sums[0].x, sums[0].y, counts[0]);
  }
}
