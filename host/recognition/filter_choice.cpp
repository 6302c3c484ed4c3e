#include "recognition/filter_choice.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "estimation/bounded/search_memory.hpp"
#include "estimation/displacement_check.hpp"
#include "recognition/refused_option.hpp"

namespace palpate {

namespace {

/// What gave the option, in the middle of a sentence.
std::string giver_of(const Request& request, const std::string& option) {
  const auto key = request.keys.find(option);
  return key == request.keys.end() ? fmt::format("`{}`", option)
                                   : fmt::format("{} in {}", key->second, request.scene);
}

/// One standard deviation: its option and what is asked.
struct AskedSd {
  const char* option;
  std::optional<double> value;
};

AskedSd touch_mm(const Request& request) { return {"touch-sd-mm", request.touch_sd_mm}; }
AskedSd touch_deg(const Request& request) { return {"touch-sd-deg", request.touch_sd_deg}; }
AskedSd slip_mm(const Request& request) { return {"slip-sd-mm", request.slip_sd_mm}; }
AskedSd slip_deg(const Request& request) { return {"slip-sd-deg", request.slip_sd_deg}; }

/// The standard deviation; 0 where it is not asked. Throws Error where it is none.
double value_of(const AskedSd& sd) {
  if (sd.value && !(*sd.value >= 0.0 && std::isfinite(*sd.value))) {
    refuse_option(sd.option, *sd.value, "give a finite number from 0");
  }
  return sd.value.value_or(0.0);
}

/// Sets what is asked, and leaves the rest.
void set_displacement(const AskedSd& asked_mm, const AskedSd& asked_deg, double& mm, double& rad) {
  mm = asked_mm.value ? value_of(asked_mm) : mm;
  rad = asked_deg.value ? value_of(asked_deg) * std::numbers::pi / 180.0 : rad;
}

std::optional<double> none_weight(const Request& request, std::span<const Hypothesis> hypotheses) {
  const NoneWeight given = request.none.value_or(Automatic{});
  if (const auto* weight = std::get_if<double>(&given)) {
    if (!(*weight >= 0.0 && std::isfinite(*weight))) {
      refuse_option("none", *weight, "give a weight from 0, or no value");
    }
    return *weight > 0.0 ? std::optional(*weight) : std::nullopt;
  }
  constexpr double odds = 1.0 / 9.0;  // against all objects together: one in ten
  double sum = 0.0;
  for (const Hypothesis& hypothesis : hypotheses) {
    sum += hypothesis.weight;
  }
  return odds * sum;
}

double require_above_0(const char* option, double value) {
  if (!(value > 0.0 && std::isfinite(value))) {
    refuse_option(option, value, "must be above 0");
  }
  return value;
}

BoundedOptions asked_bounds(const Request& request, const HistogramOptions& histogram) {
  BoundedOptions bounded = bounded_instead(histogram).value();
  if (request.tolerance) {
    if (!(*request.tolerance > 0.0 && *request.tolerance < 1.0)) {
      refuse_option("tolerance", *request.tolerance, "give a probability between 0 and 1");
    }
    bounded.tolerance = *request.tolerance;
  }
  if (request.budget_ms) {
    bounded.budget_s = 1e-3 * require_above_0("budget-ms", *request.budget_ms);
  }
  if (request.evidence_nats) {
    bounded.evidence_nats = require_above_0("evidence-nats", *request.evidence_nats);
  }
  return bounded;
}

/// Throws Error where the request has an option that a particle filter has no use for.
ParticleOptions asked_particles(const Request& request, const HistogramOptions& histogram) {
  ParticleOptions particles{
      .region = histogram.lattice, .contact = histogram.contact, .augmented = request.augmented};
  particles.particles = request.particles.value_or(particles.particles);
  if (particles.particles < 1 || particles.particles > 1'000'000) {
    refuse_option("particles", particles.particles, "give 1 to 1,000,000");
  }
  particles.resampling = request.resampling.value_or(particles.resampling);
  particles.seed = request.seed.value_or(particles.seed);
  for (const AskedSd& sd : {touch_mm(request), touch_deg(request)}) {
    if (sd.value) {
      refuse_given(request, sd.option,
                   "particles take every touch's pose to be exact; use `filter bounded` or "
                   "`filter histogram`, or `slip-sd-mm` and `slip-sd-deg`, their motion noise");
    }
  }
  if (request.none && none_weight(request, {})) {
    refuse_given(request, "none",
                 "particles have no mean over all poses, which (none) needs; use `filter bounded` "
                 "or `filter histogram`");
  }
  set_displacement(slip_mm(request), slip_deg(request), particles.motion_mm, particles.motion_rad);
  return particles;
}

}  // namespace

FilterWish filter_wish(const Request& request) {
  const FilterKind kind = request.filter.value_or(FilterKind::automatic);
  const std::string filter = name_of(kind);
  const bool particles = kind == FilterKind::particles;
  for (const auto& [option, given] :
       {std::pair{"particles", request.particles.has_value()},
        std::pair{"resampling", request.resampling.has_value()},
        std::pair{"augmented", request.augmented}, std::pair{"seed", request.seed.has_value()}}) {
    if (given && !particles) {
      refuse_option(option,
                    fmt::format("has no effect on `filter {}`; add `filter particles`", filter));
    }
  }
  for (const auto& [option, given] :
       {std::pair{"tolerance", request.tolerance.has_value()},
        std::pair{"budget-ms", request.budget_ms.has_value()},
        std::pair{"evidence-nats", request.evidence_nats.has_value()}}) {
    if (given && (particles || kind == FilterKind::histogram)) {
      refuse_option(
          option, fmt::format("has no effect on `filter {}`; use `filter bounded`, or leave it out",
                              filter));
    }
    if (given && kind == FilterKind::automatic) {
      return {FilterKind::bounded, giver_of(request, option)};
    }
  }
  return {kind, request.keys.contains("filter") ? giver_of(request, "filter")
                                                : fmt::format("`filter {}`", filter)};
}

ChosenFilter choose_filter(const FilterWish& wish, const Request& request,
                           const CallerNeed& of_caller, std::span<const Hypothesis> hypotheses,
                           HistogramOptions histogram) {
  if (wish.kind == FilterKind::particles) {
    return {asked_particles(request, histogram), false, wish.by};
  }
  set_displacement(touch_mm(request), touch_deg(request), histogram.touch_sd.mm,
                   histogram.touch_sd.rad);
  set_displacement(slip_mm(request), slip_deg(request), histogram.slip_sd.mm,
                   histogram.slip_sd.rad);
  if (request.none || !of_caller.learned_only) {
    histogram.none_weight = none_weight(request, hypotheses);
  }
  const std::string caller = fmt::format("`{}`", of_caller.option);
  const bool slips = !histogram.slip_sd.none();
  if (slips && wish.kind == FilterKind::bounded) {
    for (const auto& [option, given] :
         {std::pair{"tolerance", request.tolerance.has_value()},
          std::pair{"budget-ms", request.budget_ms.has_value()},
          std::pair{"evidence-nats", request.evidence_nats.has_value()}}) {
      if (given) {
        refuse_option(option,
                      "has no effect where objects slip, as the histogram alone follows them; "
                      "leave it out");
      }
    }
  } else if (wish.kind == FilterKind::bounded) {
    if (!of_caller.why.empty()) {
      throw Error(Fault::input,
                  fmt::format("{}: {}; leave it out, or {}", caller, of_caller.why, wish.by));
    }
    return {asked_bounds(request, histogram), false, wish.by};
  }
  std::vector<std::string> by;  // what would have to go for bounds to take the bins
  if (!of_caller.why.empty()) {
    by.push_back(caller);
  }
  if (wish.kind == FilterKind::histogram) {
    by.push_back(wish.by);
  }
  return {histogram, by.empty() && !slips, slips ? "" : fmt::format("{}", fmt::join(by, " and "))};
}

void require_within_region(const Request& request, const PoseLattice& lattice) {
  const DisplacementSd widest = widest_displacement(lattice);
  const double widest_deg = widest.rad * 180.0 / std::numbers::pi;
  for (const auto& [sd, most, unit] : {std::tuple{touch_mm(request), widest.mm, "mm"},
                                       std::tuple{slip_mm(request), widest.mm, "mm"},
                                       std::tuple{touch_deg(request), widest_deg, "deg"},
                                       std::tuple{slip_deg(request), widest_deg, "deg"}}) {
    if (const double value = value_of(sd); value > most) {
      const std::string remedy =
          fmt::format("wider than the region, {:g} {}; give less, or widen the region", most, unit);
      if (const auto key = request.keys.find(sd.option); key != request.keys.end()) {
        refuse(request.scene, "{} = {}: {}", key->second, value, remedy);
      }
      refuse_option(sd.option, value, "{}", remedy);
    }
  }
}

ChosenBins chosen_bins(const std::function<Device&()>& device,
                       std::span<const Hypothesis> hypotheses, const ChosenFilter& filter,
                       BinWidth width) {
  const FilterTraits traits = traits_of(filter.options);
  const bool by_bounds =
      traits.certificate || (filter.automatic && bounded_instead(filter.options));
  const std::int64_t most = by_bounds ? most_bounded_bins : most_bins_on(device());
  return {balanced_lattice(lattice_of(filter.options), hypotheses, most, width, traits.touch_sd,
                           traits.slip_sd),
          most};
}

FilterOptions filter_for_bins(std::span<const Hypothesis> hypotheses, const FilterOptions& filter,
                              std::int64_t most_bins) {
  if (bins_in_all(hypotheses.size(), lattice_of(filter)) > most_bins) {
    const std::optional<BoundedOptions> bounded = bounded_instead(filter);
    if (bounded && bounds_have_room(hypotheses, *bounded)) {
      return *bounded;
    }
  }
  return filter;
}

FilterOptions with_evidence(FilterOptions filter, const LearnedSensor& sensor, bool to_the_end) {
  constexpr double share = 0.05;
  constexpr double negligible = 1e-4;
  constexpr std::int64_t poor_bins = 20'000;  // about as many as Eq. 7 needs of such touches
  auto* bounded = std::get_if<BoundedOptions>(&filter);
  if (bounded == nullptr) {
    return filter;
  }
  if (sensor.table && !to_the_end) {
    bounded->poor_bins = poor_bins;
  }
  const bool tempered = sensor.temperature > 1.0 || sensor.temperature_growth > 0.0;
  const double enough = share * sensor.temperature;
  if (!(tempered || sensor.features)) {
    return filter;
  }
  if (bounded->evidence_nats) {
    bounded->evidence_nats = std::min(*bounded->evidence_nats, enough);
  } else {
    bounded->evidence_nats = enough;
    bounded->evidence_range_nats = -std::log(negligible) * sensor.temperature;
    bounded->evidence_growth = sensor.temperature_growth / sensor.temperature;
  }
  return filter;
}

bool bounds_have_room(std::span<const Hypothesis> hypotheses, BoundedOptions options) {
  options.lattice.collapse_fixed().validate();
  return why_no_room(hypotheses, options, memory_for_search()).empty();
}

}  // namespace palpate
