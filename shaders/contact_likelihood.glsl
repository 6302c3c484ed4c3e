// Eq. 7 for one element, as ContactLikelihood in host/model/sensor_model.cpp. Any other function of
// the reading class and the interpolated log odds takes its place here.

// gamma m; where IN_LOGS its logarithm, for float32 does not hold every floor, or NO_FLOOR.
layout(constant_id = 1) const float RANDOM_FLOOR = 0.02;
layout(constant_id = 2) const float TRUST = 0.9;          // 1 - gamma
// Products of likelihoods need a floor that eight factors keep within float32; below it, the
// likelihood is evaluated and summed in logs.
layout(constant_id = 3) const bool IN_LOGS = false;

const float LOG2_E = 1.4426950408889634;

// With odds z = exp(log odds of occupancy) the likelihood of every reading class is a ratio,
// (n.x + n.y z) / (d.x + d.y z).
struct ReadingRatio {
  vec2 n;
  vec2 d;
};

ReadingRatio reading_ratio(const uint reading) {
  const vec2 contact = vec2(RANDOM_FLOOR, RANDOM_FLOOR + TRUST);
  const vec2 no_contact = contact.yx;
  return ReadingRatio(reading == NO_CONTACT        ? no_contact
                      : reading == UNKNOWN_INSTEAD ? vec2(1.0)
                                                   : contact,
                      reading <= IN_CONTACT ? vec2(1.0) : no_contact);
}

// Numerator and denominator, so that several elements share one division. The clamp at 2^30 changes
// the likelihood by less than one part in 1e6 and lets four factors multiply safely.
vec2 likelihood_ratio(const ReadingRatio ratio, const float log_odds) {
  const float odds = exp2(clamp(log_odds * LOG2_E, -30.0, 30.0));
  return vec2(ratio.n.x + ratio.n.y * odds, ratio.d.x + ratio.d.y * odds);
}

// Log-likelihood of contact; that of none is the same at the negative log odds.
float contact_log_likelihood(const float log_odds) {
  const float trusted = min(log_odds, 0.0) - log(1.0 + exp(-abs(log_odds))) + log(TRUST);
  if (RANDOM_FLOOR == NO_FLOOR) {
    return trusted;
  }
  return max(trusted, RANDOM_FLOOR) + log(1.0 + exp(-abs(trusted - RANDOM_FLOOR)));
}

float log_likelihood(const uint reading, const float log_odds) {
  const float said = reading == UNKNOWN_INSTEAD ? 0.0
                     : reading == NO_CONTACT    ? contact_log_likelihood(-log_odds)
                                                : contact_log_likelihood(log_odds);
  return reading <= IN_CONTACT ? said : said - contact_log_likelihood(-log_odds);
}
