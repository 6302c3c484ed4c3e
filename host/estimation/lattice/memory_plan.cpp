#include "estimation/lattice/memory_plan.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "estimation/lattice/dense_belief.hpp"
#include "estimation/lattice/dense_likelihood.hpp"
#include "estimation/lattice/touch_by_touch.hpp"
#include "gpu/command_stream.hpp"
#include "palpate/error.hpp"
#include "shaders/interface.h"

namespace palpate {

namespace {

/// Memory that a histogram may take, and who says so.
struct Room {
  std::uint64_t bytes = 0;
  bool set_by_options = false;
};

[[noreturn]] void refuse(const gpu::Context& context, const PoseLattice& lattice,
                         std::size_t objects, const Room& room, double needed) {
  constexpr double mib = 1 << 20;
  const std::string what = fmt::format("{} objects x {} x {} x {} pose bins need {:.0f} MiB",
                                       objects, lattice.x_mm.count, lattice.y_mm.count,
                                       lattice.theta_rad.count, std::ceil(needed / mib));
  if (room.set_by_options) {
    throw Error(
        Fault::input,
        fmt::format("memory limit of {:.1f} MiB: {}; raise it, or use fewer bins or objects",
                    static_cast<double>(room.bytes) / mib, what));
  }
  throw Error(Fault::input,
              fmt::format("{}, device '{}' has {:.0f}; use fewer bins or objects", what,
                          context.name(), static_cast<double>(room.bytes) / mib));
}

}  // namespace

MemoryPlan plan_memory(const gpu::Context& context, std::span<const Hypothesis> hypotheses,
                       const HistogramOptions& options) {
  const PoseLattice& lattice = options.lattice;
  const std::size_t objects = hypotheses.size();
  const std::uint64_t all = context.limits().memory;
  const std::uint64_t limit = options.memory_limit_bytes.value_or(all);
  const Room room{.bytes = std::min(limit, all), .set_by_options = limit < all};
  // The belief and, for a still array, No Contact everywhere.
  const std::size_t beliefs = options.still_array ? 2 : 1;
  const bool by_touch = TouchByTouch::wanted_by(options);

  // A first look in floating point: bins may be too many to count.
  const double bins_alone = 8.0 * static_cast<double>((beliefs + (by_touch ? 1 : 0)) * objects) *
                            lattice.x_mm.count * lattice.y_mm.count * lattice.theta_rad.count;
  if (bins_alone > static_cast<double>(room.bytes)) {
    refuse(context, lattice, objects, room, bins_alone);
  }
  const std::size_t most = DenseLikelihood::batch_for(context, lattice, objects);
  const std::uint64_t held =
      beliefs * DenseBelief::bytes_needed(context, lattice, objects) +
      (by_touch ? TouchByTouch::bytes_needed(context, options, objects) : 0) +
      DenseBelief::marginal_bytes(context, lattice, objects) +
      (room.set_by_options ? gpu::CommandStream::staging_bytes : 0);
  const auto needed = [&](std::size_t elements) {
    return held +
           DenseLikelihood::bytes_needed(context, hypotheses, lattice, options.contact, elements);
  };
  // Whole products, so that the limit does not change a bit of the result.
  constexpr std::size_t step = shaders::FACTORS_PER_LOG;
  if (needed(std::min(most, step)) > room.bytes) {
    refuse(context, lattice, objects, room, static_cast<double>(needed(std::min(most, step))));
  }
  const auto plan = [&](std::size_t elements) {
    // A still array prepares no touch, and a touch by itself has memory of its own.
    const std::uint64_t with_one_more =
        needed(elements) + DenseBelief::bytes_needed(context, lattice, objects);
    return MemoryPlan{elements, !options.still_array && !by_touch && with_one_more <= room.bytes};
  };
  if (needed(most) <= room.bytes) {
    return plan(most);
  }
  std::size_t fits = step;
  std::size_t too_many = most;
  while (too_many - fits > step) {
    const std::size_t middle = (fits + too_many) / 2 / step * step;
    (needed(middle) <= room.bytes ? fits : too_many) = middle;
  }
  return plan(fits);
}

}  // namespace palpate
