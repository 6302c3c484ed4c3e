// What every kernel that evaluates the likelihood over a lattice binds. Workgroups differ by theta
// along z and by object along y.
#include "map_corners.glsl"

layout(binding = 2) uniform isamplerBuffer elements;  // RotatedElement, [theta, element]
layout(std430, binding = 5) readonly buffer Axes { Split axis[]; };  // [object], nx of x, then ny of y
layout(std430, binding = 6) readonly buffer Places { ObjectPlace places[]; };
layout(std430, binding = 7) buffer Belief { vec2 belief[]; };  // [object, theta, y, x] of the slab
layout(push_constant) uniform Push { LikelihoodPush push; };
