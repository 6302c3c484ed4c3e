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
