#include "recognition/recognition_task.hpp"

#include <algorithm>
#include <utility>

#include "model/element_spacing.hpp"

namespace palpate {

namespace {

/// RecognitionTask::labels
std::vector<std::string> labels_in(const std::vector<Hypothesis>& hypotheses, bool with_none) {
  std::vector<std::string> labels;
  for (const Hypothesis& hypothesis : hypotheses) {
    const std::string& label = hypothesis.map.label;
    if (std::ranges::find(labels, label) == labels.end()) {
      labels.push_back(label);
    }
  }
  if (with_none) {
    labels.emplace_back(none_label);
  }
  return labels;
}

/// RecognitionTask::label_of
std::vector<std::size_t> label_indices(const std::vector<Hypothesis>& hypotheses,
                                       const std::vector<std::string>& labels) {
  std::vector<std::size_t> indices;
  for (const Hypothesis& hypothesis : hypotheses) {
    const auto known = std::ranges::find(labels, hypothesis.map.label);
    indices.push_back(static_cast<std::size_t>(known - labels.begin()));
  }
  return indices;
}

/// RecognitionTask::bodies
std::vector<std::optional<Body>> bodies_in(const std::vector<Hypothesis>& hypotheses) {
  std::vector<std::optional<Body>> bodies;
  for (const Hypothesis& hypothesis : hypotheses) {
    const OccupancyGrid& map = hypothesis.map;
    const bool occupied = std::ranges::any_of(map.log_odds, [](float l) { return l > 0.0F; });
    bodies.push_back(occupied ? std::optional(body_of(map)) : std::nullopt);
  }
  return bodies;
}

}  // namespace

std::size_t touches_in_contact(std::span<const TouchEvidence> touches) {
  return static_cast<std::size_t>(std::ranges::count_if(touches, &TouchEvidence::in_contact));
}

RecognitionTask::RecognitionTask(std::vector<Hypothesis> objects, FilterOptions options)
    : hypotheses(std::move(objects)),
      filter(std::move(options)),
      labels(labels_in(hypotheses, traits_of(filter).none_weight.has_value())),
      label_of(label_indices(hypotheses, labels)),
      bodies(bodies_in(hypotheses)) {}

std::string RecognitionTask::name_of(int object) const {
  const Hypothesis& hypothesis = hypotheses[static_cast<std::size_t>(object)];
  return hypothesis.map.label + (hypothesis.mirrored ? " mirrored" : "");
}

double RecognitionTask::temperature_after(std::span<const TouchEvidence> touches) const {
  const auto informative = std::ranges::count_if(touches, &TouchEvidence::tells);
  return temperature_of(static_cast<std::size_t>(std::max<std::ptrdiff_t>(informative, 1)),
                        sensor.temperature, sensor.temperature_growth);
}

FitScale RecognitionTask::fit_scale_for(std::span<const TouchEvidence> touches) const {
  double known = 0.0;
  double in_contact = 0.0;
  const TouchEvidence* last = nullptr;
  for (const TouchEvidence& touch : touches) {
    if (touch.in_contact()) {
      known += static_cast<double>(touch.readings.size()) -
               static_cast<double>(std::ranges::count(touch.readings, Reading::unknown));
      in_contact += 1.0;
      last = &touch;
    }
  }
  const FitScale scale = fit_scale();
  if (last == nullptr || !scale.array) {
    return scale;
  }
  const std::optional<ElementSpacing> spacing = spacing_of(last->elements_mm);
  return scale.for_array({known / in_contact, spacing ? spacing->nearest_mm.most : 0.0});
}

}  // namespace palpate
