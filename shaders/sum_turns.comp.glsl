#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// The last pass of a blur: sums the likelihoods of neighbouring thetas, each at the place to which
// the turn moves the bin, between the bins. Adds the result to the belief (a touch), or puts it in
// the belief's place (a slip).

#include "interface.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 1) const bool SLIP = false;
layout(constant_id = 2) const uint STRIP = 8;  // bins along y of an invocation; 1 for a slip
layout(constant_id = 3) const bool KEEP = false;   // leaves a touch's result in the second words
layout(constant_id = 4) const uint SOURCE = BLUR_ALONG_X;  // or BLUR_TOUCH, not blurred along x, y

layout(binding = 0) uniform samplerBuffer source;  // two words a bin
layout(binding = 1) uniform samplerBuffer source_before;
layout(binding = 2) uniform samplerBuffer source_after;
layout(binding = 3) uniform samplerBuffer references;  // [object] log-likelihood in two floats
layout(binding = 4) uniform samplerBuffer plane_max;   // [object, theta], then weights by steps
layout(binding = 5) uniform samplerBuffer turns;       // Turn, [theta or object, step]
layout(std430, binding = 6) buffer Belief { vec2 belief[]; };
layout(std430, binding = 7) writeonly buffer Kept { float kept[]; };  // two words a bin
layout(push_constant) uniform Push { TurnPush push; };

#include "two_float.glsl"

#include "blurred_bin.glsl"

#define FOR_EACH_BIN [[unroll]] for (uint b = 0; b < STRIP; ++b)

// Where the likelihoods of one step of theta come from.
struct Tap {
  bool used;
  int slab;     // 0: this one, 1: before, 2: after
  float largest;
  float weight;
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

Tap tap_at(const int k, const uint object, const uint theta, const int x, const int y) {
  Tap tap;
  const int all = int(push.slab.all_thetas);
  const int steps = int(push.steps);
  int from = int(theta) + k;
  tap.used = push.around != 0 || (from >= 0 && from < all);
  from = push.around != 0 ? from - all * int(floor(float(from) / float(all)))
                          : clamp(from, 0, all - 1);
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
  tap.largest = texelFetch(plane_max, int(object) * all + from).x;
  tap.weight = texelFetch(plane_max, int(push.first_weight) + abs(k)).x;
  const int entry = 4 * (int(SLIP ? object : theta) * (2 * steps + 1) + k + steps);
  const vec2 whole = texelFetch(turns, entry).xy;
  const vec4 fraction = texelFetch(turns, entry + 1);
  const vec4 to_x = SLIP ? texelFetch(turns, entry + 2) : vec4(0.0);
  const vec4 to_y = SLIP ? texelFetch(turns, entry + 3) : vec4(0.0);
  int more_columns;
  int more_rows;
  tap.x = split_distance(fraction.xy, to_x.xy, to_x.zw, vec2(x, y), more_columns);
  tap.y = split_distance(fraction.zw, to_y.xy, to_y.zw, vec2(x, y), more_rows);
  tap.column = x + int(whole.x) + more_columns;
  tap.row = y + int(whole.y) + more_rows;
  return tap;
}

float word_at(const Tap tap, const bool inside, const int column, const int row) {
  const int word = 2 * int(tap.first + (inside ? uint(row) * push.slab.nx + uint(column) : 0));
  // Where one slab holds all thetas, the condition is a constant of the dispatch.
  if (push.slab.thetas == push.slab.all_thetas || tap.slab == 0) {
    return texelFetch(source, word).x;
  }
  return tap.slab == 1 ? texelFetch(source_before, word).x : texelFetch(source_after, word).x;
}

void put(const uint bin, const float value, const vec2 reference) {
  belief[bin] = SLIP ? two_float_add(reference, value) : two_float_add(belief[bin], value);
  if (KEEP) {
    kept[2 * bin + 1] = value;
  }
}

void main() {
  const int nx = int(push.slab.nx);
  const int ny = int(push.slab.ny);
  const uint strips = (push.slab.ny + STRIP - 1) / STRIP;
  const uint id = gl_GlobalInvocationID.x;
  if (id >= push.slab.nx * strips) {
    return;
  }
  const int x = int(id % push.slab.nx);
  const int y = int(id / push.slab.nx * STRIP);
  const uint object = push.slab.object_first + gl_WorkGroupID.y;
  const uint theta = push.slab.theta_first + gl_WorkGroupID.z;
  const int steps = int(push.steps);
  const vec2 reference = texelFetch(references, int(object)).xy;

  float largest = LOWEST;
  for (int k = -steps; k <= steps; ++k) {
    const Tap tap = tap_at(k, object, theta, x, y);
    largest = tap.used ? max(largest, tap.largest) : largest;
  }

  float sum[STRIP];
  float weight[STRIP];
  FOR_EACH_BIN {
    sum[b] = 0.0;
    weight[b] = 0.0;
  }
  for (int k = -steps; k <= steps; ++k) {
    const Tap tap = tap_at(k, object, theta, x, y);
    const bool left_inside = tap.used && tap.column >= 0 && tap.column < nx;
    const bool right_inside = tap.used && tap.column >= -1 && tap.column < nx - 1;
    const float left = left_inside ? tap.weight * tap.x.x : 0.0;
    const float right = right_inside ? tap.weight * tap.x.y : 0.0;
    const float plane = IN_LOGS ? 1.0 : exp(max(tap.largest - largest, BLUR_SMALLEST));
    const float reference_of = IN_LOGS ? largest : 0.0;
    float below = 0.0;
    float below_weight = 0.0;
    [[unroll]] for (uint b = 0; b <= STRIP; ++b) {
      const int row = tap.row + int(b);
      const bool inside = row >= 0 && row < ny;
      const float above =
          inside ? left * lifted(word_at(tap, inside && left_inside, tap.column, row),
                                 reference_of) +
                       right * lifted(word_at(tap, inside && right_inside, tap.column + 1, row),
                                      reference_of)
                 : 0.0;
      const float above_weight = inside ? left + right : 0.0;
      if (b > 0) {
        sum[b - 1] += plane * (tap.y.x * below + tap.y.y * above);
        weight[b - 1] += tap.y.x * below_weight + tap.y.y * above_weight;
      }
      below = above;
      below_weight = above_weight;
    }
  }

  const uint first = gl_WorkGroupID.y * push.slab.stride +
                     (gl_WorkGroupID.z * push.slab.ny + uint(y)) * push.slab.nx + uint(x);
  uint poor = 0;
  FOR_EACH_BIN {
    if (y + int(b) < ny) {
      if (sum[b] < LEAST_OF_TURNS * weight[b]) {
        poor |= 1u << b;
      } else {
        put(first + b * push.slab.nx, log(sum[b] / weight[b]) + (largest - BLUR_LIFT), reference);
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
        const int column = tap.column + corner % 2;
        const int row = tap.row + int(b) + corner / 2;
        const float part = tap.weight * tap.x[corner % 2] * tap.y[corner / 2];
        const bool inside = column >= 0 && column < nx && row >= 0 && row < ny && part > 0.0;
        total += inside ? part : 0.0;
        const float value = lifted_log(word_at(tap, inside, column, row), tap.largest) +
                            (tap.largest - BLUR_LIFT);
        logs = inside ? log_sum_add(logs, value, part) : logs;
      }
    }
    if (wanted) {
      put(first + b * push.slab.nx, logs.x + log(logs.y / total), reference);
    }
  }
}
