#include "learning/fold_model.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "learning/feature_learning.hpp"
#include "learning/tried_bins.hpp"

namespace palpate {

std::vector<TrainingMap> maps_to_learn_on(const LearnedPresses& learned, const ModelLearning& how) {
  const MapOptions maps = learned.readings.maps(how.readings.spacing_mm);
  return !how.given.empty() ? how.given
         : how.bins         ? maps_without_folds(learned.presses, maps, how.folds)
                            : maps_of_presses(learned.presses, maps);
}

TableLearning table_learning(const TableKind& kind, const LearnedPresses& learned,
                             const ModelLearning& how) {
  constexpr double near = 2.0;  // in spacings of the elements
  constexpr double far = 6.0;
  const double spacing_mm = how.readings.spacing_mm;
  const ContactClassifier& classifier = learned.readings.classifier;
  TableLearning table;
  if (kind.layer == MapLayer::mean_level) {
    const std::vector<double> pressures = contact_pressures(learned.presses, classifier);
    table.layer =
        mean_level_layer(classifier.threshold, pressures.empty() ? 0.0 : pressures.back());
  }
  table.layer.near_mm = near * spacing_mm;
  table.layer.far_mm = far * spacing_mm;
  table.level_edges = level_edges_of(learned.presses, classifier, kind.levels);
  table.contact = {
      .classifier = classifier, .gamma = ContactModel{}.gamma, .prior = learned.readings.prior};
  if (how.bins) {
    table.counted_within = *how.bins;
  } else {
    table.lattice = placing_lattice(learned.maps, spacing_mm, placing_step_rad);
  }
  return table;
}

bool has_map_without(std::size_t press, const std::string& label,
                     const std::vector<TrainingMap>& maps) {
  return std::ranges::any_of(
      maps, [&](const TrainingMap& map) { return map.map.label == label && !map.holds(press); });
}

FoldLearning::FoldLearning(std::vector<Press> others, const ModelLearning& how)
    : how_(how), learned_{.presses = std::move(others)} {
  learned_.readings = learn_readings(learned_.presses, how.readings);
  learned_.maps = maps_to_learn_on(learned_, how);
  // Touches at known poses are tried on maps of all others, as unknowns will be.
  model_.maps =
      how.bins && how.given.empty()
          ? maps_of_objects(learned_.presses, learned_.readings.maps(how.readings.spacing_mm))
          : learned_.maps;
  if (!how.bins) {
    model_.features = learn_features(learned_.presses, learned_.readings.classifier);
  }
}

const FoldModel& FoldLearning::learn(const TableKind& kind,
                                     const std::function<void(double)>& progress) {
  model_.how = table_learning(kind, learned_, how_);
  model_.table = model_.how.initial();
  for (std::size_t i = 0; i < learned_.presses.size(); ++i) {
    if (has_map_without(i, learned_.presses[i].label, learned_.maps)) {
      model_.table = learn_table(learned_.presses, learned_.maps, model_.how, progress).table;
      break;
    }
  }
  return model_;
}

const FoldModel& FoldLearning::by_eq7() {
  model_.how = table_learning({}, learned_, how_);
  model_.table.reset();
  return model_;
}

}  // namespace palpate
