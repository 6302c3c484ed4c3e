// What every kernel that evaluates the likelihood over a lattice binds. Workgroups differ by theta
// along z and by object along y. Tables are texel buffers: measured on lavapipe, a likelihood kernel
// is up to twice as fast as with storage buffers, and GPUs cache them. Maps that are too large for a
// table are in a storage buffer.
layout(constant_id = 8) const bool MAP_IN_TABLE = true;

layout(binding = 2) uniform isamplerBuffer elements;   // RotatedElement, [theta, element]
layout(binding = 3) uniform samplerBuffer map_table;   // Corners of nodes, with a border of prior
layout(std430, binding = 4) readonly buffer MapStorage { float map_storage[]; };  // nodes alone
layout(std430, binding = 5) readonly buffer Axes { Split axis[]; };  // [object], nx of x, then ny of y
layout(std430, binding = 6) readonly buffer Places { ObjectPlace places[]; };
layout(std430, binding = 7) buffer Belief { vec2 belief[]; };  // [object, theta, y, x] of the slab
layout(push_constant) uniform Push { LikelihoodPush push; };

// Log odds at a node, its right neighbour, the one above and the one above that neighbour.
vec4 corners(const int node, const int map_width) {
  return MAP_IN_TABLE ? texelFetch(map_table, node)
                      : vec4(map_storage[node], map_storage[node + 1],
                             map_storage[node + map_width], map_storage[node + map_width + 1]);
}
