#include "cross_validation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "feature_learning.hpp"
#include "host_progress.hpp"
#include "nearby_fit.hpp"
#include "palpate/error.hpp"

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

/// The features of a press: of its first touch.
PressFeatures features_of(const Press& press, const ContactClassifier& classifier) {
  return press_features(press.touches.front(), classifier);
}

/// The presses, their maps and what was learned, as all folds share them.
class Validation {
 public:
  Validation(const std::vector<Press>& presses, const std::vector<TrainingMap>& maps,
             const TableLearning& how, const PlacedPresses* placed,
             const CrossValidationOptions& options)
      : presses_(presses),
        maps_(maps),
        how_(how),
        placed_(placed),
        options_(options),
        classifier_(how.contact) {
    fold_ = folds_of(presses, options.folds);
    std::set<std::string> labels;
    for (const TrainingMap& map : maps) {
      labels.insert(map.map.label);
    }
    labels_.assign(labels.begin(), labels.end());
    if (placed != nullptr) {
      layers_ = layers_of(maps, how.layer);
      classifier_ = contact_with(how.contact, placed->table, "");
    }
  }

  const std::vector<std::string>& labels() const { return labels_; }

  /// Adds what the presses of a fold get from the maps and presses of the others.
  /// @param counter counts labels
  void try_fold(std::size_t fold, HostProgress& counter, CrossValidation& result) const {
    const std::vector<std::vector<std::size_t>> of_label = maps_outside(fold);
    std::vector<std::size_t> tried;
    std::vector<LabelledFeatures> building;
    for (std::size_t i = 0; i < presses_.size(); ++i) {
      if (fold_[i] != fold) {
        if (!presses_[i].T_object_robot) {
          building.push_back(
              {presses_[i].label, features_of(presses_[i], how_.contact.classifier)});
        }
      } else if (const auto label = label_of(presses_[i]); label && !of_label[*label].empty()) {
        tried.push_back(i);
      }
    }
    if (tried.empty()) {
      return;
    }
    const std::optional<LearnedTable> table = table_without(fold);
    const Unknowns asked = unknowns(tried, fold);
    const auto scores = score(asked.presses, of_label, table, counter);
    const LearnedFeatures features =
        building.empty() ? LearnedFeatures{} : learn_features(building);
    for (std::size_t i = 0; i < asked.presses.size(); ++i) {
      ScoredPress scored = scored_press(asked.presses[i], scores[i], features);
      if (i < tried.size()) {
        add_known(asked.presses[i], scores[i], scored, table, result);
        result.presses.push_back(std::move(scored));
      } else {
        result.groups[asked.half_of_group[i - tried.size()]].push_back(std::move(scored));
      }
    }
  }

 private:
  /// What is to be recognised of a fold.
  struct Unknowns {
    std::vector<Press> presses;  ///< of the fold, and then groups of them
    std::vector<std::size_t> half_of_group = {};
  };
  Unknowns unknowns(const std::vector<std::size_t>& tried, std::size_t fold) const {
    Unknowns asked;
    std::map<std::string, std::vector<const Press*>> of_label;
    for (const std::size_t press : tried) {
      asked.presses.push_back(presses_[press]);
      of_label[presses_[press].label].push_back(&presses_[press]);
    }
    if (!options_.bins) {
      return asked;
    }
    Random random(fold, Stream::unknowns);
    std::size_t half = fold % 2;
    for (auto& [label, own] : of_label) {
      // Too few for two halves are all of one.
      shuffle(own, random);
      const bool divided = own.size() >= 2 * presses_in_group;
      const std::size_t middle = divided ? own.size() / 2 : own.size();
      add_groups(std::span(own).first(middle), half, random, asked);
      half = 1 - half;
      add_groups(std::span(own).subspan(middle), half, random, asked);
    }
    for (Press& press : asked.presses) {
      press = as_unknown(press, *options_.bins, random);
    }
    return asked;
  }

  static void shuffle(std::span<const Press*> presses, Random& random) {
    for (std::size_t i = presses.size(); i > 1; --i) {
      const auto place = static_cast<std::size_t>(random.uniform() * static_cast<double>(i));
      std::swap(presses[i - 1], presses[place]);
    }
  }

  static void add_groups(std::span<const Press*> presses, std::size_t half, Random& random,
                         Unknowns& asked) {
    const std::size_t times = presses.size() < 2 * presses_in_group ? 1 : groups_of_press;
    for (std::size_t time = 0; time < times; ++time) {
      shuffle(presses, random);
      for (std::size_t i = 0; i + presses_in_group <= presses.size(); i += presses_in_group) {
        asked.presses.push_back(together(presses.subspan(i, presses_in_group)));
        asked.half_of_group.push_back(half);
      }
    }
  }

  /// The press's label by index; none where no map bears it.
  std::optional<std::size_t> label_of(const Press& press) const {
    const auto at = std::ranges::lower_bound(labels_, press.label);
    if (at == labels_.end() || *at != press.label) {
      return {};
    }
    return static_cast<std::size_t>(at - labels_.begin());
  }

  /// The maps that hold no press of a fold, [label].
  std::vector<std::vector<std::size_t>> maps_outside(std::size_t fold) const {
    std::vector<std::vector<std::size_t>> of_label(labels_.size());
    for (std::size_t map = 0; map < maps_.size(); ++map) {
      const auto label = static_cast<std::size_t>(
          std::ranges::lower_bound(labels_, maps_[map].map.label) - labels_.begin());
      const bool outside = std::ranges::none_of(
          maps_[map].presses, [&](std::size_t press) { return fold_[press] == fold; });
      if (outside && of_label[label].size() < options_.maps_per_object) {
        of_label[label].push_back(map);
      }
    }
    return of_label;
  }

  /// What the presses of the other folds say about readings; none by Eq. 7.
  std::optional<LearnedTable> table_without(std::size_t fold) const {
    if (placed_ == nullptr) {
      return {};
    }
    std::vector<bool> outside;
    for (const std::size_t own : fold_) {
      outside.push_back(own != fold);
    }
    return table_of(count_placed(placed_->placements, presses_, maps_, layers_, how_, outside),
                    how_);
  }

  ContactModel contact_for(std::size_t label, const std::optional<LearnedTable>& table) const {
    return table ? contact_with(how_.contact, *table, labels_[label]) : how_.contact;
  }

  /// The scores of presses, [press][label].
  std::vector<std::vector<LabelScore>> score(const std::vector<Press>& asked,
                                             const std::vector<std::vector<std::size_t>>& of_label,
                                             const std::optional<LearnedTable>& table,
                                             HostProgress& counter) const {
    std::vector<std::vector<LabelScore>> scores(asked.size(),
                                                std::vector<LabelScore>(labels_.size()));
    tbb::parallel_for(std::size_t{0}, labels_.size(), [&](std::size_t label) {
      const ContactModel contact = contact_for(label, table);
      for (const std::size_t map : of_label[label]) {
        Hypothesis hypothesis{.map = maps_[map].map};
        if (table) {
          hypothesis.layer = layers_[map];
        }
        PressPlacer placer(hypothesis, contact,
                           options_.bins ? options_.bins->lattice : how_.lattice);
        for (std::size_t i = 0; i < asked.size(); ++i) {
          scores[i][label].add(map, placer.place(asked[i]));
        }
      }
      counter.add();
    });
    return scores;
  }

  ScoredPress scored_press(const Press& press, const std::vector<LabelScore>& scores,
                           const LearnedFeatures& features) const {
    ScoredPress scored{.truth = *label_of(press),
                       .touches = press.touches.size(),
                       .log_evidence = {},
                       .log_density = {}};
    for (const LabelScore& score : scores) {
      scored.log_evidence.push_back(score.log_evidence());
    }
    // A touch at a known pose shows a part of an object: its features tell where that is.
    if (!press.T_object_robot) {
      const PressFeatures own = features_of(press, how_.contact.classifier);
      for (const std::string& label : labels_) {
        const auto known = features.objects.find(label);
        scored.log_density.push_back(
            (known == features.objects.end() ? features.any : known->second).log_density(own));
      }
    }
    return scored;
  }

  /// Adds how a press fits the best object, and the best that is not its own.
  void add_known(const Press& press, const std::vector<LabelScore>& scores,
                 const ScoredPress& scored, const std::optional<LearnedTable>& table,
                 CrossValidation& result) const {
    std::vector<double> of_others;
    std::size_t best_label = 0;
    double best = nothing;
    double best_other = nothing;
    for (std::size_t label = 0; label < labels_.size(); ++label) {
      if (scores[label].best_log_likelihood > best) {
        best = scores[label].best_log_likelihood;
        best_label = label;
      }
      if (label != scored.truth) {
        of_others.push_back(scored.log_evidence[label]);
        best_other = std::max(best_other, scores[label].best_log_likelihood);
      }
    }
    // A press of which nothing is In Contact says nothing of its object.
    const std::vector<Reading> readings = classifier_.classify(press.touches.front());
    if (std::ranges::none_of(readings, is_contact)) {
      return;
    }
    // With two labels, leaving one out leaves no lead to compare with.
    const std::span<const double> known(scored.log_evidence);
    const bool leads = labels_.size() > 2;
    result.known.push_back(FamiliarityScore::of(readings, best, leads ? known : known.first(1)));
    if (best_other != nothing) {
      result.unknown.push_back(FamiliarityScore::of(readings, best_other, of_others));
    }
    const LabelScore& at = scores[best_label];
    const OccupancyGrid& map = table ? layers_[at.best_map] : maps_[at.best_map].map;
    // Recognition judges the fit at a refined pose, which lies near the true one, whatever the
    // bins.
    const Pose& near =
        press.T_object_robot && best_label == scored.truth ? *press.T_object_robot : at.best_pose;
    if (const auto fit =
            best_fit_near(press.touches, near, map, contact_for(best_label, table), 0)) {
      result.fit_z.push_back(fit->z);
    }
  }

  const std::vector<Press>& presses_;
  const std::vector<TrainingMap>& maps_;
  const TableLearning& how_;
  const PlacedPresses* placed_;
  const CrossValidationOptions& options_;
  std::vector<std::size_t> fold_;
  std::vector<std::string> labels_;
  std::vector<OccupancyGrid> layers_;
  ContactModel classifier_;
};

}  // namespace

CrossValidation cross_validate(const std::vector<Press>& presses,
                               const std::vector<TrainingMap>& maps, const TableLearning& how,
                               const PlacedPresses* placed, const CrossValidationOptions& options,
                               const std::function<void(double)>& progress) {
  if (options.folds < 2 || options.maps_per_object < 1) {
    throw Error(Fault::input,
                fmt::format("cross-validation: {} folds and {} maps per object; give at least two "
                            "folds and a map",
                            options.folds, options.maps_per_object));
  }
  if (options.bins && std::ranges::any_of(presses, [](const Press& press) {
        return !press.T_object_robot.has_value();
      })) {
    throw Error(
        Fault::input,
        "cross-validation: bins are for presses at known poses; leave them out, or give the "
        "poses");
  }
  const Validation validation(presses, maps, how, placed, options);
  CrossValidation result;
  result.labels = validation.labels();
  HostProgress counter(options.folds * result.labels.size(), progress);
  for (std::size_t fold = 0; fold < options.folds; ++fold) {
    validation.try_fold(fold, counter, result);
  }
  if (result.presses.empty()) {
    throw Error(Fault::input,
                "cross-validation: no touch has a map of its object that was built without it; "
                "give more touches");
  }
  return result;
}

}  // namespace palpate
