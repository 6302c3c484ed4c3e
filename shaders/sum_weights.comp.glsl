#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// Cumulates the weights of each block of WEIGHT_BLOCK particles, in units of the block's largest
// weight, and sums the weights and their squares. The host combines blocks in float64 and in order,
// so that equal input gives equal bits. Cumulated weights never decrease, on which the search among
// them relies: every lane starts from exactly the sum with which the previous lane ends.

#include "interface.h"
#include "two_float.glsl"

const uint WEIGHT_LANES = 64;  // each takes consecutive particles
layout(local_size_x = WEIGHT_LANES) in;

layout(std430, binding = 0) readonly buffer LogWeights { vec2 log_weights[]; };  // two floats
layout(std430, binding = 1) writeonly buffer Cumulative { float cumulative[]; };
layout(std430, binding = 2) writeonly buffer Blocks { WeightBlock blocks[]; };
layout(push_constant) uniform Push { uint particles; } push;

const uint RUN = WEIGHT_BLOCK / WEIGHT_LANES;
// Squares of smaller weights would be denormal numbers, slow on CPUs.
const float LEAST_SQUARED = 1e-18;

shared vec2 largest[WEIGHT_LANES];
shared float sums[WEIGHT_LANES];
shared float squares[WEIGHT_LANES];

void main() {
  const uint lane = gl_LocalInvocationID.x;
  const uint first = gl_WorkGroupID.x * WEIGHT_BLOCK + lane * RUN;
  vec2 value[RUN];
  vec2 highest = vec2(0.0);
  [[unroll]] for (uint i = 0; i < RUN; ++i) {
    // A lane past the end repeats the last particle without counting it.
    value[i] = log_weights[min(first + i, push.particles - 1)];
    highest = i == 0 || exceeds(value[i], highest) ? value[i] : highest;
  }
  largest[lane] = highest;
  barrier();
  for (uint reach = WEIGHT_LANES / 2; reach > 0; reach /= 2) {
    if (lane < reach && exceeds(largest[lane + reach], largest[lane])) {
      largest[lane] = largest[lane + reach];
    }
    barrier();
  }
  highest = largest[0];

  float running[RUN];
  float sum = 0.0;
  float square = 0.0;
  [[unroll]] for (uint i = 0; i < RUN; ++i) {
    const float weight = first + i < push.particles ? relative(value[i], highest) : 0.0;
    sum += weight;
    square += weight > LEAST_SQUARED ? weight * weight : 0.0;
    running[i] = sum;
  }
  sums[lane] = sum;
  squares[lane] = square;
  barrier();
  float before = 0.0;
  for (uint i = 0; i < lane; ++i) {
    before += sums[i];
  }
  [[unroll]] for (uint i = 0; i < RUN; ++i) {
    if (first + i < push.particles) {
      cumulative[first + i] = before + running[i];
    }
  }
  if (lane == WEIGHT_LANES - 1) {
    float all_squares = 0.0;
    for (uint i = 0; i < WEIGHT_LANES; ++i) {
      all_squares += squares[i];
    }
    blocks[gl_WorkGroupID.x] = WeightBlock(highest.x, highest.y, before + sum, all_squares);
  }
}
