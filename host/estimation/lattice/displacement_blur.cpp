#include "displacement_blur.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "blur_axis.hpp"
#include "blur_tables.hpp"
#include "kernel_sizes.hpp"
#include "max_planes.hpp"
#include "palpate/error.hpp"
#include "sum_turns.hpp"

namespace palpate {

namespace {

using gpu::Access;

/// Bins of a line that an invocation takes: as many as share a read well, and fewer where the loops
/// of so many would grow too long.
/// @param reads of one bin in the longest loop
std::uint32_t strip_of(std::uint32_t best, std::int64_t reads) {
  const std::int64_t most = gpu::most_iterations / std::max<std::int64_t>(reads, 1);
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(most, 1, best));
}

constexpr std::uint32_t best_strip = 16;      // of blur_axis
constexpr std::uint32_t best_turn_strip = 8;  // of sum_turns

std::uint32_t source_of(DisplacementBlur::Of of) {
  return of == DisplacementBlur::Of::touch ? shaders::BLUR_TOUCH : shaders::BLUR_BELIEF;
}

/// The slab that holds an object's theta.
const Slab& slab_with(std::span<const Slab> slabs, std::uint32_t object, std::uint32_t theta) {
  return *std::find_if(slabs.begin(), slabs.end(), [&](const Slab& slab) {
    return slab.holds(object) && theta - slab.theta_first < slab.theta_count;
  });
}

std::uint64_t turns_of(const PoseLattice& lattice, std::size_t objects, int steps) {
  return std::max<std::uint64_t>(objects, static_cast<std::uint64_t>(lattice.theta_rad.count)) *
         (2 * static_cast<std::uint64_t>(steps) + 1);
}

/// Throws Error where the blur would need parts of an object's bins that no dispatch has at hand.
void require_whole_planes(const gpu::Context& context, const PoseLattice& lattice,
                          std::size_t objects, std::uint32_t lanes, int theta_steps) {
  const auto most_bins = std::int64_t{gpu::most_iterations} * lanes;
  std::uint32_t shortest = static_cast<std::uint32_t>(lattice.theta_rad.count);
  std::size_t parts_of_first = 0;
  bool whole = lattice.plane() <= most_bins;
  for (const SlabExtent& slab : DenseBelief::cut(context, lattice, objects)) {
    whole = whole && static_cast<int>(slab.row_count) == lattice.y_mm.count;
    shortest = std::min(shortest, slab.theta_count);
    parts_of_first += slab.holds(0) ? 1 : 0;
  }
  if (!whole) {
    throw Error(Fault::input,
                fmt::format("bins x times y = {}: device '{}' blurs at most {} for uncertain "
                            "touches, slips and \"none of these\"; use fewer",
                            lattice.plane(), context.name(), most_bins));
  }
  // Of two parts, one is always the other's neighbour on both sides.
  if (parts_of_first > 2 && static_cast<std::uint32_t>(theta_steps) > shortest) {
    throw Error(Fault::input,
                fmt::format("a standard deviation of theta reaches {} bins, more than the {} of a "
                            "part of an object's bins on device '{}'; use fewer bins",
                            theta_steps, shortest, context.name()));
  }
}

}  // namespace

DisplacementBlur::DisplacementBlur(gpu::Context& context, gpu::CommandStream& stream,
                                   const PoseLattice& lattice, std::size_t objects,
                                   const DisplacementSd& sd, Of of, bool keep_touch)
    : context_(context),
      stream_(stream),
      lattice_(lattice),
      objects_(objects),
      sd_(sd),
      of_(of),
      theta_steps_(blur_steps(sd.rad, lattice.theta_rad)),
      lanes_(independent_lanes(context.limits())),
      max_planes_(context, {.name = "max_planes",
                            .spirv = shaders::max_planes,
                            .bindings = {Access::words, Access::table, Access::storage},
                            .push_bytes = sizeof(shaders::PlanesPush),
                            .constants = {lanes_, source_of(of)}}),
      along_y_(make_pass(lattice.y_mm, false)),
      along_x_(make_pass(lattice.x_mm, true)),
      // A slip takes each bin from a place of its own: neighbours share no reads.
      strip_(of == Of::belief
                 ? 1
                 : strip_of(best_turn_strip, 8 * (2 * std::int64_t{theta_steps_} + 1))),
      turns_(context, turns_of(lattice, objects, theta_steps_) * sizeof(shaders::Turn),
             gpu::Memory::device, "turns of a blur", VK_FORMAT_R32G32B32A32_SFLOAT),
      plane_max_(context, (planes() + static_cast<std::size_t>(theta_steps_) + 1) * sizeof(float),
                 gpu::Memory::device, "maxima of planes", VK_FORMAT_R32_SFLOAT),
      references_(context, objects * sizeof(TwoFloat), gpu::Memory::device, "maxima of objects",
                  VK_FORMAT_R32G32_SFLOAT) {
  require_whole_planes(context, lattice, objects, lanes_, theta_steps_);
  sum_turns_ = gpu::Kernel(
      context, {.name = "sum_turns",
                .spirv = shaders::sum_turns,
                .bindings = {Access::words, Access::words, Access::words, Access::table,
                             Access::table, Access::table, Access::storage, Access::storage},
                .push_bytes = sizeof(shaders::TurnPush),
                .constants = {lanes_, of == Of::belief ? 1U : 0U, strip_, keep_touch ? 1U : 0U,
                              blurs_planes() ? shaders::BLUR_ALONG_X : shaders::BLUR_TOUCH}});
  stream.upload(plane_max_, blur_weights(sd.rad, lattice.theta_rad, theta_steps_),
                planes() * sizeof(float));
}

DisplacementBlur::Pass DisplacementBlur::make_pass(const Axis& axis, bool along_x) {
  // Farther than the axis is long there is nothing to weigh.
  const int steps = std::min(blur_steps(sd_.mm, axis), axis.count - 1);
  const std::uint32_t strip = strip_of(best_strip, 2 * (2 * std::int64_t{steps} + 2));
  std::vector<float> table = blur_weights(sd_.mm, axis, steps);
  const std::vector<float> norms = blur_norms(table, axis);
  table.insert(table.end(), strip, 0.0F);
  table.insert(table.end(), norms.begin(), norms.end());
  const Axis& across = along_x ? lattice_.y_mm : lattice_.x_mm;
  return {.kernel = gpu::Kernel(
              context_,
              {.name = "blur_axis",
               .spirv = shaders::blur_axis,
               .bindings = {Access::words, Access::table, Access::table, Access::table,
                            Access::storage},
               .push_bytes = sizeof(shaders::BlurPush),
               .constants = {lanes_, along_x ? shaders::BLUR_ALONG_Y : source_of(of_), strip}}),
          .weights = stream_.uploaded(table, "weights of a blur", VK_FORMAT_R32_SFLOAT),
          .steps = static_cast<std::uint32_t>(steps),
          .invocations = std::int64_t{groups_of(axis.count, strip)} * across.count};
}

std::uint64_t DisplacementBlur::bytes_needed(const PoseLattice& lattice, std::size_t objects,
                                             const DisplacementSd& sd) {
  const int steps = blur_steps(sd.rad, lattice.theta_rad);
  const auto thetas = static_cast<std::uint64_t>(lattice.theta_rad.count);
  const auto pass_bytes = [&](const Axis& axis) {
    const int reach = std::min(blur_steps(sd.mm, axis), axis.count - 1);
    return gpu::allocated((static_cast<std::uint64_t>(reach) + 1 + best_strip + axis.count) *
                          sizeof(float));
  };
  return pass_bytes(lattice.x_mm) + pass_bytes(lattice.y_mm) +
         gpu::allocated(turns_of(lattice, objects, steps) * sizeof(shaders::Turn)) +
         gpu::allocated((objects * thetas + static_cast<std::uint64_t>(steps) + 1) *
                        sizeof(float)) +
         gpu::allocated(objects * sizeof(TwoFloat));
}

std::uint64_t DisplacementBlur::device_bytes() const {
  return along_x_.weights.bytes() + along_y_.weights.bytes() + turns_.bytes() + plane_max_.bytes() +
         references_.bytes();
}

void DisplacementBlur::run_pass(const Pass& pass, const DenseBelief& from,
                                const DenseBelief& scratch, bool few_groups) {
  for (std::size_t i = 0; i < scratch.slabs().size(); ++i) {
    const Slab& slab = scratch.slabs()[i];
    const std::array<std::uint32_t, 3> groups{groups_of(pass.invocations, lanes_),
                                              slab.object_count, slab.theta_count};
    stream_.dispatch(pass.kernel,
                     {&from.slabs()[i].log_likelihood, &references_, &plane_max_, &pass.weights,
                      &slab.log_likelihood},
                     shaders::BlurPush{planes_of(slab, lattice_.theta_rad.count), pass.steps},
                     few_groups ? std::array<std::uint32_t, 3>{1, 1, 1} : groups);
  }
}

void DisplacementBlur::record_planes(const DenseBelief& from, const DenseBelief& scratch,
                                     std::span<const TwoFloat> references, bool few_groups) {
  stream_.upload(references_, references);
  for (std::size_t i = 0; i < scratch.slabs().size(); ++i) {
    const Slab& slab = scratch.slabs()[i];
    stream_.dispatch(max_planes_, {&from.slabs()[i].log_likelihood, &references_, &plane_max_},
                     planes_of(slab, lattice_.theta_rad.count),
                     few_groups
                         ? std::array<std::uint32_t, 3>{1, 1, 1}
                         : std::array<std::uint32_t, 3>{slab.theta_count, slab.object_count, 1});
  }
  if (blurs_planes()) {
    run_pass(along_y_, from, scratch, few_groups);
    run_pass(along_x_, scratch, scratch, few_groups);
  }
}

void DisplacementBlur::record_turns(const DenseBelief& scratch,
                                    std::span<const shaders::Turn> turns, const DenseBelief& belief,
                                    bool few_groups) {
  stream_.upload(turns_, turns);
  const auto thetas = static_cast<std::uint32_t>(lattice_.theta_rad.count);
  const std::span<const Slab> slabs = scratch.slabs();
  for (std::size_t i = 0; i < slabs.size(); ++i) {
    const Slab& slab = slabs[i];
    const Slab& before =
        slab_with(slabs, slab.object_first, (slab.theta_first + thetas - 1) % thetas);
    const Slab& after =
        slab_with(slabs, slab.object_first, (slab.theta_first + slab.theta_count) % thetas);
    const shaders::TurnPush push{.slab = planes_of(slab, lattice_.theta_rad.count),
                                 .steps = static_cast<shaders::uint>(theta_steps_),
                                 .around = lattice_.full_circle() ? 1U : 0U,
                                 .theta_before = before.theta_first,
                                 .thetas_before = before.theta_count,
                                 .theta_after = after.theta_first,
                                 .first_weight = static_cast<shaders::uint>(planes())};
    const std::int64_t invocations = std::int64_t{slab.nx} * groups_of(slab.row_count, strip_);
    stream_.dispatch(
        sum_turns_,
        {&slab.log_likelihood, &before.log_likelihood, &after.log_likelihood, &references_,
         &plane_max_, &turns_, &belief.slabs()[i].log_likelihood, &slab.log_likelihood},
        push,
        few_groups ? std::array<std::uint32_t, 3>{1, 1, 1}
                   : std::array<std::uint32_t, 3>{groups_of(invocations, lanes_), slab.object_count,
                                                  slab.theta_count});
  }
}

void DisplacementBlur::blur_planes(const DenseBelief& from, const DenseBelief& scratch,
                                   std::span<const TwoFloat> references) {
  record_planes(from, scratch, references, false);
}

void DisplacementBlur::sum_turns(const DenseBelief& scratch, std::span<const shaders::Turn> turns,
                                 const DenseBelief& belief) {
  record_turns(scratch, turns, belief, false);
}

void DisplacementBlur::warm_up(const DenseBelief& scratch, const DenseBelief& belief) {
  const std::vector<TwoFloat> references(objects_);
  const std::vector<shaders::Turn> turns(turns_of(lattice_, objects_, theta_steps_));
  record_planes(of_ == Of::touch ? scratch : belief, scratch, references, true);
  record_turns(scratch, turns, belief, true);
}

}  // namespace palpate
