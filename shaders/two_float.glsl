// Sums as unevaluated pairs high + low (Knuth's TwoSum). `precise` keeps compilers from simplifying
// the rounding errors away.

vec2 two_float_add(vec2 sum, float value) {
  precise float high = sum.x + value;
  precise float rest = high - sum.x;
  precise float error = (sum.x - (high - rest)) + (value - rest);
  precise float low = sum.y + error;
  precise float renormalised = high + low;
  precise float remainder = low - (renormalised - high);
  return vec2(renormalised, remainder);
}

vec2 two_float_sum(vec2 a, vec2 b) {
  const vec2 sum = two_float_add(a, b.x);
  return two_float_add(sum, b.y);
}

// The exact product of two floats (Dekker 1971).
vec2 two_float_product(float a, float b) {
  const float splitter = 4097.0;
  precise float a_scaled = splitter * a;
  precise float b_scaled = splitter * b;
  precise float a_high = a_scaled - (a_scaled - a);
  precise float b_high = b_scaled - (b_scaled - b);
  precise float a_low = a - a_high;
  precise float b_low = b - b_high;
  precise float product = a * b;
  precise float error =
      (((a_high * b_high - product) + a_high * b_low) + a_low * b_high) + a_low * b_low;
  return vec2(product, error);
}

// Log-likelihood differences are clamped at -80 nats: smaller terms change no float32 sum and would
// make exp() slow.
const float NEGLIGIBLE = -80.0;

// Compares two logarithms, each a normalised pair.
bool exceeds(const vec2 a, const vec2 b) { return a.x > b.x || (a.x == b.x && a.y > b.y); }

// exp(value - reference) of such logarithms.
float relative(const vec2 value, const vec2 reference) {
  precise float difference = (value.x - reference.x) + (value.y - reference.y);
  return exp(max(difference, NEGLIGIBLE));
}
