#include "sensor_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "contact_learning.hpp"
#include "cross_validation.hpp"
#include "element_spacing.hpp"
#include "feature_learning.hpp"
#include "palpate/error.hpp"
#include "point_spread.hpp"
#include "press_checks.hpp"
#include "tried_bins.hpp"

namespace palpate {

namespace {

/// How long learning a table takes, in cross-validations.
constexpr double table_cost = 4.0 / 3.0;
/// To try touches at known poses, of one core; and on bins that are given.
constexpr double minutes = 0.25;
constexpr double minutes_at_bins = 1.0;

/// A calibration in the making.
class SensorLearning {
 public:
  SensorLearning(const std::vector<Press>& presses, const SensorCalibrationOptions& options)
      : presses_(presses), options_(options) {
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
  }

  SensorCalibration run(const std::vector<OccupancyGrid>& given,
                        const std::function<void(double)>& progress) {
    learn_readings();
    make_maps(given);
    if (known_poses_) {
      settle_bins();
    }
    std::set<std::string> labels;
    for (const TrainingMap& map : maps_) {
      labels.insert(map.map.label);
    }
    result_.objects = labels.size();
    if (labels.size() < 2) {
      const TableLearning how = table_learning(tables_.back());
      const PlacedPresses placed = learn_table(presses_, maps_, how, progress);
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
    const double tables = static_cast<double>(tables_.size());
    const double all = 1.0 + tables * (table_cost + 1.0);
    double done = 0.0;
    const auto part = [&](double cost) {
      const double begin = std::exchange(done, done + cost);
      return [&progress, begin, cost, all](double fraction) {
        if (progress) {
          progress((begin + cost * fraction) / all);
        }
      };
    };
    std::optional<LearnedFromTable> best;
    for (const TableKind& kind : tables_) {
      const TableLearning how = table_learning(kind);
      LearnedFromTable one{.how = how,
                           .placed = learn_table(presses_, maps_, how, part(table_cost)),
                           .validation = {},
                           .after = {},
                           .losses = {}};
      one.validation = cross_validate(presses_, maps_, how, &one.placed, validation(), part(1.0));
      one.after = tempered_by_halves(one.validation.presses, one.validation.groups);
      for (const ScoredPress& press : one.after.presses) {
        one.losses.push_back(-press.log_evidence[press.truth]);
      }
      result_.tried.push_back({kind, scores_of(one.after.presses, 1.0).log_loss});
      if (!best || is_clearly_less(one.losses, best->losses)) {
        best = std::move(one);
      }
    }
    result_.sensor.table = best->placed.table;
    learn_gamma(best->placed, best->how);
    const CrossValidation eq7 =
        cross_validate(presses_, maps_, best->how, nullptr, validation(), part(1.0));
    learn_confidence(eq7, *best);
    return std::move(result_);
  }

 private:
  /// What a table says of presses that it has not seen.
  struct LearnedFromTable {
    TableLearning how;
    PlacedPresses placed;
    CrossValidation validation;
    TemperedPresses after;       ///< with temperature and features
    std::vector<double> losses;  ///< the same, of each press, in nats
  };

  CrossValidationOptions validation() const {
    return {.folds = options_.folds, .maps_per_object = options_.most_maps, .bins = bins_};
  }

  void learn_readings() {
    LearnedSensor& sensor = result_.sensor;
    if (options_.threshold && options_.ratio) {
      sensor.classifier = {.threshold = *options_.threshold, .ratio = *options_.ratio};
    } else {
      sensor.classifier = learn_classifier(presses_, options_.threshold);
      sensor.classifier.ratio = options_.ratio.value_or(sensor.classifier.ratio);
    }
    sensor.noise = noise_floor(presses_, sensor.classifier);
    // Noise alone is to make no contact.
    constexpr double noise_sd = 3.0;
    if (!options_.threshold) {
      sensor.classifier.threshold = std::max(sensor.classifier.threshold, noise_sd * sensor.noise);
    }
    sensor.classifier.validate();
    if (contact_pressures(presses_, sensor.classifier).empty()) {
      throw Error(Fault::input,
                  fmt::format("no pressure is above the contact threshold, {:g} {}; give a lower "
                              "--threshold",
                              sensor.classifier.threshold, options_.pressure_unit));
    }
    result_.warnings = leave_out_unknown(presses_, sensor.classifier);
    std::ranges::copy(stuck_elements(presses_, sensor.classifier),
                      std::back_inserter(result_.warnings));
    std::vector<Touch> touches;
    for (const Press& press : presses_) {
      touches.insert(touches.end(), press.touches.begin(), press.touches.end());
    }
    sensor.prior = share_in_contact(touches, sensor.classifier);
    // As for maps of presses at unknown poses: leaves no gaps between the elements of a press.
    constexpr double of_spacing = 0.6;
    sensor.spread_mm = of_spacing * spacing_mm_;
    if (known_poses_) {
      sensor.psf_mm = learn_point_spread(presses_, sensor.classifier);
      if (sensor.psf_mm) {
        sensor.spread_mm = *sensor.psf_mm / 2.0;
      } else {
        result_.warnings.emplace_back(
            "the touches do not tell the point spread: too few of an object, or no edges; the "
            "maps' spread is 0.6 element spacings");
      }
    }
  }

  void make_maps(const std::vector<OccupancyGrid>& given) {
    result_.maps = {
        .cell_mm = 0.5 * spacing_mm_,
        .sensor = {.spread_mm = result_.sensor.spread_mm, .prior = result_.sensor.prior},
        .classifier = result_.sensor.classifier};
    if (!given.empty()) {
      for (const OccupancyGrid& map : given) {
        maps_.push_back({map});
      }
    } else if (known_poses_) {
      maps_ = maps_without_folds(presses_, result_.maps, options_.folds);
    } else {
      maps_ = maps_of_presses(presses_, result_.maps);
    }
    warn_of_objects_without_maps();
  }

  void warn_of_objects_without_maps() {
    std::set<std::string> compared;
    std::set<std::string> labels;
    for (std::size_t i = 0; i < presses_.size(); ++i) {
      labels.insert(presses_[i].label);
      if (std::ranges::any_of(maps_, [&](const TrainingMap& map) {
            return map.map.label == presses_[i].label && !map.holds(i);
          })) {
        compared.insert(presses_[i].label);
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

  TableLearning table_learning(const TableKind& kind) const {
    constexpr double near = 2.0;  // in spacings of the elements
    constexpr double far = 6.0;
    const std::vector<double> pressures = contact_pressures(presses_, result_.sensor.classifier);
    TableLearning how;
    if (kind.layer == MapLayer::mean_level) {
      how.layer = mean_level_layer(result_.sensor.classifier.threshold,
                                   pressures.empty() ? 0.0 : pressures.back());
    }
    how.layer.near_mm = near * spacing_mm_;
    how.layer.far_mm = far * spacing_mm_;
    how.level_edges = level_edges_of(presses_, result_.sensor.classifier, kind.levels);
    how.contact = {.classifier = result_.sensor.classifier,
                   .gamma = ContactModel{}.gamma,
                   .prior = result_.sensor.prior};
    if (known_poses_) {
      how.counted_within = *result_.sensor.bins;
    } else {
      how.lattice = placing_lattice(maps_, spacing_mm_, placing_step_rad);
    }
    return how;
  }

  /// The bins for which touches at known poses are learned.
  void settle_bins() {
    bins_ = options_.bins.value_or(RecognitionBins{fine_lattice(presses_, spacing_mm_)});
    const PoseLattice& lattice = bins_->lattice;
    lattice.validate();
    if (bins_->auto_pivot) {
      require_within(presses_, lattice);
    }
    result_.sensor.bins =
        BinSteps{lattice.x_mm.step(), lattice.y_mm.step(), lattice.theta_rad.step()};
  }

  /// Leaves no more of these bins than touches are tried on in a short time.
  void settle_tried_bins() {
    // Of the maps of folds, a touch is tried on the one without its own.
    std::map<std::string, std::size_t> maps_of;
    for (const TrainingMap& map : maps_) {
      std::size_t& count = maps_of[map.map.label];
      count = map.presses.empty() ? std::min(count + 1, options_.most_maps) : 1;
    }
    std::size_t maps = 0;
    for (const auto& [label, count] : maps_of) {
      maps += count;
    }
    bins_->lattice = affordable_lattice(bins_->lattice, presses_, result_.sensor.classifier,
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
         count_placed(placed.placements, presses_, maps_, layers_of(maps_, how.layer), how)) {
      all += counts;
    }
    result_.sensor.gamma = fit_gamma(all, result_.sensor.prior);
  }

  void learn_confidence(const CrossValidation& eq7, const LearnedFromTable& table) {
    const CrossValidation& learned = table.validation;
    result_.before = scores_of(eq7.presses, 1.0);
    result_.table = scores_of(learned.presses, 1.0);
    result_.after = scores_of(table.after.presses, 1.0);
    const std::vector<ScoredPress>& groups = table.after.groups;
    if (!groups.empty()) {
      result_.groups = GroupScores{.touches = presses_in_group,
                                   .before = scores_of(both(eq7.groups), 1.0),
                                   .table = scores_of(both(learned.groups), 1.0),
                                   .after = scores_of(groups, 1.0)};
    } else if (known_poses_) {
      result_.warnings.push_back(
          fmt::format("too few touches to try {} of an object together on maps without them, so "
                      "that how sure to be after several touches is not learned; give {} or more "
                      "of each object",
                      presses_in_group, presses_in_group * options_.folds));
    }
    // What few presses could show by chance is no warning.
    constexpr double worse_nats = 0.05;
    const double without = scores_of(tempered_by_halves(eq7.presses).presses, 1.0).log_loss;
    if (result_.after->log_loss > without + worse_nats) {
      result_.warnings.push_back(fmt::format(
          "on touches that it has not seen, the learned table has a log-loss of {:.3f}, worse than "
          "{:.3f} by Eq. 7 with a temperature: give more touches of each object, or recognize "
          "without the sensor model",
          result_.after->log_loss, without));
    }
    const TemperatureFit fit = fit_temperature(learned.presses, learned.groups);
    result_.sensor.temperature = fit.temperature;
    result_.sensor.temperature_growth = fit.growth;
    if (!known_poses_) {
      std::vector<LabelledFeatures> features;
      for (const Press& press : presses_) {
        features.push_back(
            {press.label, press_features(press.touches.front(), result_.sensor.classifier)});
      }
      result_.sensor.features = learn_features(features);
      result_.sensor.features->weight = fit.feature_weight;
    }
    learn_fit_scale(learned.fit_z);
    if (learned.known.empty() || learned.unknown.empty()) {
      return;
    }
    const FamiliarityScores scores{learned.known, learned.unknown};
    result_.sensor.familiarity = fit_familiarity(scores);
    result_.area_under_curve = area_under_curve(scores, *result_.sensor.familiarity);
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

  std::vector<Press> presses_;
  const SensorCalibrationOptions& options_;
  bool known_poses_ = false;
  std::vector<TableKind> tables_;
  double spacing_mm_ = 0.0;
  std::vector<TrainingMap> maps_;
  std::optional<RecognitionBins> bins_;  ///< for touches at known poses
  SensorCalibration result_;
};

}  // namespace

std::vector<TableKind> default_tables(bool known_poses) {
  constexpr TableKind of_contact{MapLayer::log_odds, 2};
  constexpr TableKind of_pressure{MapLayer::mean_level, 7};
  return known_poses ? std::vector{of_pressure} : std::vector{of_contact, of_pressure};
}

bool is_clearly_less(std::span<const double> losses, std::span<const double> others) {
  const auto n = static_cast<double>(losses.size());
  double mean = 0.0;
  for (std::size_t i = 0; i < losses.size(); ++i) {
    mean += (others[i] - losses[i]) / n;
  }
  double variance = 0.0;
  for (std::size_t i = 0; i < losses.size(); ++i) {
    const double apart = others[i] - losses[i] - mean;
    variance += apart * apart / std::max(1.0, n - 1.0);
  }
  return mean > 2.0 * std::sqrt(variance / n);
}

std::vector<double> level_edges_of(const std::vector<Press>& presses,
                                   const ContactClassifier& classifier, std::size_t levels) {
  const std::vector<double> pressures = contact_pressures(presses, classifier);
  std::vector<double> edges;
  for (std::size_t level = 2; level < levels && !pressures.empty(); ++level) {
    const double edge = pressures[(level - 1) * pressures.size() / (levels - 1)];
    if (edge > (edges.empty() ? pressures.front() : edges.back())) {
      edges.push_back(edge);
    }
  }
  return edges;
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
