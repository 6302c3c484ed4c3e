#include "recognition_task.hpp"

#include <algorithm>
#include <utility>

namespace palpate {

RecognitionTask::RecognitionTask(std::vector<Hypothesis> objects, const FilterOptions& options)
    : hypotheses(std::move(objects)), filter(options) {
  for (const Hypothesis& hypothesis : hypotheses) {
    const std::string& label = hypothesis.map.label;
    const auto known = std::find(labels.begin(), labels.end(), label);
    label_of.push_back(static_cast<std::size_t>(known - labels.begin()));
    if (known == labels.end()) {
      labels.push_back(label);
    }
  }
  const auto* histogram = std::get_if<HistogramOptions>(&filter);
  if (histogram != nullptr && histogram->none_weight) {
    labels.emplace_back(none_label);
  }
}

const PoseLattice& RecognitionTask::lattice() const {
  const auto* histogram = std::get_if<HistogramOptions>(&filter);
  return histogram != nullptr ? histogram->lattice : std::get<ParticleOptions>(filter).region;
}

const ContactModel& RecognitionTask::contact() const {
  return std::visit([](const auto& one) -> const ContactModel& { return one.contact; }, filter);
}

DisplacementSd RecognitionTask::touch_sd() const {
  const auto* histogram = std::get_if<HistogramOptions>(&filter);
  return histogram != nullptr ? histogram->touch_sd : DisplacementSd{};
}

std::optional<CoarsenedBins> settle_bins(const Device& device, RecognitionTask& task) {
  const std::optional<BinWidth> width = std::exchange(task.bin_width, {});
  if (!width) {
    return {};
  }
  auto* histogram = std::get_if<HistogramOptions>(&task.filter);
  std::int64_t most = most_bins_on(device, false);
  if (histogram != nullptr) {
    most = most_bins_on(device, histogram->still_array, histogram->memory_limit_bytes);
    if (histogram->memory_limit_bytes) {
      // One bin an object may still exceed the limit: the histogram says how much memory it needs.
      most = std::max(most, static_cast<std::int64_t>(task.hypotheses.size()));
    }
  }
  const BalancedLattice chosen = balanced_lattice(task.lattice(), task.hypotheses, most, *width);
  (histogram != nullptr ? histogram->lattice : std::get<ParticleOptions>(task.filter).region) =
      chosen.lattice;
  return chosen.coarsened ? std::optional(CoarsenedBins{chosen.step_mm, most}) : std::nullopt;
}

}  // namespace palpate
