#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// Replaces likelihoods by their weighted means over neighbours along one axis, in logs. An invocation
// takes STRIP consecutive bins of a line, so that each likelihood is read once for all of them. The
// pass along y writes the second word of each bin and reads the first; the pass along x reads the
// second and writes the first: no invocation reads what another one writes.

#include "interface.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 1) const uint SOURCE = BLUR_TOUCH;
layout(constant_id = 2) const uint STRIP = 16;

layout(binding = 0) uniform samplerBuffer source;       // two words a bin
layout(binding = 1) uniform samplerBuffer references;   // [object] log-likelihood in two floats
layout(binding = 2) uniform samplerBuffer plane_max;    // [object, theta]
// By distance in bins, STRIP zeros after the last; then, for each bin of the axis, 1 over the sum of
// the weights that lie inside.
layout(binding = 3) uniform samplerBuffer weights;
layout(std430, binding = 4) writeonly buffer Result { float result[]; };  // two words a bin
layout(push_constant) uniform Push { BlurPush push; };

#include "blurred_bin.glsl"

const bool ALONG_X = SOURCE == BLUR_ALONG_Y;
const float LEAST = ALONG_X ? LEAST_ALONG_X : LEAST_ALONG_Y;

#define FOR_EACH_BIN [[unroll]] for (uint b = 0; b < STRIP; ++b)

void main() {
  const uint count = ALONG_X ? push.slab.nx : push.slab.ny;
  const uint lines = ALONG_X ? push.slab.ny : push.slab.nx;
  const uint strips = (count + STRIP - 1) / STRIP;
  const uint id = gl_GlobalInvocationID.x;
  if (id >= strips * lines) {
    return;
  }
  const uint line = ALONG_X ? id / strips : id % lines;
  const int begin = int((ALONG_X ? id % strips : id / lines) * STRIP);
  const uint object = push.slab.object_first + gl_WorkGroupID.y;
  const uint theta = push.slab.theta_first + gl_WorkGroupID.z;
  const uint first = gl_WorkGroupID.y * push.slab.stride +
                     gl_WorkGroupID.z * push.slab.nx * push.slab.ny +
                     line * (ALONG_X ? push.slab.nx : 1);
  const uint step = ALONG_X ? 1 : push.slab.nx;
  const vec2 reference = texelFetch(references, int(object)).xy;
  const float largest = texelFetch(plane_max, int(object * push.slab.all_thetas + theta)).x;
  const int steps = int(push.steps);
  const int norms = steps + 1 + int(STRIP);

  // weight[b] is the weight of the current bin for bin b of the strip.
  float weight[STRIP];
  float sum[STRIP];
  FOR_EACH_BIN {
    weight[b] = 0.0;
    sum[b] = 0.0;
  }
  const int end = int(STRIP) + steps;
  for (int j = -steps; j < end; ++j) {
    [[unroll]] for (uint b = STRIP - 1; b > 0; --b) { weight[b] = weight[b - 1]; }
    weight[0] = texelFetch(weights, min(abs(j), norms - 1)).x;
    const int at = begin + j;
    const float likelihood =
        at >= 0 && at < int(count)
            ? lifted(word_of(first + uint(at) * step, reference), largest)
            : 0.0;
    FOR_EACH_BIN { sum[b] += weight[b] * likelihood; }
  }

  const uint word = ALONG_X ? 0 : 1;
  uint poor = 0;
  FOR_EACH_BIN {
    const uint at = uint(begin) + b;
    if (at < count) {
      const float mean = sum[b] * texelFetch(weights, norms + int(at)).x;
      poor |= mean < LEAST ? 1u << b : 0;
      result[2 * (first + at * step) + word] = mean;
    }
  }
  for (uint b = 0; poor >> b != 0; ++b) {
    const int at = begin + int(b);
    vec2 logs = vec2(LOWEST, 0.0);
    for (int k = (poor >> b & 1u) != 0 ? -steps : end; k <= steps; ++k) {
      if (at + k >= 0 && at + k < int(count)) {
        logs = log_sum_add(logs,
                           lifted_log(word_of(first + uint(at + k) * step, reference), largest),
                           texelFetch(weights, abs(k)).x);
      }
    }
    if ((poor >> b & 1u) != 0) {
      result[2 * (first + uint(at) * step) + word] =
          min(logs.x + log(logs.y * texelFetch(weights, norms + at).x), log(LEAST));
    }
  }
}
