#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// Weighs particles by the log-likelihood of a touch (Eq. 7), one particle per invocation, each at a
// pose and on a map of its own.
//
// In plain float32 the place of an element, some hundred cells from the map's corner, would be off
// by 1e-5 cells and the weight by more than 1e-4 nats. Hence the coarse parts, whose products are
// exact and whose whole cells can be taken off before anything is rounded.

#include "interface.h"

layout(local_size_x_id = 0) in;

const uint BINS = 1;
const uint FACTORS_PER_DIVISION = 1;

#include "segment_sum.glsl"

layout(binding = 2) uniform samplerBuffer turns;  // CoarseAndFine: headings, then elements
layout(std430, binding = 5) readonly buffer Objects { ParticleMap objects[]; };
layout(std430, binding = 6) readonly buffer Particles { Particle particles[]; };
layout(std430, binding = 7) buffer LogWeights { vec2 log_weights[]; };  // two floats
layout(push_constant) uniform Push { WeighPush push; };

// 2 pi / HEADINGS as a number of few bits, of which multiples are exact, and the rest.
const float HEADING_COARSE = 51471.0 / 2097152.0;
const float HEADING_FINE = 4.07236297e-07;
const float FARTHEST_CELLS = 16777216.0;

ParticleMap object;
Split x;  // the particle's place, in cells of the map
Split y;
vec4 turn;  // its direction
int table;  // the first element in cells of the map

// Cosine and sine of an angle in [-pi, pi], coarse and fine.
vec4 direction(const float theta_rad) {
  const float heading = floor(theta_rad * (1.0 / (HEADING_COARSE + HEADING_FINE)) + 0.5);
  precise float exact_rest = theta_rad - heading * HEADING_COARSE;
  const float rest = exact_rest - heading * HEADING_FINE;
  const vec4 turn = texelFetch(turns, int(heading) & int(HEADINGS - 1));
  const vec2 whole = turn.xy + turn.zw;
  // |rest| < 0.013: the next terms are below 1e-12.
  const float square = rest * rest;
  const float sine = rest * (1.0 - square / 6.0);
  const float versine = square * (0.5 - square / 24.0);
  return vec4(turn.xy, turn.zw + vec2(-whole.y, whole.x) * sine - whole * versine);
}

// A coordinate relative to the region's centre, in cells of the map.
Split in_cells(const float from_centre_mm, const Split centre) {
  const vec2 cells = two_float_product(from_centre_mm, object.cells_per_mm_high);
  const float whole = floor(cells.x);
  const float rest = (cells.x - whole) + (cells.y + from_centre_mm * object.cells_per_mm_low);
  return Split(centre.cell + int(clamp(whole, -FARTHEST_CELLS, FARTHEST_CELLS)),
               rest + centre.fraction);
}

// Bilinear in log odds, where an element meets the map. Outside of it both nodes are of the border
// and hold the prior.
void interpolate(const int element_index) {
  const vec4 element = texelFetch(turns, table + element_index);
  const vec2 coarse = vec2(turn.x * element.x - turn.y * element.y,
                           turn.y * element.x + turn.x * element.y);
  const vec2 whole_element = element.xy + element.zw;
  const vec2 fine = vec2(turn.x * element.z - turn.y * element.w,
                         turn.y * element.z + turn.x * element.w) +
                    vec2(turn.z * whole_element.x - turn.w * whole_element.y,
                         turn.w * whole_element.x + turn.z * whole_element.y);
  const vec2 whole = floor(coarse);
  const vec2 rest = (coarse - whole) + (fine + vec2(x.fraction, y.fraction));
  const vec2 carried = floor(rest);
  const vec2 f = rest - carried;
  const ivec2 cell = ivec2(whole) + ivec2(carried) + ivec2(x.cell, y.cell);
  const int column = clamp(cell.x, 0, object.width - 2);
  const int row = clamp(cell.y, 0, object.height - 2);
  const int node = object.first + row * object.width + column;
  log_odds_of[0] = between(corners(node, object.width), f);
}

void main() {
  const uint particle = gl_GlobalInvocationID.x;
  if (particle >= push.particles) {
    return;
  }
  const Particle state = particles[particle];
  object = objects[state.object];
  x = in_cells(state.x_mm, object.centre_x);
  y = in_cells(state.y_mm, object.centre_y);
  turn = direction(state.theta_rad);
  table = int(HEADINGS + object.scale * push.elements);

  sum[0] = push.fresh != 0 ? vec2(0.0) : log_weights[particle];
  add_segments(push.segments, object.first_table_node);
  log_weights[particle] = sum[0];
}
