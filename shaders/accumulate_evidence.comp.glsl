#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// Adds readings to a map by parallel cell updates (Eq. 4-6). A workgroup updates one tile of cells,
// an invocation BLOCK_CELLS x BLOCK_CELLS cells in registers. The Gaussian is separable, so that
// rows and columns share its exponentials. Positions are relative to the tile, so that their
// float32 error does not grow with the map.

#include "interface.h"

layout(local_size_x_id = 0, local_size_y_id = 1) in;  // TILE_CELLS / BLOCK_CELLS each

layout(constant_id = 2) const int BLOCK_CELLS = 4;
layout(constant_id = 3) const float PEAK = 0.9;
layout(constant_id = 4) const float INVERSE_TWICE_VARIANCE = 2.0;  // 1 / (2 spread^2), per mm^2

#include "two_float.glsl"

layout(std430, binding = 0) readonly buffer Tiles { Tile tiles[]; };
layout(binding = 1) uniform samplerBuffer readings;  // TileReading
layout(std430, binding = 2) buffer Map { vec2 log_odds[]; };  // relative to the prior, two floats
layout(push_constant) uniform Push { EvidencePush push; };

// Number of increments that one float sums before they are added to the two-float sum.
const uint CHUNK = 64;

#define FOR_EACH_CELL                               \
  [[unroll]] for (int j = 0; j < BLOCK_CELLS; ++j) \
  [[unroll]] for (int i = 0; i < BLOCK_CELLS; ++i)

float weight[BLOCK_CELLS][BLOCK_CELLS];  // the Gaussian G' of one reading at every cell

void weigh(const vec2 corner, const vec4 reading) {
  const vec2 offset = corner - reading.xy;
  float along_x[BLOCK_CELLS];
  [[unroll]] for (int i = 0; i < BLOCK_CELLS; ++i) {
    const float d = offset.x + float(i) * push.cell_mm;
    along_x[i] = PEAK * exp(max(-d * d * INVERSE_TWICE_VARIANCE, -40.0));
  }
  [[unroll]] for (int j = 0; j < BLOCK_CELLS; ++j) {
    const float d = offset.y + float(j) * push.cell_mm;
    const float along_y = exp(max(-d * d * INVERSE_TWICE_VARIANCE, -40.0));
    [[unroll]] for (int i = 0; i < BLOCK_CELLS; ++i) {
      // Negligible weights become 0: their powers would be denormal numbers, slow on CPUs.
      const float g = along_x[i] * along_y;
      weight[j][i] = g > 1e-16 ? g : 0.0;
    }
  }
}

// tanh of half the log-odds increment, where the Gaussian weight is g.
float half_tanh(const float g, const vec4 reading) {
  return g * reading.z / (2.0 + g * reading.w);
}

// 2 atanh(t) for |t| <= SERIES_REACH, to a relative 2e-7. A logarithm would round away the small
// increments far from an element, of which a long recording has many.
float twice_atanh_series(const float t) {
  const float q = t * t;
  return t * (2.0 + q * (2.0 / 3.0 + q * (2.0 / 5.0 + q * (2.0 / 7.0 + q * (2.0 / 9.0)))));
}

vec2 sum[BLOCK_CELLS][BLOCK_CELLS];  // of log-odds increments, in two floats

// Adds the readings [begin, end) of the list to the sums. Far ones have small increments.
void add(const uint begin, const uint end, const vec2 corner, const bool far) {
  float part[BLOCK_CELLS][BLOCK_CELLS];
  for (uint first = begin; first < end; first += CHUNK) {
    FOR_EACH_CELL { part[j][i] = 0.0; }
    for (uint k = first; k < min(first + CHUNK, end); ++k) {
      const vec4 reading = texelFetch(readings, int(k));
      weigh(corner, reading);
      FOR_EACH_CELL {
        const float g = weight[j][i];
        const float t = half_tanh(g, reading);
        // (1 + |t|) / (1 - |t|) without the cancellation in 1 - |t|.
        const float odds = (2.0 + g * (reading.w + abs(reading.z))) / (2.0 - 2.0 * g);
        part[j][i] +=
            far || abs(t) < SERIES_REACH ? twice_atanh_series(t) : sign(reading.z) * log(odds);
      }
    }
    FOR_EACH_CELL { sum[j][i] = two_float_add(sum[j][i], part[j][i]); }
  }
}

void main() {
  const Tile tile = tiles[push.tile_first + gl_WorkGroupID.x];
  const uvec2 block = gl_LocalInvocationID.xy * BLOCK_CELLS;
  const vec2 corner = vec2(block) * push.cell_mm;
  FOR_EACH_CELL { sum[j][i] = vec2(0.0); }
  add(tile.first, tile.first + tile.near, corner, false);
  add(tile.first + tile.near, tile.first + tile.count, corner, true);

  const uvec2 at = uvec2(tile.column, tile.row) + block;
  FOR_EACH_CELL {
    if (at.x + i < push.width && at.y + j < push.height) {
      const uint cell = (at.y + j) * push.width + at.x + i;
      log_odds[cell] = two_float_sum(log_odds[cell], sum[j][i]);
    }
  }
}
