#include "cli/filter_flags.hpp"

#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include "cli/options.hpp"
#include "cli/recognition_flags.hpp"
#include "cli/sensor_model_flag.hpp"

namespace palpate::cli {

namespace {

using Kind = FilterWish::Kind;

Kind kind_of(const std::string& filter) {
  if (filter == "auto") {
    return Kind::automatic;
  }
  if (filter == "histogram") {
    return Kind::histogram;
  }
  if (filter == "bounded") {
    return Kind::bounded;
  }
  if (filter == "particles") {
    return Kind::particles;
  }
  refuse_flag("--filter", filter, "not known; use auto, histogram, bounded or particles");
}

/// The first flag that only bounds read; "" where none is given.
std::string bounds_flag(const FilterFlags& flags) {
  return flags.tolerance       ? "--tolerance"
         : flags.budget_ms     ? "--budget-ms"
         : flags.evidence_nats ? "--evidence-nats"
                               : "";
}

/// What bounds refuse and the histogram does not.
std::vector<HistogramNeed> all_needs(const RecognitionFlags& flags, const Scene& scene,
                                     const HistogramNeed& of_command,
                                     const HistogramOptions& histogram) {
  std::vector<HistogramNeed> needs;
  if (!of_command.why.empty()) {
    needs.push_back(of_command);
  }
  if (const std::string slip = slip_sd_giver(flags.uncertainty, scene, flags.scene);
      !slip.empty()) {
    needs.push_back({slip, "bounds take the object to rest between touches"});
  }
  if (const std::string touch = touch_sd_giver(flags.uncertainty, scene, flags.scene);
      !touch.empty() || !histogram.touch_sd.none()) {
    needs.push_back({touch.empty() ? "touch_sd in " + sensor_model_file(flags, scene) : touch,
                     "bounds take every touch's pose to be exact"});
  }
  if (flags.filter.memory_mib) {
    needs.push_back({"--memory-mib", "has no effect on bounds, whose memory is the host's"});
  }
  return needs;
}

/// The flags and keys without which bounds could take the bins: "--a and --b"; "" where there is no
/// way.
std::string names_of(std::span<const HistogramNeed> needs) {
  std::vector<std::string> names;
  for (const HistogramNeed& need : needs) {
    if (need.flag.empty()) {
      return "";
    }
    names.push_back(need.flag);
  }
  return fmt::format("{}", fmt::join(names, " and "));
}

BoundedOptions bounded_options(const FilterFlags& flags, const HistogramOptions& histogram) {
  BoundedOptions bounded = bounded_instead(histogram).value();
  if (flags.tolerance) {
    if (!(*flags.tolerance > 0.0 && *flags.tolerance < 1.0)) {
      refuse_flag("--tolerance", *flags.tolerance, "give a probability between 0 and 1");
    }
    bounded.tolerance = *flags.tolerance;
  }
  if (flags.budget_ms) {
    bounded.budget_s = 1e-3 * require_above("--budget-ms", *flags.budget_ms, 0.0);
  }
  if (flags.evidence_nats) {
    bounded.evidence_nats = require_above("--evidence-nats", *flags.evidence_nats, 0.0);
  }
  return bounded;
}

/// The particle filter's options: those that it shares with the histogram, and its flags.
ParticleOptions particle_options(const RecognitionFlags& all, const Scene& scene,
                                 const HistogramOptions& histogram) {
  const FilterFlags& flags = all.filter;
  ParticleOptions particles{
      .region = histogram.lattice, .contact = histogram.contact, .augmented = flags.augmented};
  particles.particles = flags.particles.value_or(particles.particles);
  if (particles.particles < 1 || particles.particles > 1'000'000) {
    refuse_flag("--particles", particles.particles, "give 1 to 1,000,000");
  }
  if (flags.resampling == "systematic") {
    particles.resampling = Resampling::systematic;
  } else if (!flags.resampling.empty() && flags.resampling != "multinomial") {
    refuse_flag("--resampling", flags.resampling, "not known; use multinomial or systematic");
  }
  particles.seed = flags.seed.value_or(particles.seed);
  set_uncertainty(all.uncertainty, scene, all.scene, particles);
  return particles;
}

}  // namespace

void add_filter_flags(CLI::App& command, FilterFlags& flags) {
  command.add_option(
      "--filter", flags.filter,
      fmt::format(
          "histogram: evaluates every pose bin; bounded: the same bins, but evaluates only those "
          "that matter and proves how little the others can; particles: the paper's particle "
          "filter; auto: bounded for more than {} bins of all objects together, else histogram. "
          "Bounded refuses --touch-sd-*, --slip-sd-*, --posterior, --memory-mib, --none with "
          "--gamma "
          "0, and plans; auto then takes the histogram [default: auto]",
          most_histogram_bins));
  command.add_option("--tolerance", flags.tolerance,
                     "With --filter bounded: largest share of the belief that may be left "
                     "unproven; the search goes on until it is reached. Rounding, which counts as "
                     "unproven, may exceed a tolerance below about 1e-8 [default: 1e-6]");
  command.add_option("--budget-ms", flags.budget_ms,
                     "With --filter bounded: milliseconds after which each estimate's search ends "
                     "and reports what it has proven by then [default: none]");
  command.add_option("--evidence-nats", flags.evidence_nats,
                     "With --filter bounded: also bounds the log evidence of every object, however "
                     "unlikely, within this many nats [default: only the tolerance counts]");
  command
      .add_option("--particles", flags.particles,
                  "Number of particles of all objects together, up to 1,000,000 [default: 10000]")
      ->check(require_whole_number);
  command.add_option("--resampling", flags.resampling,
                     "How particles are drawn: multinomial or systematic [default: multinomial]");
  command.add_flag("--augmented", flags.augmented,
                   "Augmented MCL: add random particles while the touches fit worse than before");
  command.add_option("--seed", flags.seed, "Seed of the particles' random numbers [default: 0]")
      ->check(require_whole_number);
  command
      .add_option(
          "--memory-mib", flags.memory_mib,
          "Limit of the histogram's device memory, MiB; less memory costs time, no accuracy "
          "[default: none]")
      ->check(require_whole_number);
}

void hide_other_filters(CLI::App& command) {
  for (const char* flag : {"--filter", "--tolerance", "--budget-ms", "--evidence-nats",
                           "--particles", "--resampling", "--augmented", "--seed"}) {
    command.get_option(flag)->group("");
  }
}

FilterWish filter_wish(const RecognitionFlags& all, const Scene& scene) {
  const FilterFlags& flags = all.filter;
  const std::string filter = !flags.filter.empty() ? flags.filter : scene.filter.value_or("auto");
  FilterWish wish{.kind = kind_of(filter),
                  .by = flags.filter.empty() && scene.filter
                            ? fmt::format("filter: {} in {}", filter, all.scene)
                            : "--filter " + filter};
  const bool particles = wish.kind == Kind::particles;
  for (const auto& [flag, given] :
       {std::pair{"--particles", flags.particles.has_value()},
        std::pair{"--resampling", !flags.resampling.empty()},
        std::pair{"--augmented", flags.augmented}, std::pair{"--seed", flags.seed.has_value()}}) {
    if (given && !particles) {
      refuse(flag, "has no effect on --filter {}; add --filter particles", filter);
    }
  }
  if (flags.memory_mib && particles) {
    refuse("--memory-mib",
           "has no effect on --filter particles; use --filter histogram, or fewer --particles");
  }
  if (const std::string flag = bounds_flag(flags); !flag.empty()) {
    if (particles || wish.kind == Kind::histogram) {
      refuse(flag, "has no effect on --filter {}; use --filter bounded, or leave it out", filter);
    }
    if (wish.kind == Kind::automatic) {
      wish = {.kind = Kind::bounded, .by = flag};
    }
  }
  return wish;
}

ChosenFilter choose_filter(const FilterWish& wish, const RecognitionFlags& flags,
                           const Scene& scene, const HistogramNeed& of_command,
                           std::span<const Hypothesis> hypotheses, HistogramOptions histogram) {
  if (wish.kind == Kind::particles) {
    return {.options = particle_options(flags, scene, histogram), .asked_for_by = wish.by};
  }
  if (const std::optional<int> mib = flags.filter.memory_mib) {
    if (*mib < 1) {
      refuse_flag("--memory-mib", *mib, "give at least 1");
    }
    histogram.memory_limit_bytes = static_cast<std::uint64_t>(*mib) << 20;
  }
  set_uncertainty(flags.uncertainty, scene, hypotheses, histogram);
  std::vector<HistogramNeed> needs = all_needs(flags, scene, of_command, histogram);
  if (wish.kind == Kind::bounded) {
    for (const auto& [flag, why] : needs) {
      if (flag.empty()) {
        refuse(wish.by, "{}; leave it out", why);
      }
      refuse(flag, "{}; leave it out, or {}", why, wish.by);
    }
    return {.options = bounded_options(flags.filter, histogram), .asked_for_by = wish.by};
  }
  if (wish.kind == Kind::histogram) {
    needs.push_back({wish.by, "was asked for"});
  }
  return {.options = histogram, .automatic = needs.empty(), .asked_for_by = names_of(needs)};
}

Recogniser open_filter(Device& device, const RecognitionTask& task) {
  try {
    return {device, task};
  } catch (const Error& error) {
    // Of a sound task nothing but the bins' memory can be refused.
    if (error.fault() == Fault::input && traits_of(task.filter).every_bin &&
        !task.filter_asked_for_by.empty() && bounds_have_room(task)) {
      throw Error(Fault::input,
                  fmt::format("{}, or leave out {}: --filter bounded needs no device memory",
                              error.what(), task.filter_asked_for_by));
    }
    throw;
  }
}

}  // namespace palpate::cli
