// Sums the log-likelihood of a dispatch's segments (Eq. 7, 13) at the BINS places of an invocation:
// bins of a lattice, or one particle. A kernel defines BINS and FACTORS_PER_DIVISION before it
// includes this file, and interpolate() after it.

#include "two_float.glsl"

// How the kernel evaluates a reading by the map's log odds below its element, as ContactModel in
// host/model/contact_model.cpp does: AS_PRODUCTS or AS_LOGS (Eq. 7), or AS_TABLE.
layout(constant_id = 1) const uint FORM = AS_PRODUCTS;
// Floor of Eq. 7: gamma m; AS_LOGS its logarithm or NO_FLOOR, because float32 does not hold every floor.
layout(constant_id = 2) const float RANDOM_FLOOR = 0.02;
layout(constant_id = 3) const float TRUST = 0.9;  // 1 - gamma
// Shape of a table: the log odds of its first node, nodes per nat of log odds, and nodes of a row.
layout(constant_id = 4) const float FIRST_LOG_ODDS = -1.0;
layout(constant_id = 5) const float NODES_PER_NAT = 1.0;
layout(constant_id = 6) const uint TABLE_NODES = 2;
// Tables are texel buffers: measured on lavapipe, a likelihood kernel is up to twice as fast as with
// storage buffers, and GPUs cache them. Maps that are too large for a table are in a storage buffer.
layout(constant_id = 7) const bool MAP_IN_TABLE = true;

layout(binding = 0) uniform isamplerBuffer segments;      // Segment
layout(binding = 1) uniform samplerBuffer contact_table;  // TableNode, [set, level, node]
layout(binding = 3) uniform samplerBuffer map_table;  // Corners of nodes, with a border of prior
layout(std430, binding = 4) readonly buffer MapStorage { float map_storage[]; };  // nodes alone

#define FOR_EACH_BIN [[unroll]] for (uint b = 0; b < BINS; ++b)

const float LOG2_E = 1.4426950408889634;

float log_odds_of[BINS];  // under one element, at every place
vec2 sum[BINS];           // log-likelihoods, in two floats

// Fills log_odds_of for one element, by its index in the table of elements.
void interpolate(const int element);

// Log odds at a node, its right neighbour, the one above and the one above that neighbour.
vec4 corners(const int node, const int map_width) {
  return MAP_IN_TABLE ? texelFetch(map_table, node)
                      : vec4(map_storage[node], map_storage[node + 1],
                             map_storage[node + map_width], map_storage[node + map_width + 1]);
}

// Bilinear between four corners.
float between(const vec4 corner, const vec2 f) {
  const float low = corner.x + (corner.y - corner.x) * f.x;
  const float high = corner.z + (corner.w - corner.z) * f.x;
  return low + (high - low) * f.y;
}

// The likelihood of a reading (Eq. 7) is (x + y z) / (1 + z), where z = exp(log odds) are the odds of
// occupancy.
vec2 likelihood_terms(const uint reading) {
  const vec2 contact = vec2(RANDOM_FLOOR, RANDOM_FLOOR + TRUST);
  return reading == NO_CONTACT ? contact.yx : contact;
}

// Numerator and denominator of the likelihood: several elements share one division. The clamp at 2^30
// changes the ratio by less than one part in 1e6 and keeps the product of four factors within float32.
vec2 likelihood_ratio(const vec2 terms, const float log_odds) {
  const float odds = exp2(clamp(log_odds * LOG2_E, -30.0, 30.0));
  return vec2(terms.x + terms.y * odds, 1.0 + odds);
}

// Eq. 7 in logs; that for no contact is the one for contact at the negative log odds.
float log_likelihood(const uint reading, const float log_odds) {
  const float l = reading == NO_CONTACT ? -log_odds : log_odds;
  const float trusted = min(l, 0.0) - log(1.0 + exp(-abs(l))) + log(TRUST);
  if (RANDOM_FLOOR == NO_FLOOR) {
    return trusted;
  }
  return max(trusted, RANDOM_FLOOR) + log(1.0 + exp(-abs(trusted - RANDOM_FLOOR)));
}

// Linear between the nodes of a row, constant beyond the first and the last.
float tabled_log_likelihood(const int first_node, const float log_odds) {
  const float place =
      clamp((log_odds - FIRST_LOG_ODDS) * NODES_PER_NAT, 0.0, float(TABLE_NODES - 1));
  const float whole = floor(place);
  const vec2 node = texelFetch(contact_table, first_node + int(whole)).xy;
  return node.x + node.y * (place - whole);
}

// Eq. 7 as products of ratios: one logarithm for FACTORS_PER_LOG elements, and one division for
// FACTORS_PER_DIVISION. Where this is 1, the constant condition removes the innermost loop.
void add_products(const ivec4 segment) {
  const vec2 terms = likelihood_terms(uint(segment.z));
  float product[BINS];
  float numerator[BINS];
  float denominator[BINS];
  for (int group = segment.x; group < segment.y; group += int(FACTORS_PER_LOG)) {
    const int group_end = min(group + int(FACTORS_PER_LOG), segment.y);
    FOR_EACH_BIN { product[b] = 1.0; }
    for (int quotient = group; quotient < group_end; quotient += int(FACTORS_PER_DIVISION)) {
      const int end = min(quotient + int(FACTORS_PER_DIVISION), group_end);
      FOR_EACH_BIN {
        numerator[b] = 1.0;
        denominator[b] = 1.0;
      }
      int k = quotient;
      do {
        interpolate(k);
        FOR_EACH_BIN {
          const vec2 ratio = likelihood_ratio(terms, log_odds_of[b]);
          numerator[b] *= ratio.x;
          denominator[b] *= ratio.y;
        }
      } while (FACTORS_PER_DIVISION > 1 && ++k < end);
      FOR_EACH_BIN { product[b] *= numerator[b] / denominator[b]; }
    }
    FOR_EACH_BIN { sum[b] = two_float_add(sum[b], log(product[b])); }
  }
}

// Sums of log-likelihoods. A table's numbers are summed FACTORS_PER_LOG at a time in one float.
void add_logs(const ivec4 segment, const int first_node) {
  const uint reading = uint(segment.z);
  const int node = first_node + int(reading * TABLE_NODES);
  const int terms = FORM == AS_TABLE ? int(FACTORS_PER_LOG) : 1;
  float part[BINS];
  for (int group = segment.x; group < segment.y; group += terms) {
    const int end = min(group + terms, segment.y);
    FOR_EACH_BIN { part[b] = 0.0; }
    int k = group;
    do {
      interpolate(k);
      FOR_EACH_BIN {
        const float l = log_odds_of[b];
        part[b] += FORM == AS_TABLE ? tabled_log_likelihood(node, l) : log_likelihood(reading, l);
      }
    } while (terms > 1 && ++k < end);
    FOR_EACH_BIN { sum[b] = two_float_add(sum[b], part[b]); }
  }
}

// Adds `count` segments to the sums; `first_node` is where the object's part of the contact table
// begins.
void add_segments(const uint count, const int first_node) {
  for (uint s = 0; s < count; ++s) {
    const ivec4 segment = texelFetch(segments, int(s));
    if (FORM == AS_PRODUCTS) {
      add_products(segment);
    } else {
      add_logs(segment, first_node);
    }
  }
}
