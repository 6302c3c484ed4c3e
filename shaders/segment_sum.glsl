// Sums the log-likelihood of a dispatch's segments (Eq. 7, 13) at the BINS places of an invocation:
// bins of a lattice, or one particle. A kernel defines BINS and FACTORS_PER_DIVISION before it
// includes this file, and interpolate() after it.

#include "contact_likelihood.glsl"
#include "two_float.glsl"

layout(binding = 0) uniform isamplerBuffer segments;  // Segment

#define FOR_EACH_BIN [[unroll]] for (uint b = 0; b < BINS; ++b)

float log_odds_of[BINS];  // under one element, at every place
vec2 sum[BINS];           // log-likelihoods, in two floats

// Fills log_odds_of for one element, by its index in the table of elements.
void interpolate(const int element);

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
