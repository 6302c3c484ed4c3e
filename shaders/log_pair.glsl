// Logs as pairs high + low that two_float_add() has normalised.

bool exceeds(const vec2 a, const vec2 b) { return a.x > b.x || (a.x == b.x && a.y > b.y); }

// exp(value - reference).
float relative(const vec2 value, const vec2 reference) {
  precise float difference = (value.x - reference.x) + (value.y - reference.y);
  return exp(max(difference, NEGLIGIBLE));
}
