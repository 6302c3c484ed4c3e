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
#include "learning/progress.hpp"
#include "palpate/pose_error.hpp"
#include "recognition/object_fit.hpp"

namespace palpate {

namespace {

constexpr double nothing = -std::numeric_limits<double>::infinity();

/// What the maps of one label say of a press.
struct LabelScore {
  double log_evidence_sum = nothing;     ///< log of the sum over the maps
  double best_log_likelihood = nothing;  ///< at the best pose of the best map
  std::size_t best_map = 0;
  Pose best_pose;
  std::size_t maps = 0;

  void add(std::size_t map, const PressPlacement& placement) {
    const double larger = std::max(log_evidence_sum, placement.log_evidence);
    const double smaller = std::min(log_evidence_sum, placement.log_evidence);
    log_evidence_sum = larger + std::log1p(std::exp(smaller - larger));
    if (placement.log_likelihood > best_log_likelihood) {
      best_log_likelihood = placement.log_likelihood;
      best_map = map;
      best_pose = placement.T_object_robot;
    }
    ++maps;
  }
  double log_evidence() const {
    return maps == 0 ? nothing : log_evidence_sum - std::log(static_cast<double>(maps));
  }
};

/// A model of the other folds, by whose maps presses are recognised.
class FoldTrial {
 public:
  FoldTrial(const std::vector<std::string>& labels, const FoldModel& model,
            const CrossValidationOptions& options)
      : labels_(labels), model_(model), options_(options), maps_of_(labels.size()) {
    for (std::size_t map = 0; map < model.maps.size(); ++map) {
      const std::optional<std::size_t> label = label_of(model.maps[map].map.label);
      if (label && maps_of_[*label].size() < options.maps_per_object) {
        maps_of_[*label].push_back(map);
      }
    }
    if (model.table) {
      layers_ = layers_of(model.maps, model.how.layer);
    }
    std::ranges::transform(model.maps, std::back_inserter(bodies_),
                           [](const TrainingMap& map) { return displaced_body(map.map); });
  }

  bool has_map(const std::string& label) const {
    const std::optional<std::size_t> at = label_of(label);
    return at && !maps_of_[*at].empty();
  }

  /// @param tried presses of the fold whose objects have maps
  CrossValidation run(const std::vector<Press>& tried, std::size_t fold,
                      const std::function<void(double)>& progress) const {
    CrossValidation result;
    if (tried.empty()) {
      return result;
    }
    const Unknowns asked =
        options_.bins ? unknowns_of(tried, *options_.bins, fold) : Unknowns{.presses = tried};
    const ContactModel classifier =
        model_.table ? contact_with(model_.how.contact, *model_.table, "") : model_.how.contact;
    std::vector<std::vector<TouchEvidence>> evidence;
    for (const Press& press : asked.presses) {
      evidence.push_back(evidence_of(press.touches, classifier));
    }
    const auto scores = score(evidence, progress);
    for (std::size_t i = 0; i < asked.presses.size(); ++i) {
      HeldOut& unknown = result.unknowns.emplace_back(HeldOut{.fold = fold, .log_evidence = {}});
      if (i >= tried.size()) {
        unknown.half = asked.half_of_group[i - tried.size()];
      }
      judge(asked.presses[i], evidence[i], scores[i], unknown);
    }
    if (options_.bins && model_.table) {
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

  ContactModel contact_for(std::size_t label) const {
    return model_.table ? contact_with(model_.how.contact, *model_.table, labels_[label])
                        : model_.how.contact;
  }

  /// The scores of presses, [press][label].
  std::vector<std::vector<LabelScore>> score(const std::vector<std::vector<TouchEvidence>>& presses,
                                             const std::function<void(double)>& progress) const {
    std::vector<std::vector<LabelScore>> scores(presses.size(),
                                                std::vector<LabelScore>(labels_.size()));
    Progress counter(static_cast<double>(labels_.size()), progress);
    tbb::parallel_for(std::size_t{0}, labels_.size(), [&](std::size_t label) {
      const ContactModel contact = contact_for(label);
      for (const std::size_t map : maps_of_[label]) {
        Hypothesis hypothesis{.map = model_.maps[map].map};
        if (model_.table) {
          hypothesis.layer = layers_[map];
        }
        PressPlacer placer(hypothesis, contact,
                           options_.bins ? options_.bins->lattice : model_.how.lattice);
        for (std::size_t i = 0; i < presses.size(); ++i) {
          scores[i][label].add(map, placer.place(presses[i]));
        }
      }
      counter.add();
    });
    return scores;
  }

  /// Fills in what the model says of a press, or of a group.
  void judge(const Press& press, std::span<const TouchEvidence> evidence,
             const std::vector<LabelScore>& scores, HeldOut& unknown) const {
    unknown.truth = *label_of(press.label);
    unknown.touches = evidence.size();
    std::ranges::transform(scores, std::back_inserter(unknown.log_evidence),
                           &LabelScore::log_evidence);
    unknown.log_density = log_densities(evidence.front());
    unknown.stranger_fit = stranger_fit_of(evidence, scores, unknown.truth);
    if (unknown.half == 0) {
      unknown.error_mm = pose_error_of(evidence, unknown.truth, *press.T_object_robot);
    }
    // A press of which nothing is In Contact says nothing of its object.
    if (unknown.half || !evidence.front().in_contact()) {
      return;
    }
    const auto z_at = [&](const std::optional<Pose>& T_object_robot) {
      const std::optional<Fit> fit = fit_of(evidence, scores, unknown.truth, T_object_robot);
      return fit ? std::optional(fit->z) : std::nullopt;
    };
    unknown.fit_z = z_at(press.T_object_robot);
    if (press.T_object_robot && model_.table) {
      unknown.best_fit_z = z_at({});
    }
  }

  /// See HeldOut::error_mm.
  double pose_error_of(std::span<const TouchEvidence> press, std::size_t label,
                       const Pose& T_object_robot) const {
    constexpr int steps = 3;  // to either side
    constexpr int most_rounds = 6;
    constexpr double enough = 0.6;  // of a step: a standard deviation that the steps resolve
    const std::size_t map = maps_of_[label].front();
    Hypothesis hypothesis{.map = model_.maps[map].map};
    if (model_.table) {
      hypothesis.layer = layers_[map];
    }
    const PressPlacer placer(hypothesis, contact_for(label), options_.bins->lattice);
    // The first window is wide: one that ended near the truth would draw beliefs to it.
    glm::dvec3 step{0.3 * options_.spacing_mm, 0.3 * options_.spacing_mm, 0.06};
    glm::dvec3 middle{T_object_robot.translation_mm, T_object_robot.theta_rad};
    const auto pose_at = [](const glm::dvec3& at) { return Pose{{at.x, at.y}, at.z}; };
    for (int round = 0; round < most_rounds; ++round) {
      double most = nothing;
      std::vector<std::pair<double, glm::dvec3>> about;
      for (int a = -steps; a <= steps; ++a) {
        for (int y = -steps; y <= steps; ++y) {
          for (int x = -steps; x <= steps; ++x) {
            const glm::dvec3 at = middle + step * glm::dvec3(x, y, a);
            about.emplace_back(placer.log_likelihood(press, pose_at(at)), at);
            most = std::max(most, about.back().first);
          }
        }
      }
      double sum = 0.0;
      glm::dvec3 mean{0.0};
      glm::dvec3 squares{0.0};
      for (const auto& [log_likelihood, at] : about) {
        const double weight = std::exp(log_likelihood - most);
        sum += weight;
        mean += weight * (at - middle);
        squares += weight * (at - middle) * (at - middle);
      }
      mean /= sum;
      const glm::dvec3 variance = squares / sum - mean * mean;
      middle += mean;
      bool resolved = true;
      for (int axis = 0; axis < 3; ++axis) {
        if (!(variance[axis] > enough * enough * step[axis] * step[axis])) {
          step[axis] /= 2.0;
          resolved = false;
        }
      }
      if (resolved) {
        break;
      }
    }
    return pose_error_mm(bodies_[map], 1, pose_at(middle), T_object_robot);
  }

  /// Log density of a touch's features under every label; empty without features.
  std::vector<double> log_densities(const TouchEvidence& touch) const {
    std::vector<double> densities;
    if (model_.features) {
      const PressFeatures own = features_of(touch, model_.how.contact.classifier.threshold);
      for (const std::string& label : labels_) {
        const auto known = model_.features->objects.find(label);
        const FeatureDistribution& of_label =
            known == model_.features->objects.end() ? model_.features->any : known->second;
        densities.push_back(of_label.log_density(own));
      }
    }
    return densities;
  }

  /// The labels but one that have maps.
  std::vector<std::size_t> others_of(std::size_t label,
                                     const std::vector<LabelScore>& scores) const {
    std::vector<std::size_t> others;
    for (std::size_t other = 0; other < labels_.size(); ++other) {
      if (other != label && scores[other].maps > 0) {
        others.push_back(other);
      }
    }
    return others;
  }

  const OccupancyGrid& compared(std::size_t map) const {
    return model_.table ? layers_[map] : model_.maps[map].map;
  }

  /// How a press fits the best of these objects at about the best pose.
  std::optional<Fit> best_fit(std::span<const TouchEvidence> press,
                              const std::vector<LabelScore>& scores,
                              std::span<const std::size_t> labels) const {
    const std::size_t label = *std::ranges::max_element(
        labels, {}, [&](std::size_t one) { return scores[one].best_log_likelihood; });
    const LabelScore& at = scores[label];
    return best_fit_near(press, at.best_pose, compared(at.best_map), contact_for(label), 0);
  }

  /// How a press fits its object at its pose, or where that is unknown, the best object.
  std::optional<Fit> fit_of(std::span<const TouchEvidence> press,
                            const std::vector<LabelScore>& scores, std::size_t truth,
                            const std::optional<Pose>& T_object_robot) const {
    if (T_object_robot) {
      return evidence_fit(press, *T_object_robot, compared(scores[truth].best_map),
                          contact_for(truth), {}, 0);
    }
    std::vector<std::size_t> labels = others_of(truth, scores);
    labels.insert(labels.begin(), truth);  // the best where another is as good
    return best_fit(press, scores, labels);
  }

  /// See HeldOut::stranger_fit.
  std::optional<StrangerFit> stranger_fit_of(std::span<const TouchEvidence> press,
                                             const std::vector<LabelScore>& scores,
                                             std::size_t truth) const {
    const std::vector<std::size_t> others = others_of(truth, scores);
    const auto in_contact = std::ranges::count_if(press, &TouchEvidence::in_contact);
    if (!model_.table || others.size() < 2 || in_contact == 0) {
      return {};
    }
    const std::optional<Fit> fit = best_fit(press, scores, others);
    return StrangerFit{fit.value(), static_cast<std::size_t>(in_contact)};
  }

  /// Errors of the places of presses at known poses.
  std::vector<PlaceError> errors_of(const std::vector<Press>& presses) const {
    std::vector<PlaceError> errors;
    for (std::size_t label = 0; label < labels_.size(); ++label) {
      ContactModel contact = contact_for(label);
      std::map<std::string, std::vector<TouchEvidence>> of_group;
      for (const Press& press : presses) {
        TouchEvidence touch(press.touches.front(), contact);
        touch.T_robot_sensor = press.T_object_robot.value() * touch.T_robot_sensor;
        if (press.label == labels_[label] && touch.in_contact()) {
          of_group[press.group].push_back(std::move(touch));
        }
      }
      if (of_group.empty()) {
        continue;
      }
      const std::size_t map = maps_of_[label].front();
      Hypothesis of{.map = model_.maps[map].map};
      if (model_.table) {
        of.layer = layers_[map];
      }
      contact.prior = contact.prior.value_or(of.compared().prior);
      // Touches of several groups together would hide by how much each is off.
      for (const auto& [group, touches] : of_group) {
        std::ranges::move(place_errors(touches, of, contact, 0), std::back_inserter(errors));
      }
    }
    return errors;
  }

  const std::vector<std::string>& labels_;
  const FoldModel& model_;
  const CrossValidationOptions& options_;
  std::vector<std::vector<std::size_t>> maps_of_;  ///< [label]
  std::vector<OccupancyGrid> layers_;              ///< [map] with a table
  std::vector<Body> bodies_;                       ///< [map]
};

}  // namespace

CrossValidation& CrossValidation::operator+=(const CrossValidation& fold) {
  unknowns.insert(unknowns.end(), fold.unknowns.begin(), fold.unknowns.end());
  place_errors.insert(place_errors.end(), fold.place_errors.begin(), fold.place_errors.end());
  return *this;
}

CrossValidation try_fold(std::size_t fold, const std::vector<Press>& presses,
                         const std::vector<std::string>& labels, const FoldModel& model,
                         const CrossValidationOptions& options,
                         const std::function<void(double)>& progress) {
  const FoldTrial trial(labels, model, options);
  const std::vector<std::size_t> fold_of = folds_of(presses, options.folds);
  std::vector<Press> tried;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    if (fold_of[i] == fold && trial.has_map(presses[i].label)) {
      tried.push_back(presses[i]);
    }
  }
  return trial.run(tried, fold, progress);
}

}  // namespace palpate
