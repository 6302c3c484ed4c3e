// What every kernel that evaluates the likelihood binds. Tables are texel buffers: measured on
// lavapipe, a likelihood kernel is up to twice as fast as with storage buffers, and GPUs cache them.
// A map that is too large for one is in a storage buffer.
layout(constant_id = 4) const bool MAP_IN_TABLE = true;

layout(binding = 0) uniform samplerBuffer map_table;  // log odds, with a border of prior
layout(std430, binding = 1) readonly buffer Axes { Split axis[]; };  // nx of x, then ny of y
layout(binding = 2) uniform isamplerBuffer elements;   // RotatedElement, [theta, element]
layout(binding = 3) uniform isamplerBuffer segments;   // Segment
layout(std430, binding = 4) buffer Belief { vec2 belief[]; };  // [theta, y, x] of the slab
layout(std430, binding = 5) readonly buffer MapStorage { float map_storage[]; };  // as map_table
layout(push_constant) uniform Push { LikelihoodPush push; };

float log_odds(const int node) {
  return MAP_IN_TABLE ? texelFetch(map_table, node).x : map_storage[node];
}
