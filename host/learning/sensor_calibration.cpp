#include "learning/sensor_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "io/element_spacing.hpp"
#include "learning/contact_learning.hpp"
#include "learning/cross_validation.hpp"
#include "learning/feature_learning.hpp"
#include "learning/press_checks.hpp"
#include "learning/reading_learning.hpp"
#include "learning/tried_bins.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

/// How long learning a table takes, in cross-validations.
constexpr double table_cost = 4.0 / 3.0;
/// To try touches at known poses, of one core; and on bins that are given.
constexpr double minutes = 0.25;
constexpr double minutes_at_bins = 1.0;

/// The losses of presses with their labels' log probabilities, in nats.
std::vector<double> losses_of(const std::vector<ScoredPress>& presses) {
  std::vector<double> of_each;
  for (const ScoredPress& press : presses) {
    of_each.push_back(-press.log_evidence[press.truth]);
  }
  return of_each;
}

/// A calibration in the making.
class SensorLearning {
 public:
  SensorLearning(const std::vector<Press>& presses, const SensorCalibrationOptions& options)
      : all_{.presses = presses}, options_(options) {
    for (const TableKind& kind : options.tables) {
      if (kind.levels < 2 || kind.levels > most_reading_levels) {
        throw Error(Fault::input,
                    fmt::format("levels = {}: give 2 to {}", kind.levels, most_reading_levels));
      }
    }
    if (options.folds < 2) {
      throw Error(Fault::input, fmt::format("folds = {}: give at least 2", options.folds));
    }
    require_poses_of_one_kind(presses);
    known_poses_ = std::ranges::all_of(
        presses, [](const Press& press) { return press.T_object_robot.has_value(); });
    tables_ = options.tables.empty() ? default_tables(known_poses_) : options.tables;
    for (const Press& press : presses) {
      if (const auto spacing = spacing_of(press.touches.front().elements_mm)) {
        spacing_mm_ = std::max(spacing_mm_, spacing->nearest_mm.most);
      }
    }
    if (!(spacing_mm_ > 0.0)) {
      throw Error(Fault::input, "the arrays have one element each; a calibration needs several");
    }
    result_.sensor.pressure_unit = options.pressure_unit;
    learning_.readings = {.pressure_unit = options.pressure_unit,
                          .threshold = options.threshold,
                          .ratio = options.ratio,
                          .spacing_mm = spacing_mm_};
    learning_.folds = options.folds;
  }

  SensorCalibration run(const std::vector<OccupancyGrid>& given,
                        const std::function<void(double)>& progress) {
    for (const OccupancyGrid& map : given) {
      learning_.given.push_back({map});
    }
    learn_readings();
    if (known_poses_) {
      settle_bins();
    }
    all_.maps = maps_to_learn_on(all_, learning_);
    warn_of_objects_without_maps();
    std::set<std::string> labels;
    for (const TrainingMap& map : all_.maps) {
      labels.insert(map.map.label);
    }
    result_.objects = labels.size();
    if (labels.size() < 2) {
      const TableLearning how = table_learning(tables_.back(), all_, learning_);
      const PlacedPresses placed = learn_table(all_.presses, all_.maps, how, progress);
      result_.sensor.table = placed.table;
      learn_gamma(placed, how);
      result_.warnings.emplace_back(
          "touches of one object say nothing about confidence: the temperature stays 1, and "
          "neither features nor familiarity are learned; give touches of two objects or more");
      return std::move(result_);
    }
    if (known_poses_) {
      settle_tried_bins();
    }
    const auto tables = static_cast<double>(tables_.size());
    const auto folds = static_cast<double>(options_.folds);
    // In cross-validations: the tables of all presses, those of the folds, and the trials.
    const double all = tables * table_cost + folds * tables * table_cost + tables + 1.0;
    double done = 0.0;
    const Part part = [&](double cost) {
      const double begin = std::exchange(done, done + cost);
      return [&progress, begin, cost, all](double fraction) {
        if (progress) {
          progress((begin + cost * fraction) / all);
        }
      };
    };
    std::vector<TriedModel> tried;
    for (const TableKind& kind : tables_) {
      TriedModel& one = tried.emplace_back();
      one.how = table_learning(kind, all_, learning_);
      one.placed = learn_table(all_.presses, all_.maps, one.how, part(table_cost));
    }
    const CrossValidation eq7 = cross_validate({labels.begin(), labels.end()}, tried, part);
    for (std::size_t i = 0; i < tried.size(); ++i) {
      TriedModel& one = tried[i];
      one.after = tempered_by_folds(one.validation.presses, one.validation.groups);
      result_.tried.push_back({tables_[i], scores_of(one.after.presses, 1.0).log_loss});
    }
    const TriedModel& best = kept(tried);
    result_.sensor.table = best.placed.table;
    learn_gamma(best.placed, best.how);
    judge(eq7, tried);
    learn_confidence(best.validation);
    return std::move(result_);
  }

 private:
  /// A table, and what it says of presses that it has not seen.
  struct TriedModel {
    TableLearning how;
    PlacedPresses placed;
    CrossValidation validation;
    TemperedPresses after;  ///< with temperature and features
  };
  /// Shows the progress of the next part, of a given cost.
  using Part = std::function<std::function<void(double)>(double cost)>;

  void learn_readings() {
    all_.readings = palpate::learn_readings(all_.presses, learning_.readings);
    const LearnedReadings& readings = all_.readings;
    LearnedSensor& sensor = result_.sensor;
    sensor.classifier = readings.classifier;
    sensor.noise = readings.noise;
    sensor.prior = readings.prior;
    sensor.psf_mm = readings.psf_mm;
    sensor.spread_mm = readings.spread_mm;
    result_.maps = readings.maps(spacing_mm_);
    result_.warnings = leave_out_unknown(all_.presses, sensor.classifier);
    std::ranges::copy(stuck_elements(all_.presses, sensor.classifier),
                      std::back_inserter(result_.warnings));
    if (known_poses_ && !sensor.psf_mm) {
      result_.warnings.emplace_back(
          "the touches do not tell the point spread: too few of an object, or no edges; the "
          "maps' spread is 0.6 element spacings");
    }
  }

  /// Tries every fold's presses on what the others say, by each of the tables; returns what Eq. 7
  /// says.
  CrossValidation cross_validate(const std::vector<std::string>& labels,
                                 std::vector<TriedModel>& tried, const Part& part) const {
    const CrossValidator validator(
        all_.presses, labels,
        {.folds = options_.folds, .maps_per_object = options_.most_maps, .bins = bins_});
    const double share = 1.0 / static_cast<double>(options_.folds);
    CrossValidation eq7;
    for (std::size_t fold = 0; fold < options_.folds; ++fold) {
      std::optional<FoldLearning> learning;
      try {
        learning.emplace(validator.presses_without(fold), learning_);
      } catch (const Error&) {
        continue;  // these few presses tell no threshold: nothing can be tried on them
      }
      for (std::size_t i = 0; i < tried.size(); ++i) {
        const FoldModel& model = learning->learn(tables_[i], part(table_cost));
        validator.try_fold(fold, model, tried[i].validation, part(share));
      }
      validator.try_fold(fold, learning->by_eq7(), eq7, part(share));
    }
    return eq7;
  }

  /// The first table, unless a later one is clearly better about presses, without those of a fold.
  static const TriedModel& kept(const std::vector<TriedModel>& tried,
                                std::optional<std::size_t> without = {}) {
    const auto losses = [&](const TriedModel& one) {
      std::vector<ScoredPress> some = one.after.presses;
      std::erase_if(some, [&](const ScoredPress& press) { return press.fold == without; });
      return losses_of(some);
    };
    const TriedModel* best = &tried.front();
    for (const TriedModel& one : tried) {
      best = is_clearly_less(losses(one), losses(*best)) ? &one : best;
    }
    return *best;
  }

  void warn_of_objects_without_maps() {
    std::set<std::string> compared;
    std::set<std::string> labels;
    for (std::size_t i = 0; i < all_.presses.size(); ++i) {
      const std::string& label = all_.presses[i].label;
      labels.insert(label);
      if (has_map_without(i, label, all_.maps)) {
        compared.insert(label);
      }
    }
    for (const std::string& label : labels) {
      if (!compared.contains(label)) {
        result_.warnings.push_back(
            fmt::format("'{}': no touch has a map of the object that it is no part of, so that "
                        "nothing is learned of its readings; give it two touches or a map",
                        label));
      }
    }
  }

  /// The bins for which touches at known poses are learned.
  void settle_bins() {
    bins_ = options_.bins.value_or(RecognitionBins{fine_lattice(all_.presses, spacing_mm_)});
    const PoseLattice& lattice = bins_->lattice;
    lattice.validate();
    if (bins_->auto_pivot) {
      require_within(all_.presses, lattice);
    }
    result_.sensor.bins = learning_.bins =
        BinSteps{lattice.x_mm.step(), lattice.y_mm.step(), lattice.theta_rad.step()};
  }

  /// Leaves no more of these bins than touches are tried on in a short time.
  void settle_tried_bins() {
    // Among the maps of folds, a touch is tried on the one that was built without it.
    std::map<std::string, std::size_t> maps_of;
    for (const TrainingMap& map : all_.maps) {
      std::size_t& count = maps_of[map.map.label];
      count = map.presses.empty() ? std::min(count + 1, options_.most_maps) : 1;
    }
    std::size_t maps = 0;
    for (const auto& [label, count] : maps_of) {
      maps += count;
    }
    bins_->lattice = affordable_lattice(bins_->lattice, all_.presses, result_.sensor.classifier,
                                        {.maps = maps,
                                         .spacing_mm = spacing_mm_,
                                         .minutes = options_.bins ? minutes_at_bins : minutes});
  }

  /// Counts the placed presses over log odds.
  void learn_gamma(const PlacedPresses& placed, const TableLearning& table) {
    TableLearning how = table;
    how.layer = {.near_mm = table.layer.near_mm, .far_mm = table.layer.far_mm};
    how.level_edges.clear();
    how.counted_within = {};  // gamma is of the sensor, whatever the bins
    LevelCounts all(2);
    for (const auto& [label, counts] :
         count_placed(placed.placements, all_.presses, layers_of(all_.maps, how.layer), how)) {
      all += counts;
    }
    result_.sensor.gamma = fit_gamma(all, result_.sensor.prior);
  }

  /// How right the cross-validation is, each fold's presses by the table that the others keep.
  void judge(const CrossValidation& eq7, const std::vector<TriedModel>& tried) {
    CrossValidation table;
    TemperedPresses after;
    std::vector<double> areas;
    for (std::size_t fold = 0; fold < options_.folds; ++fold) {
      const TriedModel& model = kept(tried, fold);
      const auto append = [&](const std::vector<ScoredPress>& from, std::vector<ScoredPress>& to) {
        std::ranges::copy_if(from, std::back_inserter(to),
                             [&](const ScoredPress& press) { return press.fold == fold; });
      };
      append(model.validation.presses, table.presses);
      append(both(model.validation.groups), table.groups[0]);
      append(model.after.presses, after.presses);
      append(model.after.groups, after.groups);
      if (const auto area = area_under_curve(model.validation.familiarity, fold)) {
        areas.push_back(*area);
      }
    }
    result_.before = scores_of(eq7.presses, 1.0);
    result_.table = scores_of(table.presses, 1.0);
    result_.after = scores_of(after.presses, 1.0);
    if (!areas.empty()) {
      result_.area_under_curve =
          std::accumulate(areas.begin(), areas.end(), 0.0) / static_cast<double>(areas.size());
    }
    if (!after.groups.empty()) {
      result_.groups = GroupScores{.touches = presses_in_group,
                                   .before = scores_of(both(eq7.groups), 1.0),
                                   .table = scores_of(both(table.groups), 1.0),
                                   .after = scores_of(after.groups, 1.0)};
    } else if (known_poses_) {
      result_.warnings.push_back(
          fmt::format("too few touches to try {} of an object together on maps without them, so "
                      "that how sure to be after several touches is not learned; give {} or more "
                      "of each object",
                      presses_in_group, presses_in_group * options_.folds));
    }
    const std::vector<ScoredPress> without = tempered_by_folds(eq7.presses).presses;
    // What few presses could show by chance is no warning.
    if (is_clearly_less(losses_of(without), losses_of(after.presses))) {
      result_.warnings.push_back(fmt::format(
          "on touches that it has not seen, the learned table has a log-loss of {:.3f}, worse than "
          "{:.3f} by Eq. 7 with a temperature: give more touches of each object, or recognize "
          "without the sensor model",
          result_.after->log_loss, scores_of(without, 1.0).log_loss));
    }
  }

  void learn_confidence(const CrossValidation& learned) {
    const TemperatureFit fit = fit_temperature(learned.presses, learned.groups);
    result_.sensor.temperature = fit.temperature;
    result_.sensor.temperature_growth = fit.growth;
    if (!known_poses_) {
      result_.sensor.features = learn_features(all_.presses, result_.sensor.classifier);
      result_.sensor.features->weight = fit.feature_weight;
    }
    learn_fit_scale(learned.fit_z);
    const FamiliarityScores scores = all_of(learned.familiarity);
    if (!scores.known.empty()) {
      result_.sensor.familiarity = fit_familiarity(scores);
    }
  }

  /// Mean and standard deviation of the touches' z.
  void learn_fit_scale(const std::vector<double>& z) {
    if (z.size() < 2) {
      return;
    }
    const auto n = static_cast<double>(z.size());
    FitScale scale{.mean = 0.0, .sd = 0.0};
    for (const double one : z) {
      scale.mean += one / n;
    }
    for (const double one : z) {
      scale.sd += (one - scale.mean) * (one - scale.mean) / (n - 1.0);
    }
    scale.sd = std::sqrt(scale.sd);
    if (scale.sd > 0.0) {
      result_.sensor.fit_scale = scale;
    }
  }

  LearnedPresses all_;
  const SensorCalibrationOptions& options_;
  bool known_poses_ = false;
  std::vector<TableKind> tables_;
  double spacing_mm_ = 0.0;
  ModelLearning learning_;               ///< but for the presses
  std::optional<RecognitionBins> bins_;  ///< for touches at known poses
  SensorCalibration result_;
};

}  // namespace

std::vector<TableKind> default_tables(bool known_poses) {
  constexpr TableKind of_contact{MapLayer::log_odds, 2};
  constexpr TableKind of_pressure{MapLayer::mean_level, 7};
  return known_poses ? std::vector{of_pressure} : std::vector{of_contact, of_pressure};
}

SensorCalibration calibrate_sensor(const std::vector<Press>& presses,
                                   const std::vector<OccupancyGrid>& given,
                                   const SensorCalibrationOptions& options,
                                   const std::function<void(double)>& progress) {
  if (presses.empty()) {
    throw Error(Fault::input, "no touches; give recordings with touches");
  }
  return SensorLearning(presses, options).run(given, progress);
}

}  // namespace palpate
