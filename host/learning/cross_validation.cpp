#include "learning/cross_validation.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <utility>

#include <tbb/parallel_for.h>
#include <glm/vec3.hpp>

#include "estimation/lattice/refinement.hpp"
#include "estimation/log_sum.hpp"
#include "learning/local_search.hpp"
#include "learning/progress.hpp"
#include "palpate/error.hpp"
#include "palpate/pose_error.hpp"
#include "recognition/label_probability.hpp"

namespace palpate {

namespace {

constexpr double nothing = -std::numeric_limits<double>::infinity();

/// What the maps of one label say of a press.
struct LabelScore {
  LogSum evidence;                       ///< over the maps
  double best_log_likelihood = nothing;  ///< at the best pose of the best map
  std::size_t best_map = 0;
  Pose best_pose;
  std::size_t maps = 0;

  void add(std::size_t map, const PressPlacement& placement) {
    evidence.add(placement.log_evidence);
    if (placement.log_likelihood > best_log_likelihood) {
      best_log_likelihood = placement.log_likelihood;
      best_map = map;
      best_pose = placement.T_object_robot;
    }
    ++maps;
  }
  /// Of the mean over the maps.
  double log_evidence() const {
    return maps == 0 ? nothing : evidence.log() - std::log(static_cast<double>(maps));
  }
};

/// A model of the other folds, by whose maps presses are recognised.
class FoldTrial {
 public:
  FoldTrial(const std::vector<std::string>& labels, const FoldModel& model,
            const CalibrationSettings& settings)
      : labels_(labels), model_(model), settings_(settings), maps_of_(labels.size()) {
    for (const TrainingMap& map : model.maps) {
      const std::optional<std::size_t> label = label_of(map.map.label);
      if (label && maps_of_[*label].size() < settings.most_maps) {
        maps_of_[*label].push_back(hypotheses_.size());
      }
      hypotheses_.push_back({.map = map.map});
    }
    if (model.table) {
      std::vector<OccupancyGrid> layers = layers_of(model.maps, model.learning.layer);
      for (std::size_t map = 0; map < layers.size(); ++map) {
        hypotheses_[map].layer = std::move(layers[map]);
      }
    }
  }

  CrossValidation run(std::size_t fold, const std::vector<Press>& presses) const {
    const std::vector<std::size_t> fold_of = folds_of(presses, settings_.folds);
    std::vector<Press> tried;
    for (std::size_t i = 0; i < presses.size(); ++i) {
      const std::optional<std::size_t> label = label_of(presses[i].label);
      if (fold_of[i] == fold && label && !maps_of_[*label].empty()) {
        tried.push_back(presses[i]);
      }
    }
    const std::vector<Trial> trials = trials_of(tried, settings_.bins, fold);
    const ContactModel classifier = contact_for("");
    std::vector<std::vector<TouchEvidence>> evidence;
    for (const Trial& trial : trials) {
      evidence.push_back(evidence_of(trial.press.touches, classifier));
    }
    const auto scores = score(evidence);
    CrossValidation result;
    for (std::size_t i = 0; i < trials.size(); ++i) {
      HeldOut held_out{.fold = fold, .half = trials[i].half, .log_evidence = {}};
      judge(trials[i].press, evidence[i], scores[i], held_out);
      result.unknowns.push_back(std::move(held_out));
    }
    if (settings_.bins && model_.table) {
      result.place_errors = errors_of(tried);
    }
    return result;
  }

 private:
  /// The label's index; none where it is not to be recognised.
  std::optional<std::size_t> label_of(const std::string& label) const {
    const auto at = std::ranges::lower_bound(labels_, label);
    if (at == labels_.end() || *at != label) {
      return {};
    }
    return static_cast<std::size_t>(at - labels_.begin());
  }

  /// With the numbers of all objects together where the label has none of its own.
  ContactModel contact_for(const std::string& label) const {
    return model_.table ? contact_with(model_.learning.contact, *model_.table, label)
                        : model_.learning.contact;
  }

  PressPlacer placer_on(std::size_t map, const ContactModel& contact) const {
    return {hypotheses_[map], contact,
            settings_.bins ? settings_.bins->lattice : model_.learning.lattice};
  }

  /// The scores of presses, [press][label].
  std::vector<std::vector<LabelScore>> score(
      const std::vector<std::vector<TouchEvidence>>& presses) const {
    std::vector<std::vector<LabelScore>> scores(presses.size(),
                                                std::vector<LabelScore>(labels_.size()));
    tbb::parallel_for(std::size_t{0}, labels_.size(), [&](std::size_t label) {
      const ContactModel contact = contact_for(labels_[label]);
      for (const std::size_t map : maps_of_[label]) {
        PressPlacer placer = placer_on(map, contact);
        for (std::size_t i = 0; i < presses.size(); ++i) {
          scores[i][label].add(map, placer.place(presses[i]));
        }
      }
    });
    return scores;
  }

  /// Fills in what the model says of a press, or of a group.
  void judge(const Press& press, std::span<const TouchEvidence> evidence,
             const std::vector<LabelScore>& scores, HeldOut& unknown) const {
    const std::size_t truth = *label_of(press.label);
    unknown.truth = truth;
    unknown.touches = evidence.size();
    std::ranges::transform(scores, std::back_inserter(unknown.log_evidence),
                           &LabelScore::log_evidence);
    unknown.log_density = log_densities(evidence.front());
    std::vector<std::size_t> labels;  // with maps, but the true one
    for (std::size_t label = 0; label < labels_.size(); ++label) {
      if (label != truth && scores[label].maps > 0) {
        labels.push_back(label);
      }
    }
    const auto in_contact = std::ranges::count_if(evidence, &TouchEvidence::in_contact);
    if (model_.table && labels.size() >= 2 && in_contact > 0) {
      unknown.stranger_fit =
          StrangerFit{best_fit(evidence, scores, labels), static_cast<std::size_t>(in_contact)};
    }
    if (unknown.half == 0) {
      unknown.error_mm = pose_error_of(evidence, truth, *press.T_object_robot);
    }
    // A press of which nothing is In Contact says nothing of its object.
    if (unknown.half || !evidence.front().in_contact()) {
      return;
    }
    labels.insert(labels.begin(), truth);  // the best where another is as good
    if (!press.T_object_robot) {
      unknown.fit_z = best_fit(evidence, scores, labels).z;
      return;
    }
    unknown.fit_z = evidence_fit(evidence, *press.T_object_robot,
                                 hypotheses_[scores[truth].best_map].compared(),
                                 contact_for(labels_[truth]), {}, 0)
                        .value()
                        .z;
    if (model_.table) {
      unknown.best_fit_z = best_fit(evidence, scores, labels).z;
    }
  }

  /// See HeldOut::error_mm.
  double pose_error_of(std::span<const TouchEvidence> press, std::size_t label,
                       const Pose& T_object_robot) const {
    constexpr int most_rounds = 6;
    constexpr double enough = 0.6;  // of a step: a standard deviation that the steps resolve
    const std::size_t map = maps_of_[label].front();
    const PressPlacer placer = placer_on(map, contact_for(labels_[label]));
    // The first window is wide: one that ended near the truth would draw beliefs to it.
    const double spacing_mm = settings_.readings.spacing_mm;
    glm::dvec3 step{0.3 * spacing_mm, 0.3 * spacing_mm, 0.06};
    glm::dvec3 middle{T_object_robot.translation_mm, T_object_robot.theta_rad};
    const auto pose_at = [](const glm::dvec3& at) { return Pose{{at.x, at.y}, at.z}; };
    bool resolved = false;
    for (int round = 0; round < most_rounds && !resolved; ++round) {
      std::vector<std::pair<glm::dvec3, double>> about;
      visit_grid({3, 3, 3}, [&](const glm::dvec3& index) {
        const glm::dvec3 at = middle + step * index;
        about.emplace_back(at - middle, placer.log_likelihood(press, pose_at(at)));
      });
      const Moments belief(about);
      middle += belief.mean;
      resolved = true;
      for (int axis = 0; axis < 3; ++axis) {
        if (!(belief.variance[axis] > enough * enough * step[axis] * step[axis])) {
          step[axis] /= 2.0;
          resolved = false;
        }
      }
    }
    return pose_error_mm(displaced_body(hypotheses_[map].map), 1, pose_at(middle), T_object_robot);
  }

  /// Log density of a touch's features under every label; empty without features.
  std::vector<double> log_densities(const TouchEvidence& touch) const {
    std::vector<double> densities;
    if (model_.features) {
      const PressFeatures own = features_of(touch, model_.learning.contact.classifier.threshold);
      for (const std::string& label : labels_) {
        const auto known = model_.features->objects.find(label);
        const FeatureDistribution& of_label =
            known == model_.features->objects.end() ? model_.features->any : known->second;
        densities.push_back(of_label.log_density(own));
      }
    }
    return densities;
  }

  /// How a press with an element In Contact fits the best of these objects at about the best pose.
  Fit best_fit(std::span<const TouchEvidence> press, const std::vector<LabelScore>& scores,
               std::span<const std::size_t> labels) const {
    const std::size_t label = *std::ranges::max_element(
        labels, {}, [&](std::size_t one) { return scores[one].best_log_likelihood; });
    const LabelScore& at = scores[label];
    return best_fit_near(press, at.best_pose, hypotheses_[at.best_map].compared(),
                         contact_for(labels_[label]), 0)
        .value();
  }

  /// Errors of the places of presses at known poses.
  std::vector<PlaceError> errors_of(const std::vector<Press>& presses) const {
    std::vector<PlaceError> errors;
    for (std::size_t label = 0; label < labels_.size(); ++label) {
      const ContactModel contact = contact_for(labels_[label]);
      std::map<std::string, std::vector<TouchEvidence>> of_group;
      for (const Press& press : presses) {
        TouchEvidence touch(press.touches.front(), contact);
        touch.T_robot_sensor = press.T_object_robot.value() * touch.T_robot_sensor;
        if (press.label == labels_[label] && touch.in_contact()) {
          of_group[press.group].push_back(std::move(touch));
        }
      }
      // Touches of several groups together would hide by how much each is off.
      for (const auto& [group, touches] : of_group) {
        std::ranges::move(place_errors(touches, hypotheses_[maps_of_[label].front()], contact),
                          std::back_inserter(errors));
      }
    }
    return errors;
  }

  const std::vector<std::string>& labels_;
  const FoldModel& model_;
  const CalibrationSettings& settings_;
  std::vector<Hypothesis> hypotheses_;             ///< [map]
  std::vector<std::vector<std::size_t>> maps_of_;  ///< [label]
};

/// What presses say of presses that are not among them by Eq. 7.
FoldModel eq7_model(const LearnedPresses& learned, const CalibrationSettings& settings) {
  FoldModel model{.maps = learned.maps, .learning = table_learning({}, learned, settings)};
  model.learning.contact.classifier = learned.readings.maps.classifier;
  if (settings.steps && settings.given.empty()) {
    // Touches at known poses are tried on maps of all others, as unknowns will be.
    model.maps = learned.of_objects;
  }
  if (!settings.steps) {
    model.features = learn_features(learned.presses, learned.readings.classifier);
  }
  return model;
}

}  // namespace

LearnedPresses with_maps(std::vector<Press> presses, LearnedReadings readings,
                         const CalibrationSettings& settings) {
  LearnedPresses learned{std::move(presses), std::move(readings), settings.given};
  if (settings.given.empty()) {
    const MapOptions& maps = learned.readings.maps;
    if (settings.steps) {
      MapsByFolds built = maps_by_folds(learned.presses, maps, settings.folds);
      learned.maps = std::move(built.without_folds);
      learned.of_objects = std::move(built.of_objects);
    } else {
      learned.maps = maps_of_presses(learned.presses, maps);
    }
  }
  return learned;
}

TableLearning table_learning(const TableKind& kind, const LearnedPresses& learned,
                             const CalibrationSettings& settings) {
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
  table.contact = {.classifier = readings.classifier, .prior = readings.maps.sensor.prior};
  if (settings.steps) {
    table.counted_within = *settings.steps;
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
                                 const CalibrationSettings& settings,
                                 const std::function<void(double)>& progress) {
  LearnedPresses learned;
  FoldModel eq7;
  try {
    learned = with_maps(presses, learn_readings(presses, settings.readings), settings);
    eq7 = eq7_model(learned, settings);
  } catch (const Error&) {
    return {};
  }
  Progress work(static_cast<double>(settings.tables.size()), progress);
  std::vector<FoldModel> models;
  for (const TableKind& kind : settings.tables) {
    FoldModel& model = models.emplace_back(eq7);
    model.learning = table_learning(kind, learned, settings);
    model.table =
        compared_labels(learned).empty()
            ? model.learning.initial()
            : learn_table(learned.presses, learned.maps, model.learning, work.part(1.0)).table;
  }
  models.push_back(std::move(eq7));
  return models;
}

CrossValidation& CrossValidation::operator+=(const CrossValidation& fold) {
  unknowns.insert(unknowns.end(), fold.unknowns.begin(), fold.unknowns.end());
  place_errors.insert(place_errors.end(), fold.place_errors.begin(), fold.place_errors.end());
  return *this;
}

CrossValidation try_fold(std::size_t fold, const std::vector<Press>& presses,
                         const std::vector<std::string>& labels, const FoldModel& model,
                         const CalibrationSettings& settings) {
  return FoldTrial(labels, model, settings).run(fold, presses);
}

}  // namespace palpate
