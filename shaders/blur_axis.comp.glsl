#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// Replaces likelihoods by their weighted means over neighbours along one axis. An invocation takes a
// strip of consecutive bins of one line or of two, so that each likelihood is read once for all of
// them. The pass along y writes the second word of each bin and reads the first; the pass along x
// reads the second and writes the first: no invocation reads what another one writes.

#include "interface.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 1) const uint SOURCE = BLUR_TOUCH;
layout(constant_id = 2) const uint STEPS = 0;     // the weights reach as many bins to either side
layout(constant_id = 3) const bool EVEN = false;  // rows have an even number of bins

// A Gaussian that reaches no farther has its weights in registers; another reads the table.
const uint REGISTER_STEPS = 32;
float weight_at[REGISTER_STEPS + 1];

layout(binding = 0) uniform samplerBuffer source;      // two bins a texel
layout(binding = 1) uniform samplerBuffer references;  // [object] log-likelihood in two floats
layout(std430, binding = 2) readonly buffer PlaneMax { float plane_max[]; };  // [object, theta]
layout(binding = 3) uniform samplerBuffer weights;  // by distance in bins; then their logarithms
// For each bin of the axis, 1 over the sum of the weights that lie inside.
layout(std430, binding = 4) readonly buffer Norms { float norms[]; };
layout(std430, binding = 5) writeonly buffer Result { float result[]; };  // two words a bin
layout(push_constant) uniform Push { PlanesPush push; };

#include "blurred_bin.glsl"

const bool ALONG_X = SOURCE == BLUR_ALONG_Y;
const float LEAST = ALONG_X ? LEAST_ALONG_X : LEAST_ALONG_Y;
const int BINS = int(ALONG_X ? BLUR_STRIP_X : BLUR_STRIP_Y);  // of a line
const int LINES = ALONG_X ? 1 : 2;
const int REACH = int(STEPS);
// A read takes two neighbouring bins of a row. Strips begin at even bins, and so do their reads: a
// read that begins outside lies outside.
const int STRIDE = ALONG_X ? 2 : 1;
const int BEGIN = ALONG_X ? -REACH - REACH % 2 : -REACH;

float weight_of(const int distance) {
  return STEPS <= REGISTER_STEPS ? weight_at[min(distance, int(REGISTER_STEPS))]
                                      : texelFetch(weights, distance).x;
}

// What an invocation works on.
int count;       // bins of its lines
int begin;       // the strip's first bin
uint first;      // the line's first bin in the slab
uint step;       // from one bin of a line to the next
vec2 reference;  // of the object
float largest;   // of the plane
float sum[BINS * LINES];

// Adds what lies `j` bins behind the strip's first.
void add(const int j) {
  const int at = begin + j;
  const bool inside = at >= 0 && at < count;
  const bool next_inside = ALONG_X ? inside && at + 1 < count : inside;
  const vec2 words = words_of(first + uint(inside ? at : 0) * step, reference, EVEN);
  const vec2 likelihood = vec2(inside ? lifted(words.x, largest) : 0.0,
                               next_inside ? lifted(words.y, largest) : 0.0);
  [[unroll]] for (int b = 0; b < BINS; ++b) {
    if (ALONG_X) {
      if (abs(j - b) <= REACH) {
        sum[b] += weight_of(abs(j - b)) * likelihood.x;
      }
      if (abs(j + 1 - b) <= REACH) {
        sum[b] += weight_of(abs(j + 1 - b)) * likelihood.y;
      }
    } else if (abs(j - b) <= REACH) {
      sum[2 * b] += weight_of(abs(j - b)) * likelihood.x;
      sum[2 * b + 1] += weight_of(abs(j - b)) * likelihood.y;
    }
  }
}

void main() {
  const int nx = int(push.nx);
  count = ALONG_X ? nx : int(push.ny);
  const uint across = ALONG_X ? push.ny : (push.nx + 1) / 2;
  const uint strips = uint((count + BINS - 1) / BINS);
  const uint id = gl_GlobalInvocationID.x;
  if (id >= strips * across) {
    return;
  }
  const uint line = ALONG_X ? id / strips : id % across * 2;
  begin = int(ALONG_X ? id % strips : id / across) * BINS;
  const uint object = push.object_first + gl_WorkGroupID.y;
  const uint theta = push.theta_first + gl_WorkGroupID.z;
  first = gl_WorkGroupID.y * push.stride + gl_WorkGroupID.z * push.nx * push.ny +
                     line * (ALONG_X ? push.nx : 1);
  step = ALONG_X ? 1 : push.nx;
  reference = texelFetch(references, int(object)).xy;
  largest = plane_max[object * push.all_thetas + theta];

  if (STEPS <= REGISTER_STEPS) {
    [[unroll]] for (int k = 0; k <= REACH; ++k) {
      weight_at[k] = texelFetch(weights, k).x;
    }
  }
  [[unroll]] for (int b = 0; b < BINS * LINES; ++b) { sum[b] = 0.0; }
  if (STEPS <= REGISTER_STEPS) {
    [[unroll]] for (int j = BEGIN; j < BINS + REACH; j += STRIDE) { add(j); }
  } else {
    for (int j = BEGIN; j < BINS + REACH; j += STRIDE) { add(j); }
  }

  const float vague = vague_below(LEAST, texelFetch(weights, REACH).x);
  const uint word = ALONG_X ? 0 : 1;
  uint poor = 0;
  [[unroll]] for (int b = 0; b < BINS * LINES; ++b) {
    const int at = begin + b / LINES;
    const uint beside = ALONG_X ? 0 : uint(b % 2);
    if (at < count && line + beside < (ALONG_X ? push.ny : push.nx)) {
      const float mean = sum[b] * norms[at];
      poor |= mean < vague ? 1u << b : 0;
      result[2 * (first + beside + uint(at) * step) + word] = mean;
    }
  }
  for (int b = 0; poor >> b != 0; ++b) {
    const bool wanted = (poor >> b & 1u) != 0;
    const int at = begin + b / LINES;
    const uint from = first + (ALONG_X ? 0 : uint(b % 2));
    vec2 logs = vec2(LOWEST, 0.0);
    for (int k = wanted ? -REACH : REACH + 1; k <= REACH; ++k) {
      if (at + k >= 0 && at + k < count) {
        logs = log_sum_add(logs,
                           lifted_log(word_of(from + uint(at + k) * step, reference), largest) +
                               texelFetch(weights, REACH + 1 + abs(k)).x,
                           1.0);
      }
    }
    if (wanted) {
      const float mean = logs.x + log(logs.y * norms[at]);
      result[2 * (from + uint(at) * step) + word] = mean < log(LEAST) ? mean : exp(mean);
    }
  }
}
