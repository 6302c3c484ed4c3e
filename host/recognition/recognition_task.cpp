#include "recognition/recognition_task.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "estimation/bounded/search/search_memory.hpp"

namespace palpate {

namespace {

/// The lattice of a filter's options, or the region where it has no bins.
template <typename Options>
auto& lattice_in(Options& options) {
  if constexpr (requires { options.lattice; }) {
    return options.lattice;
  } else {
    return options.region;
  }
}

}  // namespace

RecognitionTask::RecognitionTask(std::vector<Hypothesis> objects, const FilterOptions& options)
    : hypotheses(std::move(objects)), filter(options) {
  for (const Hypothesis& hypothesis : hypotheses) {
    const std::string& label = hypothesis.map.label;
    const auto known = std::find(labels.begin(), labels.end(), label);
    label_of.push_back(static_cast<std::size_t>(known - labels.begin()));
    const bool occupied =
        std::ranges::any_of(hypothesis.map.log_odds, [](float l) { return l > 0.0F; });
    bodies.push_back(occupied ? std::optional(body_of(hypothesis.map)) : std::nullopt);
    if (known == labels.end()) {
      labels.push_back(label);
    }
  }
  const auto has_none = [](const auto& one) {
    if constexpr (requires { one.none_weight; }) {
      return one.none_weight.has_value();
    } else {
      return false;
    }
  };
  if (std::visit(has_none, filter)) {
    labels.emplace_back(none_label);
  }
}

const PoseLattice& RecognitionTask::lattice() const {
  return std::visit([](const auto& one) -> const PoseLattice& { return lattice_in(one); }, filter);
}

PoseLattice& RecognitionTask::lattice() {
  return std::visit([](auto& one) -> PoseLattice& { return lattice_in(one); }, filter);
}

const ContactModel& RecognitionTask::contact() const {
  return std::visit([](const auto& one) -> const ContactModel& { return one.contact; }, filter);
}

DisplacementSd RecognitionTask::touch_sd() const {
  const auto* histogram = std::get_if<HistogramOptions>(&filter);
  return histogram != nullptr ? histogram->touch_sd : DisplacementSd{};
}

DisplacementSd RecognitionTask::slip_sd() const {
  const auto* histogram = std::get_if<HistogramOptions>(&filter);
  return histogram != nullptr ? histogram->slip_sd : DisplacementSd{};
}

std::int64_t RecognitionTask::bins_in_all() const {
  // In float64, as counts of three axes may exceed an integer.
  const PoseLattice& bins = lattice();
  const double all = static_cast<double>(hypotheses.size()) * bins.x_mm.count * bins.y_mm.count *
                     bins.theta_rad.count;
  constexpr double most = 9e18;
  return static_cast<std::int64_t>(std::min(all, most));
}

std::optional<BoundedOptions> bounded_instead(const HistogramOptions& histogram) {
  if (!histogram.touch_sd.none() || !histogram.slip_sd.none() || histogram.memory_limit_bytes) {
    return {};
  }
  return BoundedOptions{.lattice = histogram.lattice,
                        .contact = histogram.contact,
                        .none_weight = histogram.none_weight};
}

std::optional<CoarsenedBins> settle_bins(const Device& device, RecognitionTask& task) {
  if (!task.bin_width) {
    return {};
  }
  const auto* histogram = std::get_if<HistogramOptions>(&task.filter);
  std::int64_t most = most_bins_on(device, false);
  if (traits_of(task.filter).certificate ||
      (histogram != nullptr && task.auto_filter && bounded_instead(*histogram))) {
    most = most_bounded_bins;
  } else if (histogram != nullptr) {
    most = most_bins_on(device, histogram->still_array, histogram->memory_limit_bytes);
    if (histogram->memory_limit_bytes) {
      // One bin an object may still exceed the limit: the histogram says how much memory it needs.
      most = std::max(most, static_cast<std::int64_t>(task.hypotheses.size()));
    }
  }
  const BalancedLattice chosen =
      balanced_lattice(task.lattice(), task.hypotheses, most, *task.bin_width);
  task.lattice() = chosen.lattice;
  return chosen.coarsened ? std::optional(CoarsenedBins{chosen.step_mm, most}) : std::nullopt;
}

std::string wider_bins_sentence(const RecognitionTask& task) {
  if (!task.learned_bins || !traits_of(task.filter).bins) {
    return "";
  }
  constexpr double much = 1.5;
  const BinSteps& learned = *task.learned_bins;
  const PoseLattice& lattice = task.lattice();
  // A fixed axis has a step of 0, and is no wider than any.
  const double x_mm = lattice.x_mm.step();
  const double y_mm = lattice.y_mm.step();
  const double theta_rad = lattice.theta_rad.step();
  if (!(x_mm > much * learned.x_mm || y_mm > much * learned.y_mm ||
        theta_rad > much * learned.theta_rad)) {
    return "";
  }
  constexpr double degrees = 180.0 / std::numbers::pi;
  return fmt::format(
      "bins are {:.3g} x {:.3g} mm x {:.3g} degrees wide, wider than the {:.3g} x {:.3g} mm x "
      "{:.3g} degrees that the sensor model is for: probabilities are too sure; calibrate with "
      "`bins {}x{}x{}` and this region, or take more bins",
      x_mm, y_mm, degrees * theta_rad, learned.x_mm, learned.y_mm, degrees * learned.theta_rad,
      lattice.x_mm.count, lattice.y_mm.count, lattice.theta_rad.count);
}

bool tells_known(const RecognitionTask& task) {
  return task.familiarity && traits_of(task.filter).bins;
}

void settle_evidence(RecognitionTask& task) {
  constexpr double share = 0.05;
  constexpr double negligible = 1e-4;
  auto* bounded = std::get_if<BoundedOptions>(&task.filter);
  const bool tempered = task.temperature > 1.0 || task.temperature_growth > 0.0;
  if (bounded != nullptr && (tempered || task.features || task.familiarity) &&
      !bounded->evidence_nats) {
    bounded->evidence_nats = share * task.temperature;
    bounded->evidence_range_nats =
        std::max(-std::log(negligible) * task.temperature,
                 task.familiarity ? FamiliarityScore::most_lead_nats : 0.0);
    bounded->evidence_growth = task.temperature_growth / task.temperature;
  }
}

void settle_filter(RecognitionTask& task) {
  const auto* histogram = std::get_if<HistogramOptions>(&task.filter);
  if (!task.auto_filter || histogram == nullptr || task.bins_in_all() <= most_histogram_bins) {
    return;
  }
  const std::optional<BoundedOptions> bounded = bounded_instead(*histogram);
  if (bounded && bounds_have_room(task)) {
    task.filter = *bounded;
  }
}

bool bounds_have_room(const RecognitionTask& task) {
  BoundedOptions options{.lattice = task.lattice(), .contact = task.contact()};
  options.lattice.collapse_fixed().validate();
  return why_no_room(task.hypotheses, options, memory_for_search()).empty();
}

}  // namespace palpate
