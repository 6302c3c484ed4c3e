#version 450
#extension GL_GOOGLE_include_directive : require

// Philox words of given counters and keys, for comparison with published ones and the host's.

layout(local_size_x = 64) in;

#include "../../shaders/philox.glsl"

struct Input {
  uint counter[4];
  uint key[2];
};

layout(std430, binding = 0) readonly buffer Inputs { Input inputs[]; };
layout(std430, binding = 1) writeonly buffer Words { uvec4 words[]; };
layout(push_constant) uniform Push { uint count; } push;

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i < push.count) {
    const Input given = inputs[i];
    words[i] = philox(uvec4(given.counter[0], given.counter[1], given.counter[2], given.counter[3]),
                      uvec2(given.key[0], given.key[1]));
  }
}
