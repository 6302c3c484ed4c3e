#include "learning/cross_validation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "learning/host_progress.hpp"
#include "palpate/error.hpp"
#include "recognition/nearby_fit.hpp"

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

/// A fold's presses before what the others say.
class FoldTrial {
 public:
  FoldTrial(const std::vector<Press>& presses, const std::vector<std::size_t>& fold_of,
            std::size_t fold, const std::vector<std::string>& labels, const FoldModel& model,
            const CrossValidationOptions& options)
      : presses_(presses),
        fold_of_(fold_of),
        fold_(fold),
        labels_(labels),
        model_(model),
        options_(options),
        maps_of_(labels.size()),
        classifier_(model.how.contact) {
    for (std::size_t map = 0; map < model.maps.size(); ++map) {
      const std::optional<std::size_t> label = label_of(model.maps[map].map.label);
      if (label && maps_of_[*label].size() < options.maps_per_object) {
        maps_of_[*label].push_back(map);
      }
    }
    if (model.table) {
      layers_ = layers_of(model.maps, model.how.layer);
      classifier_ = contact_with(model.how.contact, *model.table, "");
    }
  }

  void run(const std::function<void(double)>& progress, CrossValidation& result) const {
    std::vector<std::size_t> tried;
    for (std::size_t i = 0; i < presses_.size(); ++i) {
      const std::optional<std::size_t> label = label_of(presses_[i].label);
      if (fold_of_[i] == fold_ && label && !maps_of_[*label].empty()) {
        tried.push_back(i);
      }
    }
    if (tried.empty()) {
      return;
    }
    const Unknowns asked = unknowns(tried);
    const auto scores = score(asked.presses, progress);
    for (std::size_t i = 0; i < asked.presses.size(); ++i) {
      ScoredPress scored = scored_press(asked.presses[i], scores[i]);
      if (i < tried.size()) {
        add_fit(asked.presses[i], scores[i], scored, result);
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
  Unknowns unknowns(const std::vector<std::size_t>& tried) const {
    Unknowns asked;
    std::map<std::string, std::vector<const Press*>> of_label;
    for (const std::size_t press : tried) {
      asked.presses.push_back(presses_[press]);
      of_label[presses_[press].label].push_back(&presses_[press]);
    }
    if (!options_.bins) {
      return asked;
    }
    Random random(fold_, Stream::unknowns);
    std::size_t half = fold_ % 2;
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
  std::vector<std::vector<LabelScore>> score(const std::vector<Press>& asked,
                                             const std::function<void(double)>& progress) const {
    std::vector<std::vector<LabelScore>> scores(asked.size(),
                                                std::vector<LabelScore>(labels_.size()));
    HostProgress counter(labels_.size(), progress);
    tbb::parallel_for(std::size_t{0}, labels_.size(), [&](std::size_t label) {
      const ContactModel contact = contact_for(label);
      for (const std::size_t map : maps_of_[label]) {
        Hypothesis hypothesis{.map = model_.maps[map].map};
        if (model_.table) {
          hypothesis.layer = layers_[map];
        }
        PressPlacer placer(hypothesis, contact,
                           options_.bins ? options_.bins->lattice : model_.how.lattice);
        for (std::size_t i = 0; i < asked.size(); ++i) {
          scores[i][label].add(map, placer.place(asked[i]));
        }
      }
      counter.add();
    });
    return scores;
  }

  ScoredPress scored_press(const Press& press, const std::vector<LabelScore>& scores) const {
    ScoredPress scored{.truth = *label_of(press.label),
                       .fold = fold_,
                       .touches = press.touches.size(),
                       .log_evidence = {},
                       .log_density = {}};
    for (const LabelScore& score : scores) {
      scored.log_evidence.push_back(score.log_evidence());
    }
    if (model_.features) {
      const PressFeatures own =
          press_features(press.touches.front(), model_.how.contact.classifier);
      for (const std::string& label : labels_) {
        const auto known = model_.features->objects.find(label);
        const FeatureDistribution& of_label =
            known == model_.features->objects.end() ? model_.features->any : known->second;
        scored.log_density.push_back(of_label.log_density(own));
      }
    }
    return scored;
  }

  /// Adds how a press fits the best object, and what tells whether its own was learned.
  void add_fit(const Press& press, const std::vector<LabelScore>& scores, const ScoredPress& scored,
               CrossValidation& result) const {
    // A press of which nothing is In Contact says nothing of its object.
    const std::vector<TouchEvidence> touches = evidence_of(press.touches, classifier_);
    if (!touches.front().in_contact()) {
      return;
    }
    std::vector<std::size_t> others;
    std::size_t best_label = scored.truth;
    for (std::size_t label = 0; label < labels_.size(); ++label) {
      if (label != scored.truth && scores[label].maps > 0) {
        others.push_back(label);
      }
      if (scores[label].best_log_likelihood > scores[best_label].best_log_likelihood) {
        best_label = label;
      }
    }
    if (!others.empty()) {
      FamiliarityScores& familiarity = result.familiarity[fold_];
      const auto score_without = [&](std::size_t left_out) {
        double best = nothing;
        std::vector<double> log_evidence;
        for (std::size_t label = 0; label < labels_.size(); ++label) {
          if (label != left_out) {
            best = std::max(best, scores[label].best_log_likelihood);
            log_evidence.push_back(scored.log_evidence[label]);
          }
        }
        return FamiliarityScore::of(touches.front().readings, best, log_evidence);
      };
      const std::size_t turn = familiarity.known.size() % others.size();
      familiarity.known.push_back(score_without(others[turn]));
      familiarity.unknown.push_back(score_without(scored.truth));
    }
    const LabelScore& at = scores[best_label];
    const OccupancyGrid& map = model_.table ? layers_[at.best_map] : model_.maps[at.best_map].map;
    // Recognition judges the fit at a refined pose, which lies near the true one, whatever the
    // bins.
    const Pose& near =
        press.T_object_robot && best_label == scored.truth ? *press.T_object_robot : at.best_pose;
    if (const auto fit = best_fit_near(touches, near, map, contact_for(best_label), 0)) {
      result.fit_z.push_back(fit->z);
    }
  }

  const std::vector<Press>& presses_;
  const std::vector<std::size_t>& fold_of_;
  std::size_t fold_;
  const std::vector<std::string>& labels_;
  const FoldModel& model_;
  const CrossValidationOptions& options_;
  std::vector<std::vector<std::size_t>> maps_of_;  ///< [label]
  std::vector<OccupancyGrid> layers_;
  ContactModel classifier_;
};

}  // namespace

CrossValidator::CrossValidator(const std::vector<Press>& presses, std::vector<std::string> labels,
                               const CrossValidationOptions& options)
    : presses_(presses), labels_(std::move(labels)), options_(options) {
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
  fold_ = folds_of(presses, options.folds);
}

std::vector<Press> CrossValidator::presses_without(std::size_t fold) const {
  std::vector<Press> others;
  for (std::size_t i = 0; i < presses_.size(); ++i) {
    if (fold_[i] != fold) {
      others.push_back(presses_[i]);
    }
  }
  return others;
}

void CrossValidator::try_fold(std::size_t fold, const FoldModel& model, CrossValidation& result,
                              const std::function<void(double)>& progress) const {
  result.familiarity.resize(options_.folds);
  FoldTrial(presses_, fold_, fold, labels_, model, options_).run(progress, result);
}

}  // namespace palpate
