#include "recognition/filter_choice.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include <fmt/format.h>

#include "estimation/bounded/search_memory.hpp"
#include "estimation/displacement_weights.hpp"
#include "options/option.hpp"

namespace palpate {

namespace {

/// The first option that only bounds read; "" where none is given.
std::string_view option_of_bounds(const Request& request) {
  return first_given(request, {"tolerance", "budget-ms", "evidence-nats"});
}

/// Sets what is asked, and leaves the rest.
void set_displacement(const std::optional<double>& asked_mm, const std::optional<double>& asked_deg,
                      DisplacementSd& sd) {
  sd.mm = asked_mm.value_or(sd.mm);
  sd.rad = asked_deg ? *asked_deg * std::numbers::pi / 180.0 : sd.rad;
}

BoundedOptions asked_bounds(const Request& request, const HistogramOptions& histogram) {
  BoundedOptions bounded{.lattice = histogram.lattice,
                         .contact = histogram.contact,
                         .touch_sd = histogram.touch_sd,
                         .none_weight = histogram.none_weight};
  bounded.tolerance = request.tolerance.value_or(bounded.tolerance);
  if (request.budget_ms) {
    bounded.budget_s = 1e-3 * *request.budget_ms;
  }
  bounded.evidence_nats = request.evidence_nats;
  return bounded;
}

/// Throws Error where the request has an option that a particle filter has no use for.
ParticleOptions asked_particles(const Request& request, const HistogramOptions& histogram) {
  ParticleOptions particles{
      .region = histogram.lattice, .contact = histogram.contact, .augmented = request.augmented};
  particles.particles = request.particles.value_or(particles.particles);
  particles.resampling = request.resampling.value_or(particles.resampling);
  particles.seed = request.seed.value_or(particles.seed);
  if (const auto option = first_given(request, {"touch-sd-mm", "touch-sd-deg"}); !option.empty()) {
    refuse_given(request, option,
                 "particles take every touch's pose to be exact; use `filter bounded` or "
                 "`filter histogram`, or `slip-sd-mm` and `slip-sd-deg`, their motion noise");
  }
  if (request.none && histogram.none_weight) {
    refuse_given(request, "none",
                 "particles have no mean over all poses, which (none) needs; use `filter bounded` "
                 "or `filter histogram`");
  }
  DisplacementSd motion{particles.motion_mm, particles.motion_rad};
  set_displacement(request.slip_sd_mm, request.slip_sd_deg, motion);
  particles.motion_mm = motion.mm;
  particles.motion_rad = motion.rad;
  return particles;
}

/// The filter by the wish and the options alone, on the region's bins.
ChosenFilter asked_filter(Asked& asked, const FilterWish& wish, const HistogramOptions& histogram) {
  const Request& request = asked.request;
  const std::string& every_bin_for = asked.of.every_bin_for;
  const bool by_histogram = wish.kind == FilterKind::histogram;
  const bool by_bounds =
      wish.kind == FilterKind::bounded || (!by_histogram && every_bin_for.empty());
  if (wish.kind == FilterKind::particles) {
    return {asked_particles(request, histogram), wish.by};
  }
  if (!histogram.slip_sd.none()) {
    if (const std::string_view option = option_of_bounds(request); !option.empty()) {
      refuse_option(option,
                    "has no effect where objects slip, as the histogram alone follows them; leave "
                    "it out");
    }
    if (by_bounds) {
      asked.remarks.emplace_back(
          "objects that slip are followed by the histogram, over every bin; `filter histogram` "
          "says so");
    }
    return {histogram, ""};
  }
  if (by_bounds) {
    return {asked_bounds(request, histogram), wish.by};
  }
  // What would have to go for bounds to take the bins.
  std::string by = by_histogram ? wish.by : "";
  if (!every_bin_for.empty()) {
    by = fmt::format("`{}`{}{}", every_bin_for, by_histogram ? " and " : "", by);
  }
  return {histogram, by};
}

/// The lattice with counts that were settled before or, where a width is given, chosen.
PoseLattice settled_lattice(Asked& asked, const FilterOptions& filter,
                            std::span<const Hypothesis> hypotheses, std::optional<BinWidth> width) {
  PoseLattice lattice = lattice_of(filter);
  if (const auto& counts = asked.of.counts) {
    lattice.x_mm.count = (*counts)[0];
    lattice.y_mm.count = (*counts)[1];
    lattice.theta_rad.count = (*counts)[2];
    return lattice;
  }
  if (!width) {
    return lattice;
  }
  const auto [bins, limit] = chosen_bins(asked.device, hypotheses, filter, *width);
  if (bins.coarsened) {
    asked.remarks.push_back(fmt::format(
        "`bins {}`: steps of {:.2f} mm, wider than the maps resolve, keep to {} bins in all; "
        "narrow the region, or give `bins`",
        *width == BinWidth::fine ? "fine" : "auto", bins.step_mm, limit));
  }
  return bins.lattice;
}

/// An axis of one bin limits nothing.
/// @param lattice with the counts that are used
/// @throws Error where a standard deviation is wider than the region
void require_within_region(const Request& request, const PoseLattice& lattice) {
  const DisplacementSd widest = widest_displacement(lattice);
  const double widest_deg = widest.rad * 180.0 / std::numbers::pi;
  for (const auto& [option, sd, limit, unit] :
       {std::tuple{"touch-sd-mm", request.touch_sd_mm, widest.mm, "mm"},
        std::tuple{"slip-sd-mm", request.slip_sd_mm, widest.mm, "mm"},
        std::tuple{"touch-sd-deg", request.touch_sd_deg, widest_deg, "deg"},
        std::tuple{"slip-sd-deg", request.slip_sd_deg, widest_deg, "deg"}}) {
    if (sd.value_or(0.0) > limit) {
      refuse_given(request, option,
                   "wider than the region, {:g} {}; give less, or widen the region", limit, unit);
    }
  }
}

}  // namespace

FilterWish filter_wish(const Request& request) {
  const FilterKind kind = request.filter.value_or(FilterKind::automatic);
  const std::string filter = name_of(kind);
  const bool particles = kind == FilterKind::particles;
  if (const auto option = first_given(request, {"particles", "resampling", "augmented", "seed"});
      !option.empty() && !particles) {
    refuse_option(option,
                  fmt::format("has no effect on `filter {}`; add `filter particles`", filter));
  }
  if (const std::string_view option = option_of_bounds(request); !option.empty()) {
    if (particles || kind == FilterKind::histogram) {
      refuse_option(
          option, fmt::format("has no effect on `filter {}`; use `filter bounded`, or leave it out",
                              filter));
    }
    if (kind == FilterKind::automatic) {
      return {FilterKind::bounded, fmt::format("`{}`", option)};
    }
  }
  return {kind, request.filter ? origin_of_option(request, "filter") : "`filter auto`"};
}

ChosenFilter choose_filter(Asked& asked, const FilterWish& wish,
                           std::span<const Hypothesis> hypotheses, HistogramOptions histogram,
                           std::optional<BinWidth> width) {
  const Request& request = asked.request;
  if (wish.kind != FilterKind::particles) {
    set_displacement(request.touch_sd_mm, request.touch_sd_deg, histogram.touch_sd);
    set_displacement(request.slip_sd_mm, request.slip_sd_deg, histogram.slip_sd);
  }
  ChosenFilter filter = asked_filter(asked, wish, histogram);
  const PoseLattice lattice = settled_lattice(asked, filter.options, hypotheses, width);
  require_within_region(request, lattice);
  filter.options = with_lattice(filter.options, lattice);
  const auto* bounded = std::get_if<BoundedOptions>(&filter.options);
  if (wish.kind == FilterKind::automatic && bounded != nullptr &&
      !bounds_have_room(hypotheses, *bounded)) {
    filter.options = with_lattice(histogram, lattice);
  }
  return filter;
}

ChosenBins chosen_bins(const DeviceSource& device, std::span<const Hypothesis> hypotheses,
                       const FilterOptions& filter, BinWidth width) {
  const FilterTraits traits = traits_of(filter);
  const std::int64_t limit = traits.certificate ? most_bounded_bins : most_bins_on(device());
  return {balanced_lattice(lattice_of(filter), hypotheses, limit, width, traits.touch_sd,
                           traits.slip_sd),
          limit};
}

FilterOptions with_evidence(FilterOptions filter, const LearnedSensor& sensor,
                            bool honour_tolerance) {
  constexpr double share = 0.05;
  constexpr double negligible = 1e-4;
  constexpr std::int64_t poor_bins = 20'000;  // about as many as Eq. 7 needs of such touches
  auto* bounded = std::get_if<BoundedOptions>(&filter);
  if (bounded == nullptr) {
    return filter;
  }
  if (sensor.table && !honour_tolerance) {
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
