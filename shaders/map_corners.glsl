// The map that a kernel interpolates. Tables are texel buffers: measured on lavapipe, a likelihood
// kernel is up to twice as fast as with storage buffers, and GPUs cache them. Maps that are too large
// for a table are in a storage buffer.
layout(constant_id = 7) const bool MAP_IN_TABLE = true;

layout(binding = 3) uniform samplerBuffer map_table;  // Corners of nodes, with a border of prior
layout(std430, binding = 4) readonly buffer MapStorage { float map_storage[]; };  // nodes alone

// Log odds at a node, its right neighbour, the one above and the one above that neighbour.
vec4 corners(const int node, const int map_width) {
  return MAP_IN_TABLE ? texelFetch(map_table, node)
                      : vec4(map_storage[node], map_storage[node + 1],
                             map_storage[node + map_width], map_storage[node + map_width + 1]);
}
