// A sum kept as an unevaluated pair high + low, after Knuth's TwoSum. `precise` keeps compilers from
// simplifying the rounding errors away.

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
