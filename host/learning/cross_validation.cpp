#include "cross_validation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "feature_learning.hpp"
#include "host_progress.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

constexpr double nothing = -std::numeric_limits<double>::infinity();

/// What the maps of one label say of a press.
struct LabelScore {
  double log_evidence_sum = nothing;     ///< log of the sum over the maps
  double best_log_likelihood = nothing;  ///< at the best pose of the best map
  std::size_t maps = 0;

  void add(const PressPlacement& placement) {
    const double larger = std::max(log_evidence_sum, placement.log_evidence);
    const double smaller = std::min(log_evidence_sum, placement.log_evidence);
    log_evidence_sum = larger + std::log1p(std::exp(smaller - larger));
    best_log_likelihood = std::max(best_log_likelihood, placement.log_likelihood);
    ++maps;
  }
  double log_evidence() const {
    return maps == 0 ? nothing : log_evidence_sum - std::log(static_cast<double>(maps));
  }
};

std::size_t known_elements(const Press& press, const ContactClassifier& classifier) {
  std::size_t known = 0;
  for (const Touch& touch : press.touches) {
    known += known_readings(touch, classifier).size();
  }
  return known;
}

/// The features of a press: of its first touch.
PressFeatures features_of(const Press& press, const ContactClassifier& classifier) {
  return press_features(press.touches.front(), classifier);
}

/// Presses by object and fold.
class Folds {
 public:
  Folds(const std::vector<Press>& presses, std::size_t folds) : fold_(presses.size()) {
    for (std::size_t i = 0; i < presses.size(); ++i) {
      std::vector<std::size_t>& own = of_label_[presses[i].label];
      fold_[i] = own.size() % folds;
      own.push_back(i);
    }
  }

  const std::map<std::string, std::vector<std::size_t>>& of_label() const { return of_label_; }
  std::size_t fold(std::size_t press) const { return fold_[press]; }
  /// Whether a press is of an object with another press, of another fold.
  bool tried(const Press& press) const { return of_label_.at(press.label).size() > 1; }
  std::vector<bool> outside(std::size_t fold) const {
    std::vector<bool> marks;
    for (const std::size_t own : fold_) {
      marks.push_back(own != fold);
    }
    return marks;
  }

 private:
  std::map<std::string, std::vector<std::size_t>> of_label_;
  std::vector<std::size_t> fold_;
};

void require_sound(const Folds& folds, const CrossValidationOptions& options) {
  if (options.folds < 2 || options.maps_per_object < 1) {
    throw Error(Fault::input,
                fmt::format("cross-validation: {} folds and {} maps per object; give at least two "
                            "folds and a map",
                            options.folds, options.maps_per_object));
  }
  if (std::ranges::none_of(folds.of_label(),
                           [](const auto& object) { return object.second.size() > 1; })) {
    throw Error(Fault::input, "cross-validation: no object has two presses; give more presses");
  }
}

}  // namespace

CrossValidation cross_validate(const std::vector<Press>& presses,
                               const std::vector<OccupancyGrid>& maps, const TableLearning& how,
                               const PlacedPresses* placed, const CrossValidationOptions& options,
                               const std::function<void(double)>& progress) {
  const Folds folds(presses, options.folds);
  require_sound(folds, options);
  std::vector<OccupancyGrid> layers(placed == nullptr ? 0 : maps.size());
  tbb::parallel_for(std::size_t{0}, layers.size(),
                    [&](std::size_t i) { layers[i] = reading_layer(maps[i], how.layer); });
  CrossValidation result;
  for (const auto& [label, own] : folds.of_label()) {
    result.labels.push_back(label);
  }
  const std::size_t label_count = result.labels.size();
  HostProgress counter(options.folds * label_count, progress);
  for (std::size_t fold = 0; fold < options.folds; ++fold) {
    const std::vector<bool> outside = folds.outside(fold);
    std::vector<std::size_t> tried;
    std::vector<LabelledFeatures> building;
    for (std::size_t i = 0; i < presses.size(); ++i) {
      if (outside[i]) {
        building.push_back({presses[i].label, features_of(presses[i], how.contact.classifier)});
      } else if (folds.tried(presses[i])) {
        tried.push_back(i);
      }
    }
    if (tried.empty()) {
      continue;
    }
    std::optional<LearnedTable> table;
    if (placed != nullptr) {
      table = table_of(count_placed(placed->placements, presses, layers, how, outside), how);
    }
    const LearnedFeatures features = learn_features(building);
    std::vector<std::vector<LabelScore>> scores(tried.size(), std::vector<LabelScore>(label_count));
    tbb::parallel_for(std::size_t{0}, label_count, [&](std::size_t label) {
      const ContactModel contact =
          table ? contact_with(how.contact, *table, result.labels[label]) : how.contact;
      std::size_t used = 0;
      for (const std::size_t map : folds.of_label().at(result.labels[label])) {
        if (!outside[map] || used == options.maps_per_object) {
          continue;
        }
        ++used;
        Hypothesis hypothesis{.map = maps[map]};
        if (table) {
          hypothesis.layer = layers[map];
        }
        PressPlacer placer(hypothesis, contact, how.lattice);
        for (std::size_t i = 0; i < tried.size(); ++i) {
          scores[i][label].add(placer.place(presses[tried[i]]));
        }
      }
      counter.add();
    });
    for (std::size_t i = 0; i < tried.size(); ++i) {
      const Press& press = presses[tried[i]];
      const double elements = static_cast<double>(known_elements(press, how.contact.classifier));
      const PressFeatures own = features_of(press, how.contact.classifier);
      ScoredPress scored;
      double best = nothing;
      double best_other = nothing;
      for (std::size_t label = 0; label < label_count; ++label) {
        const bool truth = result.labels[label] == press.label;
        scored.truth = truth ? label : scored.truth;
        scored.log_evidence.push_back(scores[i][label].log_evidence());
        const auto known = features.objects.find(result.labels[label]);
        scored.log_density.push_back(
            (known == features.objects.end() ? features.any : known->second).log_density(own));
        best = std::max(best, scores[i][label].best_log_likelihood);
        best_other =
            truth ? best_other : std::max(best_other, scores[i][label].best_log_likelihood);
      }
      result.presses.push_back(std::move(scored));
      result.known.push_back(best / elements);
      if (best_other != nothing) {
        result.unknown.push_back(best_other / elements);
      }
    }
  }
  return result;
}

}  // namespace palpate
