// The log-likelihood of an element's reading by the map's log odds below it: Eq. 7, or a table in
// its place. The same as ContactModel in host/model/contact_model.cpp.

// How the kernel evaluates it: AS_PRODUCTS or AS_LOGS (Eq. 7), or AS_TABLE.
layout(constant_id = 1) const uint FORM = AS_PRODUCTS;
// Floor of Eq. 7: gamma m; AS_LOGS its logarithm or NO_FLOOR, because float32 does not hold every floor.
layout(constant_id = 2) const float RANDOM_FLOOR = 0.02;
layout(constant_id = 3) const float TRUST = 0.9;  // 1 - gamma
// Shape of a table: the log odds of its first node, nodes per nat of log odds, and nodes of a row.
layout(constant_id = 4) const float FIRST_LOG_ODDS = -1.0;
layout(constant_id = 5) const float NODES_PER_NAT = 1.0;
layout(constant_id = 6) const uint TABLE_NODES = 2;

layout(binding = 1) uniform samplerBuffer contact_table;  // TableNode, [set, level, node]

const float LOG2_E = 1.4426950408889634;

// The likelihood of a reading (Eq. 7) is (x + y z) / (1 + z), where z = exp(log odds) are the odds of
// occupancy.
vec2 likelihood_terms(const uint reading) {
  const vec2 contact = vec2(RANDOM_FLOOR, RANDOM_FLOOR + TRUST);
  return reading == NO_CONTACT ? contact.yx : contact;
}

// Numerator and denominator of the likelihood: several elements share one division. The clamp at 2^30 changes the ratio by less than one part in 1e6 and keeps the
// product of four factors within float32.
vec2 likelihood_ratio(const vec2 terms, const float log_odds) {
  const float odds = exp2(clamp(log_odds * LOG2_E, -30.0, 30.0));
  return vec2(terms.x + terms.y * odds, 1.0 + odds);
}

// Eq. 7 in logs for contact; that for no contact is the same at the negative log odds.
float contact_log_likelihood(const float log_odds) {
  const float trusted = min(log_odds, 0.0) - log(1.0 + exp(-abs(log_odds))) + log(TRUST);
  if (RANDOM_FLOOR == NO_FLOOR) {
    return trusted;
  }
  return max(trusted, RANDOM_FLOOR) + log(1.0 + exp(-abs(trusted - RANDOM_FLOOR)));
}

float log_likelihood(const uint reading, const float log_odds) {
  return contact_log_likelihood(reading == NO_CONTACT ? -log_odds : log_odds);
}

// Linear between the nodes of a row, constant beyond the first and the last.
float tabled_log_likelihood(const int first_node, const float log_odds) {
  const float place =
      clamp((log_odds - FIRST_LOG_ODDS) * NODES_PER_NAT, 0.0, float(TABLE_NODES - 1));
  const float whole = floor(place);
  const vec2 node = texelFetch(contact_table, first_node + int(whole)).xy;
  return node.x + node.y * (place - whole);
}
