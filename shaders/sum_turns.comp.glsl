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
layout(binding = 4) uniform samplerBuffer turn_table;  // TurnedPlane, [theta or object, step]
layout(std430, binding = 5) readonly buffer TurnStorage { vec4 turn_storage[]; };
// [object, theta], then weights by steps and their logarithms.
layout(binding = 6) uniform samplerBuffer max_table;
layout(std430, binding = 7) readonly buffer MaxStorage { float max_storage[]; };
layout(std430, binding = 8) buffer Belief { vec2 belief[]; };
layout(push_constant) uniform Push { TurnPush push; };

#include "blurred_bin.glsl"

// A slip takes each bin from a place of its own; neighbours of a touch share what they read.
const uint COLUMNS = SLIP ? 1 : 2;
const uint BINS = ROWS * COLUMNS;
#define FOR_EACH_BIN [[unroll]] for (uint b = 0; b < BINS; ++b)

// What an invocation works on: BINS bins from `place` on.
uint object;
int theta;
ivec2 place;   // column and row
ivec2 bins;    // columns and rows of a plane
float sum[BINS];
float weight[BINS];  // of the bins inside, summed

// Where the likelihoods of one step of theta come from.
struct Tap {
  int slab;       // 0: this one, 1: before, 2: after
  int first;      // bin of the plane
  float largest;  // of the plane
  float weight;
  float log_weight;
  ivec2 place;  // column and row
  vec2 x;       // weights of the column and of the next one
  vec2 y;       // of the row and of the next one
};

vec4 turn_part(const int at) {
  return TURNS_IN_TABLE ? texelFetch(turn_table, at) : turn_storage[at];
}

float plane_max(const int at) {
  return MAXIMA_IN_TABLE ? texelFetch(max_table, at).x : max_storage[at];
}

int theta_after(const int step) {
  const int all = int(push.slab.all_thetas);
  int from = theta + step;
  // A Gaussian as wide as the circle reaches four turns.
  [[unroll]] for (int turn = 0; turn < 4; ++turn) {
    from += from < 0 ? all : from >= all ? -all : 0;
  }
  return from;
}

// A distance in bins, fraction + a i + b j, as a whole number and the weights of the bins before and
// behind it.
vec2 split_distance(const vec2 fraction, const vec2 a, const vec2 b, out int whole) {
  vec2 distance = fraction;
  if (SLIP) {
    distance = two_float_sum(distance, two_float_product(a.x, float(place.x)));
    distance = two_float_add(distance, a.y * float(place.x));
    distance = two_float_sum(distance, two_float_product(b.x, float(place.y)));
    distance = two_float_add(distance, b.y * float(place.y));
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

Tap tap_at(const int step) {
  const int from = theta_after(step);
  const int steps = int(push.steps);
  Tap tap;
  int first_theta = int(push.slab.theta_first);
  tap.slab = 0;
  if (!ONE_SLAB && (from < first_theta || from >= first_theta + int(push.slab.thetas))) {
    const int before = int(push.theta_before);
    const bool is_before = from >= before && from < before + int(push.thetas_before);
    tap.slab = is_before ? 1 : 2;
    first_theta = is_before ? before : int(push.theta_after);
  }
  tap.first = int((object - push.slab.object_first) * push.slab.stride) +
              (from - first_theta) * bins.x * bins.y;
  tap.largest = plane_max(int(object * push.slab.all_thetas) + from);
  tap.weight = plane_max(int(push.first_weight) + abs(step));
  tap.log_weight = plane_max(int(push.first_weight) + steps + 1 + abs(step));
  const int turn = 4 * ((SLIP ? int(object) : theta) * (2 * steps + 1) + step + steps);
  const vec4 fraction = turn_part(turn + 1);
  const vec4 to_x = SLIP ? turn_part(turn + 2) : vec4(0.0);
  const vec4 to_y = SLIP ? turn_part(turn + 3) : vec4(0.0);
  ivec2 more;
  tap.x = split_distance(fraction.xy, to_x.xy, to_x.zw, more.x);
  tap.y = split_distance(fraction.zw, to_y.xy, to_y.zw, more.y);
  tap.place = place + ivec2(turn_part(turn).xy) + more;
  return tap;
}

// The words of a texel's two bins. One beyond the slab's end may be asked for, and is not used.
vec2 texel_words(const Tap tap, const int texel) {
  if (ONE_SLAB || tap.slab == 0) {
    return texelFetch(source, min(texel, textureSize(source) - 1)).xz;
  }
  return tap.slab == 1
             ? texelFetch(source_before, min(texel, textureSize(source_before) - 1)).xz
             : texelFetch(source_after, min(texel, textureSize(source_after) - 1)).xz;
}

// Words of the place's column and of the next two; of those outside the plane, any number.
vec3 words_of_row(const Tap tap, const int row) {
  const int bin = tap.first + row * bins.x + clamp(tap.place.x, -2, bins.x - 1);
  const vec2 left = texel_words(tap, max(bin >> 1, 0));
  const vec2 right = texel_words(tap, (bin >> 1) + 1);
  return (bin & 1) == 0 ? vec3(left, right.x) : vec3(left.y, right);
}

// Between each of three columns and the next one.
vec2 between(const vec3 columns, const vec2 weights) {
  return weights.x * columns.xy + weights.y * columns.yz;
}

// Adds a step's likelihoods, relative to the largest of all planes, to the sums of all bins.
void add(const Tap tap, const float largest) {
  const ivec3 column = tap.place.x + ivec3(0, 1, 2);
  const bvec3 inside = bvec3(column.x >= 0 && column.x < bins.x, column.y >= 0 && column.y < bins.x,
                             column.z >= 0 && column.z < bins.x);
  // The plane's largest over the largest of all. Its root: a float holds it where the words' lift
  // still makes the product too small to count.
  const float root = IN_LOGS ? 1.0 : exp(0.5 * max(tap.largest - largest, 2.0 * BLUR_SMALLEST));
  const float of_plane = IN_LOGS ? largest : 0.0;
  vec2 below = vec2(0.0);
  vec2 below_weight = vec2(0.0);
  [[unroll]] for (uint r = 0; r <= ROWS; ++r) {
    const int row = tap.place.y + int(r);
    const bool row_inside = row >= 0 && row < bins.y;
    const vec3 words = words_of_row(tap, row_inside ? row : 0);
    const vec3 likelihood = vec3(inside.x ? lifted(words.x, of_plane) : 0.0,
                                 inside.y ? lifted(words.y, of_plane) : 0.0,
                                 inside.z ? lifted(words.z, of_plane) : 0.0);
    const vec2 above = row_inside ? between(likelihood, tap.x) : vec2(0.0);
    const vec2 above_weight = row_inside ? between(vec3(inside), tap.x) : vec2(0.0);
    if (r > 0) {
      [[unroll]] for (uint c = 0; c < COLUMNS; ++c) {
        const uint b = (r - 1) * COLUMNS + c;
        sum[b] += tap.weight * root * (root * (tap.y.x * below[c] + tap.y.y * above[c]));
        weight[b] += tap.weight * (tap.y.x * below_weight[c] + tap.y.y * above_weight[c]);
      }
    }
    below = above;
    below_weight = above_weight;
  }
}

// Adds a step's likelihoods to a sum of logs, and their weights to `total`, for the bin at `offset`
// from the invocation's place.
void add_logs(const Tap tap, const ivec2 offset, inout vec2 logs, inout float total) {
  for (int corner = 0; corner < 4; ++corner) {
    const ivec2 at = tap.place + offset + ivec2(corner % 2, corner / 2);
    const float share = tap.x[corner % 2] * tap.y[corner / 2];
    if (at.x >= 0 && at.x < bins.x && at.y >= 0 && at.y < bins.y && share > 0.0) {
      const int bin = tap.first + at.y * bins.x + at.x;
      const float likelihood = lifted_log(texel_words(tap, bin / 2)[bin % 2], tap.largest) +
                               (tap.largest - BLUR_LIFT);
      logs = log_sum_add(logs, likelihood + (tap.log_weight + log(share)), 1.0);
      total += tap.weight * share;
    }
  }
}

void put(const uint bin, const float value, const vec2 reference) {
  belief[bin] = two_float_add(SLIP ? reference : belief[bin], value);
}

void main() {
  bins = ivec2(push.slab.nx, push.slab.ny);
  const uint strips_x = (push.slab.nx + COLUMNS - 1) / COLUMNS;
  const uint strips_y = (push.slab.ny + ROWS - 1) / ROWS;
  const uint id = gl_GlobalInvocationID.x;
  if (id >= strips_x * strips_y) {
    return;
  }
  place = ivec2(id % strips_x * COLUMNS, id / strips_x * ROWS);
  object = push.slab.object_first + gl_WorkGroupID.y;
  theta = int(push.slab.theta_first + gl_WorkGroupID.z);
  const vec2 reference = texelFetch(references, int(object)).xy;
  // Steps that lead out of the region are left out.
  const int steps = int(push.steps);
  const bool around = push.around != 0;
  const int begin = around ? -steps : max(-steps, -theta);
  const int end = (around ? steps : min(steps, int(push.slab.all_thetas) - 1 - theta)) + 1;

  float largest = LOWEST;
  for (int k = begin; k < end; ++k) {
    largest = max(largest, plane_max(int(object * push.slab.all_thetas) + theta_after(k)));
  }
  FOR_EACH_BIN {
    sum[b] = 0.0;
    weight[b] = 0.0;
  }
  for (int k = begin; k < end; ++k) {
    add(tap_at(k), largest);
  }

  const uint first = gl_WorkGroupID.y * push.slab.stride +
                     (gl_WorkGroupID.z * push.slab.ny + uint(place.y)) * push.slab.nx +
                     uint(place.x);
  const float vague = vague_below(LEAST_OF_TURNS, plane_max(int(push.first_weight) + steps));
  uint poor = 0;
  FOR_EACH_BIN {
    const uvec2 offset = uvec2(b % COLUMNS, b / COLUMNS);
    if (all(lessThan(place + ivec2(offset), bins))) {
      if (sum[b] < vague * weight[b]) {
        poor |= 1u << b;
      } else {
        put(first + offset.y * push.slab.nx + offset.x,
            log(sum[b] / weight[b]) + (largest - BLUR_LIFT), reference);
      }
    }
  }
  for (uint b = 0; poor >> b != 0; ++b) {
    const bool wanted = (poor >> b & 1u) != 0;
    const uvec2 offset = uvec2(b % COLUMNS, b / COLUMNS);
    vec2 logs = vec2(LOWEST, 0.0);
    float total = 0.0;
    for (int k = wanted ? begin : end; k < end; ++k) {
      add_logs(tap_at(k), ivec2(offset), logs, total);
    }
    if (wanted) {
      put(first + offset.y * push.slab.nx + offset.x, logs.x + log(logs.y / total), reference);
    }
  }
}
