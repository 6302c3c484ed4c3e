// A bin's likelihood as the passes of a blur read it. A kernel defines SOURCE and the table `source`
// of single floats, two a bin, before it includes this file.

const float LOWEST = -3e38;

// The word of a bin that holds what SOURCE names.
const int WORD = SOURCE == BLUR_ALONG_Y ? 1 : 0;

float word_of(const uint bin, const vec2 reference) {
  const float word = texelFetch(source, int(2 * bin) + WORD).x;
  if (SOURCE == BLUR_BELIEF) {
    precise float difference =
        (word - reference.x) + (texelFetch(source, int(2 * bin) + 1).x - reference.y);
    return difference;
  }
  return word;
}

const bool IN_LOGS = SOURCE == BLUR_TOUCH || SOURCE == BLUR_BELIEF;

// A term of a sum of likelihoods, relative to the largest of the plane and lifted.
float lifted(const float word, const float largest) {
  return IN_LOGS ? exp(max(word - largest + BLUR_LIFT, BLUR_SMALLEST)) : max(word, 0.0);
}

// The logarithm of the same, however small it is.
float lifted_log(const float word, const float largest) {
  return IN_LOGS ? word - largest + BLUR_LIFT : word > 0.0 ? log(word) : word;
}

// Adds a likelihood to a sum of logs, a pair of the largest term and the sum relative to it.
vec2 log_sum_add(const vec2 sum, const float value, const float weight) {
  const float most = max(sum.x, value);
  return vec2(most, sum.y * exp(max(sum.x - most, NEGLIGIBLE)) +
                        weight * exp(max(value - most, NEGLIGIBLE)));
}
