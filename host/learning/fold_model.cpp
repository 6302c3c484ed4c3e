#include <algorithm>
#include <utility>

#include "learning/cross_validation.hpp"
#include "learning/feature_learning.hpp"
#include "learning/progress.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

/// What presses say of presses that are not among them by Eq. 7.
FoldModel eq7_model(const LearnedPresses& learned, const ModelLearning& how) {
  FoldModel model{.maps = learned.maps, .how = table_learning({}, learned, how)};
  model.how.contact.classifier = learned.readings.maps().classifier;
  if (how.bins && how.given.empty()) {
    // Touches at known poses are tried on maps of all others, as unknowns will be.
    model.maps = learned.of_objects;
  }
  if (!how.bins) {
    model.features = learn_features(learned.presses, learned.readings.classifier);
  }
  return model;
}

}  // namespace

LearnedPresses with_maps(std::vector<Press> presses, LearnedReadings readings,
                         const ModelLearning& how) {
  LearnedPresses learned{std::move(presses), std::move(readings), how.given};
  if (how.given.empty()) {
    const MapOptions maps = learned.readings.maps();
    if (how.bins) {
      MapsByFolds built = maps_by_folds(learned.presses, maps, how.folds);
      learned.maps = std::move(built.without_folds);
      learned.of_objects = std::move(built.of_objects);
    } else {
      learned.maps = maps_of_presses(learned.presses, maps);
    }
  }
  return learned;
}

TableLearning table_learning(const TableKind& kind, const LearnedPresses& learned,
                             const ModelLearning& how) {
  constexpr double near = 2.0;  // in spacings of the elements
  constexpr double far = 6.0;
  const LearnedReadings& readings = learned.readings;
  TableLearning table;
  if (kind.layer == MapLayer::mean_level) {
    table.layer = mean_level_layer(readings.classifier.threshold,
                                   readings.pressures.empty() ? 0.0 : readings.pressures.back());
  }
  table.layer.near_mm = near * readings.spacing_mm;
  table.layer.far_mm = far * readings.spacing_mm;
  table.level_edges = readings.level_edges(kind.levels);
  table.contact = {
      .classifier = readings.classifier, .gamma = ContactModel{}.gamma, .prior = readings.prior};
  if (how.bins) {
    table.counted_within = *how.bins;
  } else {
    table.lattice = placing_lattice(learned.maps, readings.spacing_mm, placing_step_rad);
  }
  return table;
}

std::set<std::string> compared_labels(const LearnedPresses& learned) {
  std::set<std::string> labels;
  for (std::size_t i = 0; i < learned.presses.size(); ++i) {
    const std::string& label = learned.presses[i].label;
    if (std::ranges::any_of(learned.maps, [&](const TrainingMap& map) {
          return map.map.label == label && !map.holds(i);
        })) {
      labels.insert(label);
    }
  }
  return labels;
}

std::vector<FoldModel> models_of(const std::vector<Press>& presses,
                                 const std::vector<TableKind>& tables, const ModelLearning& how,
                                 const std::function<void(double)>& progress) {
  LearnedPresses learned;
  FoldModel eq7;
  try {
    learned = with_maps(presses, learn_readings(presses, how.readings), how);
    eq7 = eq7_model(learned, how);
  } catch (const Error&) {
    return {};
  }
  Progress work(static_cast<double>(tables.size()), progress);
  std::vector<FoldModel> models;
  for (const TableKind& kind : tables) {
    FoldModel& model = models.emplace_back(eq7);
    model.how = table_learning(kind, learned, how);
    model.table = compared_labels(learned).empty()
                      ? model.how.initial()
                      : learn_table(learned.presses, learned.maps, model.how, work.part(1.0)).table;
  }
  models.push_back(std::move(eq7));
  return models;
}

}  // namespace palpate
