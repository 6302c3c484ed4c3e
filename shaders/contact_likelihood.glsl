// Eq. 7 for one element, as ContactLikelihood in host/model/sensor_model.cpp. Any other function of
// the reading class and the interpolated log odds takes its place here.

layout(constant_id = 1) const float RANDOM_FLOOR = 0.02;  // gamma m
layout(constant_id = 2) const float TRUST = 0.9;          // 1 - gamma
// The plain form needs a floor that float32 holds well; below it the sum is taken in logs.
layout(constant_id = 3) const bool IN_LOGS = false;

float log_likelihood(uint reading, float log_odds) {
  const float l = reading == IN_CONTACT ? log_odds : -log_odds;
  const float z = exp(-abs(l));
  if (!IN_LOGS) {
    return log(RANDOM_FLOOR + TRUST * ((l >= 0.0 ? 1.0 : z) / (1.0 + z)));
  }
  const float trusted = min(l, 0.0) - log(1.0 + z) + log(TRUST);
  if (RANDOM_FLOOR == 0.0) {
    return trusted;
  }
  const float floored = log(RANDOM_FLOOR);
  return max(trusted, floored) + log(1.0 + exp(-abs(trusted - floored)));
}
