#version 450

// target[i] = FACTOR * source[i] + addend, for i < count.

layout(local_size_x_id = 0) in;
layout(constant_id = 1) const uint FACTOR = 1;

layout(std430, binding = 0) readonly buffer Source { uint source[]; };
layout(std430, binding = 1) buffer Target { uint target[]; };
layout(push_constant) uniform Push {
  uint count;
  uint addend;
} push;

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i < push.count) {
    target[i] = FACTOR * source[i] + push.addend;
  }
}
