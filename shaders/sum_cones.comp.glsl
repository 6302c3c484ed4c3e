#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// Evaluates the Parzen estimate with a cone kernel (Eq. 10, 11), rho = 1 mm and 1 rad, at a tile of
// grid points per workgroup, over ranges of the sorted particles. The host adds a tile's units.

#include "interface.h"

layout(local_size_x = PARZEN_EDGE * PARZEN_THETAS) in;

layout(constant_id = 0) const bool PARTICLES_IN_TABLE = true;  // else in storage

layout(binding = 0) uniform samplerBuffer particle_table;  // x_mm, y_mm, theta_rad, weight
layout(std430, binding = 1) readonly buffer Particles { vec4 particle_storage[]; };
layout(std430, binding = 2) readonly buffer Ranges { uvec2 ranges[]; };
layout(std430, binding = 3) readonly buffer Units { ConeUnit units[]; };
layout(std430, binding = 4) writeonly buffer Densities { vec4 densities[]; };  // [unit, theta, y]
layout(push_constant) uniform Push { ConePush push; };

const float TWO_PI = 6.28318530717959;

void main() {
  const uint lane = gl_LocalInvocationID.x;
  const ConeUnit unit = units[gl_WorkGroupID.x];
  const vec4 x_mm = push.step_mm * (float(unit.x) + vec4(0.0, 1.0, 2.0, 3.0));
  const float y_mm = push.step_mm * float(unit.y + int(lane) % PARZEN_EDGE);
  const float theta_rad = push.step_rad * float(unit.theta + int(lane) / PARZEN_EDGE);

  vec4 sum = vec4(0.0);
  for (uint r = unit.range_first; r < unit.range_end; ++r) {
    const uvec2 range = ranges[r];
    vec4 part = vec4(0.0);  // one sum per range rounds less than one sum for all
    for (uint i = range.x; i < range.y; ++i) {
      const vec4 particle =
          PARTICLES_IN_TABLE ? texelFetch(particle_table, int(i)) : particle_storage[i];
      const vec4 dx = particle.x - x_mm;
      const float dy = particle.y - y_mm;
      const float turn = particle.z - theta_rad;
      const float dtheta = turn - TWO_PI * floor(turn * (1.0 / TWO_PI) + 0.5);
      part += particle.w * max(1.0 - sqrt(dx * dx + (dy * dy + dtheta * dtheta)), 0.0);
    }
    sum += part;
  }
  densities[gl_WorkGroupID.x * gl_WorkGroupSize.x + lane] = sum;
}
