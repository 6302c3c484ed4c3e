// The log-likelihood of a bin as the passes of a blur read it. A kernel defines SOURCE and the table
// `source` before it includes this file.

const float LOWEST = -3e38;

float value_of(const uint bin, const vec2 reference) {
  const vec4 texel = texelFetch(source, int(bin / 2));
  const vec2 pair = bin % 2 == 0 ? texel.xy : texel.zw;
  if (SOURCE == BLUR_BELIEF) {
    precise float difference = (pair.x - reference.x) + (pair.y - reference.y);
    return difference;
  }
  return SOURCE == BLUR_TOUCH ? pair.x : pair.y;
}

// exp(value) for a sum; what is clamped is too small to count in one that is kept.
float lifted(const float below_largest) {
  return exp(max(below_largest + BLUR_LIFT, NEGLIGIBLE));
}

// Adds a likelihood to a sum of logs, a pair of the largest term and the sum relative to it.
vec2 log_sum_add(const vec2 sum, const float value, const float weight) {
  const float most = max(sum.x, value);
  return vec2(most, sum.y * exp(max(sum.x - most, NEGLIGIBLE)) +
                        weight * exp(max(value - most, NEGLIGIBLE)));
}
