// A bin's likelihood as the passes of a blur read it. A kernel defines SOURCE and the table `source`,
// two bins of two words a texel, before it includes this file.

#include "two_float.glsl"

// A pass leaves a mean likelihood relative to the largest of the plane, times exp(BLUR_LIFT), or the
// logarithm of this, which is negative, where it lies below a limit. The limits grow from pass to
// pass, so that what a sum leaves out below one changes no sum above the next by more than 1e-4.
const float BLUR_LIFT = 80.0;
const float BLUR_SMALLEST = -86.0;  // exp() of it is a normal float
const float BLUR_LARGEST = 88.0;    // exp() of it is finite
const float LEAST_ALONG_Y = 1e-31;
const float LEAST_ALONG_X = 1e-25;
const float LEAST_OF_TURNS = 1e-19;
// Weights of a Gaussian are followed by their logarithms. Where float32 does not hold the least of
// them, a sum that is smaller than BLUR_VAGUE, some 75 nats below the largest of the plane, is made
// again of logarithms.
const float LEAST_WEIGHT = 1.2e-38;
const float BLUR_VAGUE = 100.0;

const float LOWEST = -3e38;

// What SOURCE names, of a bin's two words.
float word_in(const vec2 bin, const vec2 reference) {
  if (SOURCE == BLUR_BELIEF) {
    precise float difference = (bin.x - reference.x) + (bin.y - reference.y);
    return difference;
  }
  return SOURCE == BLUR_ALONG_Y ? bin.y : bin.x;
}

float word_of(const uint bin, const vec2 reference) {
  // The bin after a slab's last may be asked for, and is not used.
  const vec4 texel = texelFetch(source, min(int(bin / 2), textureSize(source) - 1));
  return word_in(bin % 2 == 0 ? texel.xy : texel.zw, reference);
}

// The words of a bin and the next one.
vec2 words_of(const uint bin, const vec2 reference, const bool even) {
  if (even) {
    const vec4 texel = texelFetch(source, int(bin / 2));
    return vec2(word_in(texel.xy, reference), word_in(texel.zw, reference));
  }
  return vec2(word_of(bin, reference), word_of(bin + 1, reference));
}

const bool IN_LOGS = SOURCE == BLUR_TOUCH || SOURCE == BLUR_BELIEF;

// A term of a sum of likelihoods, relative to the largest of the plane and lifted.
float lifted(const float word, const float largest) {
  return IN_LOGS ? exp(clamp(word - largest + BLUR_LIFT, BLUR_SMALLEST, BLUR_LARGEST))
                 : max(word, 0.0);
}

// The logarithm of the same, however small it is.
float lifted_log(const float word, const float largest) {
  return IN_LOGS ? word - largest + BLUR_LIFT : word > 0.0 ? log(word) : word;
}

// Below which a sum of likelihoods is made again of their logarithms.
float vague_below(const float least, const float least_weight) {
  return least_weight < LEAST_WEIGHT ? BLUR_VAGUE : least;
}

// Adds a likelihood to a sum of logs, a pair of the largest term and the sum relative to it. A weight
// that may be far from 1 belongs into the likelihood: the largest term decides what is negligible.
vec2 log_sum_add(const vec2 sum, const float value, const float weight) {
  const float highest = max(sum.x, value);
  return vec2(highest, sum.y * exp(max(sum.x - highest, NEGLIGIBLE)) +
                        weight * exp(max(value - highest, NEGLIGIBLE)));
}
