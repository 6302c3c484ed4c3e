#version 450
#extension GL_GOOGLE_include_directive : require

// Draws the next touch's particles from the last touch's (Sec. III-B): each invocation draws one
// particle by weight and adds motion noise, or, in Augmented MCL, sometimes draws a random particle
// from the initial distribution.

#include "interface.h"

layout(local_size_x_id = 0) in;

#include "philox.glsl"

layout(std430, binding = 0) readonly buffer Particles { Particle particles[]; };
// [particle], the weights' sum within its block, inclusive.
layout(std430, binding = 1) readonly buffer Cumulative { float cumulative[]; };
layout(binding = 2) uniform isamplerBuffer blocks;  // DrawBlock
layout(std430, binding = 3) readonly buffer Shares { ObjectShare shares[]; };
layout(std430, binding = 4) writeonly buffer Drawn { Particle drawn[]; };
layout(push_constant) uniform Push { DrawPush push; };

const float PI = 3.14159265358979;
const float PER_WORD = 1.0 / 4294967296.0;

uvec4 random(const uint particle, const uint purpose) {
  return philox(uvec4(particle, push.touch, purpose, 0), uvec2(push.key_low, push.key_high));
}

// Uniform over (-1, 1].
float uniform_of(const uint word) { return (float(word) + 0.5) * 2.0 * PER_WORD - 1.0; }

// Two independent standard normal numbers (Box and Muller 1958).
vec2 normals(const uvec2 words) {
  // log() of a number just below 1 may round to above 0.
  const float radius = sqrt(max(-2.0 * log((float(words.x) + 0.5) * PER_WORD), 0.0));
  const float angle = PI * uniform_of(words.y);
  return radius * vec2(cos(angle), sin(angle));
}

float wrap(const float theta_rad) {
  return theta_rad - 2.0 * PI * floor(theta_rad * (0.5 / PI) + 0.5);
}

// Moves `low` on to the first of low to high for which, as `middle`, `is_below` holds, or to high.
#define SEARCH(low, high, is_below)      \
  while (low < high) {                   \
    const uint middle = (low + high) / 2; \
    const bool below = is_below;         \
    low = below ? low : middle + 1;      \
    high = below ? middle : high;        \
  }

Particle initial(const uint particle) {
  const uvec4 words = random(particle, RANDOM_POSE);
  uint low = 0;
  uint high = push.objects - 1;
  SEARCH(low, high,
         push.draw == DRAW_INITIAL ? particle < shares[middle].particle_end
                                   : words.w < shares[middle].chance_end)
  return Particle(low, push.half_x_mm * uniform_of(words.x), push.half_y_mm * uniform_of(words.y),
                  wrap(push.half_theta_rad * uniform_of(words.z)));
}

// The particle that `key` selects. In a multinomial draw, `chance` selects it within its block.
uint find(const uint key, const uint chance) {
  uint low = 0;
  uint high = push.blocks - 1;
  SEARCH(low, high, key < uint(texelFetch(blocks, int(middle)).x))
  const ivec4 block = texelFetch(blocks, int(low));
  const float sum = intBitsToFloat(block.w);
  const float place = push.draw == DRAW_MULTINOMIAL
                          ? (float(chance) + 0.5) * PER_WORD * sum
                          : intBitsToFloat(block.y) -
                                float(uint(block.x) - 1 - key) * intBitsToFloat(block.z);
  // A place rounded up to the whole sum would fall behind the last particle with weight.
  const float target = clamp(place, 0.0, uintBitsToFloat(floatBitsToUint(sum) - 1));

  low *= WEIGHT_BLOCK;
  high = min(low + WEIGHT_BLOCK, push.particles) - 1;
  SEARCH(low, high, target < cumulative[middle])
  return low;
}

Particle moved(const uint ancestor, const uint particle) {
  const Particle from = particles[ancestor];
  const uvec4 words = random(particle, RANDOM_MOTION);
  const vec2 shift = normals(words.xy) * push.motion_mm;
  const float turn = normals(words.zw).x * push.motion_rad;
  return Particle(from.object, from.x_mm + shift.x, from.y_mm + shift.y,
                  wrap(from.theta_rad + turn));
}

void main() {
  const uint particle = gl_GlobalInvocationID.x;
  if (particle >= push.particles) {
    return;
  }
  if (push.draw == DRAW_INITIAL) {
    drawn[particle] = initial(particle);
  } else if (push.draw == DRAW_SAME) {
    drawn[particle] = moved(particle, particle);
  } else {
    const uvec4 words = random(particle, RANDOM_ANCESTOR);
    if (words.z < push.injected) {
      drawn[particle] = initial(particle);
    } else {
      const uint key = push.draw == DRAW_MULTINOMIAL ? words.x : particle;
      drawn[particle] = moved(find(key, words.y), particle);
    }
  }
}
