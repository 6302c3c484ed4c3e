#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// The last pass of a blur: sums the likelihoods of neighbouring thetas, each at the place to which
// the turn moves the bin, between the bins. Adds the result to the belief (a touch), or puts it in
// the belief's place (a slip).

#include "interface.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 1) const bool SLIP = false;
layout(constant_id = 2) const uint ROWS = 4;  // bins along y of an invocation; 1 for a slip
layout(constant_id = 3) const uint SOURCE = BLUR_ALONG_X;  // or BLUR_TOUCH, not blurred along x, y
layout(constant_id = 4) const bool ONE_SLAB = true;        // every slab holds all thetas
layout(constant_id = 5) const bool TURNS_IN_TABLE = true;  // else in storage
layout(constant_id = 6) const bool MAXIMA_IN_TABLE = true;

layout(binding = 0) uniform samplerBuffer source;  // two bins a texel
layout(binding = 1) uniform samplerBuffer source_before;  // of the thetas before the slab's
layout(binding = 2) uniform samplerBuffer source_after;   // and after them
layout(binding = 3) uniform samplerBuffer references;  // [object] log-likelihood in two floats
layout(binding = 4) uniform samplerBuffer turn_table;  // Turn, [theta or object, step]
layout(std430, binding = 5) readonly buffer TurnStorage { vec4 turn_storage[]; };
// [object, theta], then weights by steps and their logarithms.
layout(binding = 6) uniform samplerBuffer max_table;
layout(std430, binding = 7) readonly buffer MaxStorage { float max_storage[]; };
layout(std430, binding = 8) buffer Belief { vec2 belief[]; };
layout(push_constant) uniform Push { TurnPush push; };

#include "two_float.glsl"

#include "blurred_bin.glsl"

// A slip takes each bin from a place of its own; neighbours of a touch share what they read.
const uint COLUMNS = SLIP ? 1 : 2;
const uint BINS = ROWS * COLUMNS;
#define FOR_EACH_BIN [[unroll]] for (uint b = 0; b < BINS; ++b)

// Where the likelihoods of one step of theta come from.
struct Tap {
  bool used;
  int slab;     // 0: this one, 1: before, 2: after
  float largest;
  float weight;
  float log_weight;
  uint first;   // bin of the plane
  int column;
  int row;
  vec2 x;  // weights of the column and of the next one
  vec2 y;  // of the row and of the next one
};

// A distance in bins, fraction + a i + b j, as a whole number and the weights of the bins before and
// behind it.
vec2 split_distance(const vec2 fraction, const vec2 a, const vec2 b, const vec2 place,
                    out int whole) {
  vec2 distance = fraction;
  if (SLIP) {
    distance = two_float_sum(distance, two_float_product(a.x, place.x));
    distance = two_float_add(distance, a.y * place.x);
    distance = two_float_sum(distance, two_float_product(b.x, place.y));
    distance = two_float_add(distance, b.y * place.y);
  }
  float before = floor(distance.x);
  precise float rest = distance.x - before;
  if (rest + distance.y < 0.0) {
    before -= 1.0;
    rest += 1.0;
  }
  whole = int(before);
  precise float behind = rest + distance.y;
  precise float near = (1.0 - rest) - distance.y;
  return vec2(near, behind);
}

// One of a turn's four vec4.
vec4 turn_part(const int at) {
  return TURNS_IN_TABLE ? texelFetch(turn_table, at) : turn_storage[at];
}

float plane_max(const int at) {
  return MAXIMA_IN_TABLE ? texelFetch(max_table, at).x : max_storage[at];
}

Tap tap_at(const int k, const uint object, const uint theta, const int x, const int y) {
  Tap tap;
  const int all = int(push.slab.all_thetas);
  const int steps = int(push.steps);
  int from = int(theta) + k;
  tap.used = push.around != 0 || (from >= 0 && from < all);
  if (push.around != 0) {
    // A Gaussian as wide as the circle reaches four turns.
    [[unroll]] for (int turn = 0; turn < 4; ++turn) {
      from += from < 0 ? all : from >= all ? -all : 0;
    }
  }
  from = clamp(from, 0, all - 1);
  const int here = int(push.slab.theta_first);
  int first_theta = here;
  tap.slab = 0;
  if (from < here || from >= here + int(push.slab.thetas)) {
    const int before = int(push.theta_before);
    const bool is_before = from >= before && from < before + int(push.thetas_before);
    tap.slab = is_before ? 1 : 2;
    first_theta = is_before ? before : int(push.theta_after);
  }
  tap.first = (object - push.slab.object_first) * push.slab.stride +
              uint(from - first_theta) * push.slab.nx * push.slab.ny;
  tap.largest = plane_max(int(object) * all + from);
  tap.weight = plane_max(int(push.first_weight) + abs(k));
  tap.log_weight = plane_max(int(push.first_weight) + steps + 1 + abs(k));
  const int entry = 4 * (int(SLIP ? object : theta) * (2 * steps + 1) + k + steps);
  const vec2 whole = turn_part(entry).xy;
  const vec4 fraction = turn_part(entry + 1);
  const vec4 to_x = SLIP ? turn_part(entry + 2) : vec4(0.0);
  const vec4 to_y = SLIP ? turn_part(entry + 3) : vec4(0.0);
  int more_columns;
  int more_rows;
  tap.x = split_distance(fraction.xy, to_x.xy, to_x.zw, vec2(x, y), more_columns);
  tap.y = split_distance(fraction.zw, to_y.xy, to_y.zw, vec2(x, y), more_rows);
  tap.column = x + int(whole.x) + more_columns;
  tap.row = y + int(whole.y) + more_rows;
  return tap;
}

vec2 texel_words(const Tap tap, const int texel) {
  if (ONE_SLAB || tap.slab == 0) {
    return texelFetch(source, min(texel, textureSize(source) - 1)).xz;
  }
  return tap.slab == 1
             ? texelFetch(source_before, min(texel, textureSize(source_before) - 1)).xz
             : texelFetch(source_after, min(texel, textureSize(source_after) - 1)).xz;
}

float word_at(const Tap tap, const int column, const int row) {
  const int bin = int(tap.first) + row * int(push.slab.nx) + column;
  return texel_words(tap, bin / 2)[bin % 2];
}

// Words of three neighbouring columns; of those outside the plane, any number.
vec3 words_from(const Tap tap, const int row) {
  const int nx = int(push.slab.nx);
  const int bin = int(tap.first) + row * nx + clamp(tap.column, -2, nx - 1);
  const vec2 left = texel_words(tap, max(bin >> 1, 0));
  const vec2 right = texel_words(tap, (bin >> 1) + 1);
  return (bin & 1) == 0 ? vec3(left, right.x) : vec3(left.y, right);
}

void put(const uint bin, const float value, const vec2 reference) {
  belief[bin] = SLIP ? two_float_add(reference, value) : two_float_add(belief[bin], value);
}

void main() {
  const int nx = int(push.slab.nx);
  const int ny = int(push.slab.ny);
  const uint strips_x = (push.slab.nx + COLUMNS - 1) / COLUMNS;
  const uint strips_y = (push.slab.ny + ROWS - 1) / ROWS;
  const uint id = gl_GlobalInvocationID.x;
  if (id >= strips_x * strips_y) {
    return;
  }
  const int x = int(id % strips_x * COLUMNS);
  const int y = int(id / strips_x * ROWS);
  const uint object = push.slab.object_first + gl_WorkGroupID.y;
  const uint theta = push.slab.theta_first + gl_WorkGroupID.z;
  const int steps = int(push.steps);
  const vec2 reference = texelFetch(references, int(object)).xy;

  float largest = LOWEST;
  for (int k = -steps; k <= steps; ++k) {
    const Tap tap = tap_at(k, object, theta, x, y);
    largest = tap.used ? max(largest, tap.largest) : largest;
  }

  float sum[BINS];
  float weight[BINS];
  FOR_EACH_BIN {
    sum[b] = 0.0;
    weight[b] = 0.0;
  }
  for (int k = -steps; k <= steps; ++k) {
    const Tap tap = tap_at(k, object, theta, x, y);
    // The three columns that the bins' places lie between.
    const bvec3 inside = bvec3(tap.used && tap.column >= 0 && tap.column < nx,
                               tap.used && tap.column >= -1 && tap.column < nx - 1,
                               tap.used && tap.column >= -2 && tap.column < nx - 2);
    const vec3 counts = vec3(inside);
    // The plane's largest over the largest of all. Its root: a float holds it where the words' lift
    // still makes the product too small to count.
    const float root =
        IN_LOGS ? 1.0 : exp(0.5 * max(tap.largest - largest, 2.0 * BLUR_SMALLEST));
    const float of_plane = IN_LOGS ? largest : 0.0;
    vec2 below = vec2(0.0);
    vec2 below_weight = vec2(0.0);
    [[unroll]] for (uint r = 0; r <= ROWS; ++r) {
      const int row = tap.row + int(r);
      const bool row_inside = row >= 0 && row < ny;
      const vec3 words = words_from(tap, row_inside ? row : 0);
      const float left = inside.x ? lifted(words.x, of_plane) : 0.0;
      const float middle = inside.y ? lifted(words.y, of_plane) : 0.0;
      const float right = inside.z ? lifted(words.z, of_plane) : 0.0;
      const vec2 above = row_inside ? vec2(tap.x.x * left + tap.x.y * middle,
                                           tap.x.x * middle + tap.x.y * right)
                                    : vec2(0.0);
      const vec2 above_weight = row_inside ? vec2(tap.x.x * counts.x + tap.x.y * counts.y,
                                                  tap.x.x * counts.y + tap.x.y * counts.z)
                                           : vec2(0.0);
      if (r > 0) {
        [[unroll]] for (uint c = 0; c < COLUMNS; ++c) {
          const uint b = (r - 1) * COLUMNS + c;
          sum[b] += tap.weight * root * (root * (tap.y.x * below[c] + tap.y.y * above[c]));
          weight[b] +=
              tap.weight * (tap.y.x * below_weight[c] + tap.y.y * above_weight[c]);
        }
      }
      below = above;
      below_weight = above_weight;
    }
  }

  const uint first = gl_WorkGroupID.y * push.slab.stride +
                     (gl_WorkGroupID.z * push.slab.ny + uint(y)) * push.slab.nx + uint(x);
  const float vague = vague_below(LEAST_OF_TURNS, plane_max(int(push.first_weight) + steps));
  uint poor = 0;
  FOR_EACH_BIN {
    const uint bin = first + b / COLUMNS * push.slab.nx + b % COLUMNS;
    if (y + int(b / COLUMNS) < ny && x + int(b % COLUMNS) < nx) {
      if (sum[b] < vague * weight[b]) {
        poor |= 1u << b;
      } else {
        put(bin, log(sum[b] / weight[b]) + (largest - BLUR_LIFT), reference);
      }
    }
  }
  for (uint b = 0; poor >> b != 0; ++b) {
    const bool wanted = (poor >> b & 1u) != 0;
    vec2 logs = vec2(LOWEST, 0.0);
    float total = 0.0;
    for (int k = wanted ? -steps : steps + 1; k <= steps; ++k) {
      const Tap tap = tap_at(k, object, theta, x, y);
      for (int corner = tap.used ? 0 : 4; corner < 4; ++corner) {
        const int column = tap.column + int(b % COLUMNS) + corner % 2;
        const int row = tap.row + int(b / COLUMNS) + corner / 2;
        const float share = tap.x[corner % 2] * tap.y[corner / 2];
        if (column >= 0 && column < nx && row >= 0 && row < ny && share > 0.0) {
          total += tap.weight * share;
          logs = log_sum_add(logs,
                             lifted_log(word_at(tap, column, row), tap.largest) +
                                 (tap.largest - BLUR_LIFT) + (tap.log_weight + log(share)),
                             1.0);
        }
      }
    }
    if (wanted) {
      put(first + b / COLUMNS * push.slab.nx + b % COLUMNS, logs.x + log(logs.y / total),
          reference);
    }
  }
}
