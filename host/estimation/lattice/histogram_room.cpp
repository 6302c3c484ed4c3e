#include "estimation/lattice/histogram_room.hpp"

#include <cmath>

#include <fmt/format.h>

#include "estimation/lattice/touch_by_touch.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

constexpr double mib = 1 << 20;

double memory_mib(const gpu::Context& context) {
  return static_cast<double>(context.limits().memory) / mib;
}

/// What the bins of one belief take. In floating point: there may be too many to count.
double belief_mib(const PoseLattice& lattice, std::size_t objects) {
  return static_cast<double>(objects * sizeof(TwoFloat)) / mib * lattice.x_mm.count *
         lattice.y_mm.count * lattice.theta_rad.count;
}

}  // namespace

void require_room(const gpu::Context& context, const HistogramOptions& options,
                  std::size_t objects) {
  const PoseLattice& lattice = options.lattice;
  const int beliefs = TouchByTouch::wanted_by(options) ? 2 : 1;  // a touch by itself
  const double needed_mib = beliefs * belief_mib(lattice, objects);
  if (needed_mib > memory_mib(context)) {
    throw Error(
        Fault::input,
        fmt::format("{} objects x {} x {} x {} pose bins need {:.0f} MiB, device '{}' has "
                    "{:.0f}; use fewer bins or objects",
                    objects, lattice.x_mm.count, lattice.y_mm.count, lattice.theta_rad.count,
                    std::ceil(needed_mib), context.name(), memory_mib(context)));
  }
}

}  // namespace palpate
