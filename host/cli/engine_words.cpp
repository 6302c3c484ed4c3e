#include "cli/engine_words.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/options.hpp"
#include "model/option_words.hpp"
#include "model/printable.hpp"
#include "recognition/filter_choice.hpp"

namespace palpate::cli {

namespace {

/// Why the task has its filter, as a line of its own; "" where there is no more to say.
std::string reason_of_filter(const RecognitionTask& task) {
  const std::int64_t bins = task.bins_in_all();
  if (task.auto_filter) {
    return fmt::format("\n        chosen by --filter auto: {} bins in all, {} {}", bins,
                       bins > most_histogram_bins ? "more than" : "at most", most_histogram_bins);
  }
  return task.filter_asked_for_by.empty()
             ? ""
             : fmt::format("\n        asked for by {}", in_flags(task.filter_asked_for_by));
}

}  // namespace

std::string setup_words(const Device& device, const RecognitionTask& task) {
  const auto* particles = std::get_if<ParticleOptions>(&task.filter);
  const PoseLattice& lattice = task.lattice();
  const auto mirrored =
      static_cast<std::size_t>(std::ranges::count_if(task.hypotheses, &Hypothesis::mirrored));
  const std::size_t maps = task.hypotheses.size() - mirrored;
  return fmt::format("{} map{}{}{}, {} on {}", maps, maps == 1 ? "" : "s",
                     mirrored > 0 ? fmt::format(" and {} mirrored", mirrored) : "",
                     task.sensor_model.empty() ? "" : " with " + printable(task.sensor_model),
                     particles != nullptr
                         ? fmt::format("{} particles", particles->particles)
                         : fmt::format("{} x {} x {} bins each{},", lattice.x_mm.count,
                                       lattice.y_mm.count, lattice.theta_rad.count,
                                       traits_of(task.filter).certificate ? " by bounds" : ""),
                     device.name());
}

void print_engine(const Device* device, const Recogniser& recogniser, const RecognitionTask& task) {
  const PoseLattice& lattice = task.lattice();
  const auto words = [](const char* name, const Axis& axis, double unit, const char* unit_name) {
    return fmt::format("{} {:g} to {:g} {}, {} bins in steps of {:.4g}", name, axis.lower * unit,
                       axis.upper * unit, unit_name, axis.count, axis.step() * unit);
  };
  const FilterOptions opened = opened_filter(task);
  std::string filter;
  if (const auto* particles = std::get_if<ParticleOptions>(&opened)) {
    filter =
        fmt::format("{} particles, {} resampling{}, seed {}", particles->particles,
                    particles->resampling == Resampling::multinomial ? "multinomial" : "systematic",
                    particles->augmented ? ", random particles added" : "", particles->seed);
  } else if (const auto* bounded = std::get_if<BoundedOptions>(&opened)) {
    filter = fmt::format(
        "bounded, {}; {:.1f} MiB of the host's memory\n        tolerance {:g}", recogniser.path(),
        static_cast<double>(recogniser.host_bytes()) / (1 << 20), bounded->tolerance);
    filter += bounded->budget_s ? fmt::format(", budget {:g} ms", 1e3 * *bounded->budget_s) : "";
    if (bounded->evidence_nats) {
      filter += fmt::format(", evidence within {:g} nats", *bounded->evidence_nats);
      filter += bounded->evidence_growth > 0.0
                    ? fmt::format(", {:g} more with every further touch",
                                  *bounded->evidence_nats * bounded->evidence_growth)
                    : "";
    }
  } else {
    filter = "histogram in " + recogniser.path();
  }
  filter += reason_of_filter(task);
  fmt::print(stderr,
             "device: {}\nfilter: {}\nlattice: {}\n         {}\n"
             "         {}\n         pivot {}\n",
             device == nullptr
                 ? "none"
                 : fmt::format("{}, {:.1f} MiB of its memory", device->name(),
                               static_cast<double>(recogniser.device_bytes()) / (1 << 20)),
             filter, words("x", lattice.x_mm, 1.0, "mm"), words("y", lattice.y_mm, 1.0, "mm"),
             words("theta", lattice.theta_rad, degrees(1.0), "deg"),
             task.auto_pivot ? "at the array's centre at the first touch in contact"
                             : fmt::format("{:g}, {:g} mm in the robot frame", lattice.pivot_mm.x,
                                           lattice.pivot_mm.y));
}

}  // namespace palpate::cli
