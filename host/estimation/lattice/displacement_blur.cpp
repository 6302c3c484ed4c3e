#include "estimation/lattice/displacement_blur.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "estimation/displacement_weights.hpp"
#include "palpate/error.hpp"
#include "shaders/blur_axis.hpp"
#include "shaders/max_planes.hpp"
#include "shaders/sum_turns.hpp"

namespace palpate {

namespace {

using gpu::Access;

/// Farther than any lattice has bins, yet whole numbers are exact.
constexpr double farthest = 1 << 23;

void set_two_floats(double value, float& high, float& low) {
  high = static_cast<float>(value);
  low = static_cast<float>(value - high);
}

/// A distance along an axis in whole bins and the rest. An axis of one bin keeps its place.
void set_shift(double distance_mm, const Axis& axis, float& whole, float& fraction,
               float& fraction_low) {
  // What is no number, the difference of places beyond float64, lies as far.
  const double bins = axis.count == 1 ? 0.0
                      : std::isnan(distance_mm)
                          ? farthest
                          : std::clamp(distance_mm / axis.step(), -farthest, farthest);
  whole = static_cast<float>(std::floor(bins));
  set_two_floats(bins - std::floor(bins), fraction, fraction_low);
}

/// Weights, and behind them their logarithms.
std::vector<float> with_logs(std::span<const double> weights) {
  constexpr double nothing = -1e30;  // instead of minus infinity, for a weight that float64 lacks
  std::vector<float> table(weights.begin(), weights.end());
  for (const double weight : weights) {
    table.push_back(static_cast<float>(std::max(std::log(weight), nothing)));
  }
  return table;
}

/// Where a slip takes the belief of a bin from as theta grows by k steps: g + R(alpha) (t - g),
/// [object, k].
/// @param centroids_mm g of every object, in its frame
std::vector<shaders::TurnedPlane> slip_turns(const PoseLattice& lattice,
                                             std::span<const glm::dvec2> centroids_mm, int steps) {
  const Axis& x = lattice.x_mm;
  const Axis& y = lattice.y_mm;
  std::vector<shaders::TurnedPlane> turns;
  for (const glm::dvec2& centroid : centroids_mm) {
    const glm::dvec2 first_mm = glm::dvec2(x.centre(0), y.centre(0)) - centroid;
    for (int k = -steps; k <= steps; ++k) {
      const double alpha = k * lattice.theta_rad.step();
      // R(alpha) - 1, applied to the first bin and to one bin more along each axis.
      const double c = -2.0 * std::sin(alpha / 2.0) * std::sin(alpha / 2.0);
      const double s = std::sin(alpha);
      shaders::TurnedPlane turn{};
      set_shift(c * first_mm.x - s * first_mm.y, x, turn.whole_x, turn.fraction_x,
                turn.fraction_x_low);
      set_shift(s * first_mm.x + c * first_mm.y, y, turn.whole_y, turn.fraction_y,
                turn.fraction_y_low);
      if (x.count > 1) {
        set_two_floats(c, turn.xx, turn.xx_low);
        set_two_floats(-s * y.step() / x.step(), turn.xy, turn.xy_low);
      }
      if (y.count > 1) {
        set_two_floats(s * x.step() / y.step(), turn.yx, turn.yx_low);
        set_two_floats(c, turn.yy, turn.yy_low);
      }
      turns.push_back(turn);
    }
  }
  return turns;
}

/// The slab that holds an object's theta.
const Slab& slab_with(std::span<const Slab> slabs, std::uint32_t object, std::uint32_t theta) {
  return *std::find_if(slabs.begin(), slabs.end(), [&](const Slab& slab) {
    return slab.holds(object) && theta - slab.theta_first < slab.theta_count;
  });
}

/// Room for the turns of every theta, or of every object, by as many steps. Throws Error where no
/// buffer holds them.
gpu::Buffer turn_buffer(gpu::Context& context, const PoseLattice& lattice, std::size_t objects,
                        int steps) {
  const gpu::Limits& limits = context.limits();
  const std::uint64_t turns =
      std::max<std::uint64_t>(objects, static_cast<std::uint64_t>(lattice.theta_rad.count)) *
      (2 * static_cast<std::uint64_t>(steps) + 1);
  const std::uint64_t bytes = turns * sizeof(shaders::TurnedPlane);
  const VkFormat texel = gpu::table_where_it_fits(limits, bytes, VK_FORMAT_R32G32B32A32_SFLOAT);
  if (texel == VK_FORMAT_UNDEFINED && bytes > limits.storage_range) {
    throw Error(
        Fault::input,
        fmt::format("a standard deviation of theta asks for {} turns, more than the {} that "
                    "device '{}' reads in one buffer; use fewer bins",
                    turns, limits.storage_range / sizeof(shaders::TurnedPlane), context.name()));
  }
  return {context, bytes, gpu::Memory::device, "turns of a blur", texel};
}

/// The largest likelihood of every plane, then the weights of theta.
gpu::Buffer maxima_buffer(gpu::Context& context, std::uint64_t count) {
  const std::uint64_t bytes = count * sizeof(float);
  return {context, bytes, gpu::Memory::device, "maxima of planes",
          gpu::table_where_it_fits(context.limits(), bytes, VK_FORMAT_R32_SFLOAT)};
}

/// Into how many slabs every object's bins are cut. Throws Error where these are parts that no
/// dispatch has at hand.
std::size_t slabs_of_an_object(const gpu::Context& context, const PoseLattice& lattice,
                               std::size_t objects, std::uint32_t lanes, int theta_steps) {
  const auto most_bins = std::int64_t{gpu::most_iterations} * lanes;
  auto shortest = static_cast<std::uint32_t>(lattice.theta_rad.count);
  std::size_t of_first = 0;
  bool whole_planes = lattice.plane() <= most_bins;
  for (const SlabExtent& slab : DenseBelief::cut(context, lattice, objects)) {
    whole_planes = whole_planes && static_cast<int>(slab.row_count) == lattice.y_mm.count;
    shortest = std::min(shortest, slab.theta_count);
    of_first += slab.holds(0) ? 1 : 0;
  }
  if (!whole_planes) {
    throw Error(Fault::input,
                fmt::format("bins x times y = {}: device '{}' blurs at most {} for uncertain "
                            "touches, slips and \"none of these\"; use fewer",
                            lattice.plane(), context.name(), most_bins));
  }
  // Where there are two parts, one is the other's neighbour on both sides.
  if (of_first > 2 && static_cast<std::uint32_t>(theta_steps) > shortest) {
    throw Error(Fault::input,
                fmt::format("a standard deviation of theta reaches {} bins, more than the {} of a "
                            "part of an object's bins on device '{}'; use fewer bins",
                            theta_steps, shortest, context.name()));
  }
  return of_first;
}

void require_short_loops(const Axis& axis, double sd_mm) {
  // A loop over the bins of a strip and over the steps, and other loops.
  const int steps = std::min(blur_steps(axis, sd_mm), axis.count - 1);
  if (int{shaders::BLUR_STRIP_X} * (2 * steps + 1) > int{gpu::most_iterations}) {
    throw Error(
        Fault::input,
        fmt::format("a standard deviation of {} mm reaches {} bins; use fewer bins", sd_mm, steps));
  }
}

}  // namespace

DisplacementBlur::DisplacementBlur(gpu::Context& context, gpu::CommandStream& stream,
                                   const PoseLattice& lattice, std::size_t objects,
                                   const DisplacementSd& sd,
                                   std::span<const glm::dvec2> slip_centroids_mm)
    : context_(context),
      stream_(stream),
      weights_(lattice, sd),
      objects_(objects),
      slips_(!slip_centroids_mm.empty()),
      lanes_(independent_lanes(context.limits())),
      max_planes_(context, {.name = "max_planes",
                            .spirv = shaders::max_planes,
                            .bindings = {Access::table, Access::table, Access::storage},
                            .push_bytes = sizeof(shaders::PlanesPush),
                            .constants = {lanes_, source()}}),
      along_y_(make_pass(lattice.y_mm, false)),
      along_x_(make_pass(lattice.x_mm, true)),
      // A slip takes each bin from a place of its own: neighbours share no reads.
      turn_rows_(slips_ ? 1 : 4),
      turn_columns_(slips_ ? 1 : 2),
      turns_(turn_buffer(context, lattice, objects, weights_.theta_steps())),
      plane_max_(maxima_buffer(
          context, planes() + 2 * (static_cast<std::size_t>(weights_.theta_steps()) + 1))),
      references_(context, objects * sizeof(TwoFloat), gpu::Memory::device, "maxima of objects",
                  VK_FORMAT_R32G32_SFLOAT),
      host_turns_(slip_turns(lattice, slip_centroids_mm, weights_.theta_steps())) {
  const std::size_t slabs =
      slabs_of_an_object(context, lattice, objects, lanes_, weights_.theta_steps());
  require_short_loops(lattice.x_mm, sd.mm);
  require_short_loops(lattice.y_mm, sd.mm);
  sum_turns_ = gpu::Kernel(
      context,
      {.name = "sum_turns",
       .spirv = shaders::sum_turns,
       .bindings = {Access::table, Access::table, Access::table, Access::table, Access::table,
                    Access::storage, Access::table, Access::storage, Access::storage},
       .push_bytes = sizeof(shaders::TurnPush),
       .constants = {lanes_, slips_ ? 1U : 0U, turn_rows_,
                     blurs_planes() ? shaders::BLUR_ALONG_X : shaders::BLUR_TOUCH,
                     slabs == 1 ? 1U : 0U, turns_.is_table() ? 1U : 0U,
                     plane_max_.is_table() ? 1U : 0U}});
  std::vector<double> of_turns;
  for (int k = 0; k <= weights_.theta_steps(); ++k) {
    of_turns.push_back(blur_weight(k, lattice.theta_rad, sd.rad));
  }
  stream.upload(plane_max_, with_logs(of_turns), planes() * sizeof(float));
}

DisplacementBlur::Pass DisplacementBlur::make_pass(const Axis& axis, bool along_x) {
  const AxisBlur blur(axis, weights_.sd().mm, 1);
  const std::int64_t strips =
      groups_of(axis.count, along_x ? shaders::BLUR_STRIP_X : shaders::BLUR_STRIP_Y);
  const Axis& x = lattice().x_mm;
  return {.kernel = gpu::Kernel(
              context_,
              {.name = "blur_axis",
               .spirv = shaders::blur_axis,
               .bindings = {Access::table, Access::table, Access::storage, Access::table,
                            Access::storage, Access::storage},
               .push_bytes = sizeof(shaders::PlanesPush),
               .constants = {lanes_, along_x ? shaders::BLUR_ALONG_Y : source(),
                             static_cast<std::uint32_t>(blur.steps), x.count % 2 == 0 ? 1U : 0U}}),
          .weights =
              stream_.uploaded(with_logs(blur.weight), "weights of a blur", VK_FORMAT_R32_SFLOAT),
          .norms = stream_.uploaded(std::vector<float>(blur.scale.begin(), blur.scale.end()),
                                    "weights of a blur"),
          .invocations = strips * (along_x ? lattice().y_mm.count : groups_of(x.count, 2))};
}

std::uint64_t DisplacementBlur::device_bytes() const {
  return along_x_.weights.bytes() + along_x_.norms.bytes() + along_y_.weights.bytes() +
         along_y_.norms.bytes() + turns_.bytes() + plane_max_.bytes() + references_.bytes();
}

std::array<std::uint32_t, 3> DisplacementBlur::groups(std::int64_t lanes, const Slab& slab) const {
  if (warming_up_) {
    return {1, 1, 1};
  }
  return {groups_of(lanes, lanes_), slab.object_count, slab.theta_count};
}

void DisplacementBlur::run_pass(const Pass& pass, const DenseBelief& from,
                                const DenseBelief& scratch) {
  for (std::size_t i = 0; i < scratch.slabs().size(); ++i) {
    const Slab& slab = scratch.slabs()[i];
    stream_.dispatch(pass.kernel,
                     {&from.slabs()[i].log_likelihood, &references_, &plane_max_, &pass.weights,
                      &pass.norms, &slab.log_likelihood},
                     planes_of(slab, lattice().theta_rad.count), groups(pass.invocations, slab));
  }
}

void DisplacementBlur::blur_planes(const DenseBelief& from, const DenseBelief& scratch,
                                   std::span<const TwoFloat> references) {
  stream_.upload(references_, references);
  for (const Slab& slab : from.slabs()) {
    stream_.dispatch(max_planes_, {&slab.log_likelihood, &references_, &plane_max_},
                     planes_of(slab, lattice().theta_rad.count), groups(lanes_, slab));
  }
  if (blurs_planes()) {
    run_pass(along_y_, from, scratch);
    run_pass(along_x_, scratch, scratch);
  }
}

void DisplacementBlur::turn_for(const glm::dvec2& sensor_from_pivot_mm) {
  const int steps = weights_.theta_steps();
  const int thetas = lattice().theta_rad.count;
  const int turns = 2 * steps + 1;
  constexpr auto beyond = static_cast<float>(farthest);
  host_turns_.assign(static_cast<std::size_t>(thetas) * turns,
                     {.whole_x = beyond, .whole_y = beyond});
  for (int theta = 0; theta < thetas; ++theta) {
    taps_ = weights_.taps(theta, sensor_from_pivot_mm, std::move(taps_));
    for (const Tap& tap : taps_) {
      shaders::TurnedPlane& turn =
          host_turns_[static_cast<std::size_t>(theta) * turns + tap.steps + steps];
      turn.whole_x = static_cast<float>(tap.bins.x);
      turn.whole_y = static_cast<float>(tap.bins.y);
      turn.fraction_x = static_cast<float>(tap.fraction.x);
      turn.fraction_y = static_cast<float>(tap.fraction.y);
    }
  }
}

void DisplacementBlur::sum_turns(const DenseBelief& scratch, const DenseBelief& belief) {
  stream_.upload(turns_, host_turns_);
  const auto thetas = static_cast<std::uint32_t>(lattice().theta_rad.count);
  const std::span<const Slab> slabs = scratch.slabs();
  for (std::size_t i = 0; i < slabs.size(); ++i) {
    const Slab& slab = slabs[i];
    const Slab& before =
        slab_with(slabs, slab.object_first, (slab.theta_first + thetas - 1) % thetas);
    const Slab& after =
        slab_with(slabs, slab.object_first, (slab.theta_first + slab.theta_count) % thetas);
    const shaders::TurnPush push{.slab = planes_of(slab, lattice().theta_rad.count),
                                 .steps = static_cast<shaders::uint>(weights_.theta_steps()),
                                 .around = lattice().full_circle() ? 1U : 0U,
                                 .theta_before = before.theta_first,
                                 .thetas_before = before.theta_count,
                                 .theta_after = after.theta_first,
                                 .first_weight = static_cast<shaders::uint>(planes())};
    const std::int64_t invocations =
        std::int64_t{groups_of(slab.nx, turn_columns_)} * groups_of(slab.row_count, turn_rows_);
    stream_.dispatch(sum_turns_,
                     {&slab.log_likelihood, &before.log_likelihood, &after.log_likelihood,
                      &references_, turns_.read_as(Access::table), turns_.read_as(Access::storage),
                      plane_max_.read_as(Access::table), plane_max_.read_as(Access::storage),
                      &belief.slabs()[i].log_likelihood},
                     push, groups(invocations, slab));
  }
}

void DisplacementBlur::warm_up(const DenseBelief& scratch, const DenseBelief& belief) {
  const std::vector<TwoFloat> references(objects_);
  if (!slips_) {
    turn_for({});
  }
  warming_up_ = true;
  blur_planes(slips_ ? belief : scratch, scratch, references);
  sum_turns(scratch, belief);
  warming_up_ = false;
}

}  // namespace palpate
