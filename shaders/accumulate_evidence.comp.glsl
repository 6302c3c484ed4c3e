#version 450
#extension GL_GOOGLE_include_directive : require

// Builds a map by parallel cell updates (Eq. 4-6): one tile per workgroup, one cell per invocation,
// which adds the increments of all readings near its tile. Positions are relative to the tile, so
// that their float32 error does not grow with the map.

#include "interface.h"

layout(local_size_x = TILE_CELLS, local_size_y = TILE_CELLS) in;

layout(constant_id = 0) const float PEAK = 0.9;
layout(constant_id = 1) const float PRIOR = 0.2;
layout(constant_id = 2) const float INVERSE_TWICE_VARIANCE = 2.0;  // 1 / (2 spread^2), per mm^2

#include "two_float.glsl"

layout(std430, binding = 0) readonly buffer Tiles { Tile tiles[]; };
layout(std430, binding = 1) readonly buffer Readings { TileReading readings[]; };
layout(std430, binding = 2) buffer Map { float log_odds[]; };
layout(push_constant) uniform Push { EvidencePush push; };

// log(1 + x) to a relative 2e-7: plain log(1 + x) would lose the increments far from an element.
float log_one_plus(const float x) {
  if (abs(x) < 0.01) {
    return x * (1.0 - x * (1.0 / 2.0 - x * (1.0 / 3.0 - x * (1.0 / 4.0))));
  }
  return log(1.0 + x);
}

void main() {
  const Tile tile = tiles[push.tile_first + gl_WorkGroupID.x];
  const vec2 cell = vec2(gl_LocalInvocationID.xy) * push.cell_mm;
  vec2 sum = vec2(0.0);
  for (uint k = tile.first; k < tile.first + tile.count; ++k) {
    const vec2 d = cell - vec2(readings[k].x_mm, readings[k].y_mm);
    const float g = PEAK * exp(-dot(d, d) * INVERSE_TWICE_VARIANCE);
    const float increment = readings[k].reading == IN_CONTACT
                                ? log_one_plus(g * ((1.0 - PRIOR) / PRIOR)) - log_one_plus(-g)
                                : log_one_plus(-g) - log_one_plus(g * (PRIOR / (1.0 - PRIOR)));
    sum = two_float_add(sum, increment);
  }
  const uvec2 at = uvec2(tile.column, tile.row) + gl_LocalInvocationID.xy;
  if (at.x < push.width && at.y < push.height) {
    log_odds[at.y * push.width + at.x] += sum.x;
  }
}
