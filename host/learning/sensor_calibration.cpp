#include "learning/sensor_calibration.hpp"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "estimation/maps/left_out_fit.hpp"
#include "learning/held_out.hpp"
#include "learning/progress.hpp"
#include "learning/setup_judge.hpp"
#include "model/element_spacing.hpp"
#include "model/refuse.hpp"
#include "model/touch_evidence.hpp"

namespace palpate {

namespace {

/// How long learning a table takes, in cross-validations.
constexpr double table_cost = 4.0 / 3.0;
/// Minutes of one core to try touches at known poses; and to try them on bins that are given.
constexpr double minutes = 0.25;
constexpr double minutes_at_bins = 1.0;

/// The largest spacing of the presses' arrays.
double spacing_mm_of(const std::vector<Press>& presses) {
  double spacing_mm = 0.0;
  for (const Press& press : presses) {
    if (const auto spacing = spacing_of(press.touches.front().elements_mm)) {
      spacing_mm = std::max(spacing_mm, spacing->nearest_mm.most);
    }
  }
  if (!(spacing_mm > 0.0)) {
    throw Error(Fault::input, "the arrays have one element each; a calibration needs several");
  }
  return spacing_mm;
}

/// The presses but for those all of whose elements are Unknown, which are warned of. Throws Error
/// where no press is left.
std::vector<Press> without_unknown(const std::vector<Press>& presses,
                                   const ContactClassifier& classifier,
                                   std::vector<std::string>& warnings) {
  std::vector<Press> known;
  std::string first;
  for (const Press& press : presses) {
    if (std::ranges::any_of(evidence_of(press.touches, {.classifier = classifier}),
                            &TouchEvidence::tells)) {
      known.push_back(press);
    } else if (first.empty()) {
      first = press.name;
    }
  }
  if (known.empty()) {
    refuse(first,
           "all elements are Unknown, as in all other touches: dead, without a number, or of the "
           "same pressure");
  }
  if (const std::size_t left_out = presses.size() - known.size(); left_out > 0) {
    warnings.push_back(fmt::format(
        "{}: all elements are Unknown: dead, without a number, or of the same pressure; left out{}",
        first, left_out > 1 ? fmt::format(", with {} more such touches", left_out - 1) : ""));
  }
  return known;
}

/// The bins' lattice, or as fine a one as touches are tried on in a short time.
/// @param given whether a user gave the bins
PoseLattice affordable(const CalibrationSettings& settings, const LearnedPresses& learned,
                       const std::vector<std::string>& labels, bool given) {
  std::size_t maps = 0;
  for (const std::string& label : labels) {
    const auto own = static_cast<std::size_t>(std::ranges::count(
        learned.maps, label, [](const TrainingMap& map) { return map.map.label; }));
    // Among the maps of folds, a touch is tried on the one that was built without it.
    maps += settings.given.empty() ? 1 : std::min(own, settings.most_maps);
  }
  return affordable_lattice(settings.bins->lattice, learned, maps,
                            given ? minutes_at_bins : minutes);
}

std::vector<std::string> labels_of(const std::vector<TrainingMap>& maps) {
  std::set<std::string> labels;
  for (const TrainingMap& map : maps) {
    labels.insert(map.map.label);
  }
  return {labels.begin(), labels.end()};
}

/// Warns of what the presses cannot tell before any table, in whole sentences.
std::vector<std::string> warnings_about(const LearnedPresses& learned) {
  std::vector<std::string> warnings;
  std::set<std::string> uncompared;
  for (const Press& press : learned.presses) {
    uncompared.insert(press.label);
  }
  for (const std::string& label : compared_labels(learned)) {
    uncompared.erase(label);
  }
  for (const std::string& label : uncompared) {
    warnings.push_back(
        fmt::format("'{}': no touch has a map of the object that it is no part of, so that "
                    "nothing is learned of its readings; give it two touches{} or a map",
                    label, learned.presses.front().group.empty() ? "" : " of different groups"));
  }
  return warnings;
}

/// Gamma by the placed presses, counted over log odds.
double gamma_of(const PlacedPresses& placed, const TableLearning& table,
                const LearnedPresses& learned) {
  TableLearning settings = table;
  settings.layer = {.near_mm = table.layer.near_mm, .far_mm = table.layer.far_mm};
  settings.level_edges.clear();
  settings.counted_within = {};  // gamma is of the sensor, whatever the bins
  LevelCounts all(2);
  for (const auto& [label, counts] : count_placed(
           placed.placements, learned.presses, layers_of(learned.maps, settings.layer), settings)) {
    all += counts;
  }
  return fit_gamma(all, learned.readings.maps.sensor.prior);
}

/// A table, and what it says of presses that it has not seen.
struct TriedModel : CrossValidation {
  TableKind kind;
  TableLearning learning;
  PlacedPresses placed;
  std::vector<HeldOut> after = {};  ///< the unknowns with temperature and features
};

/// What is tried on presses that it has not seen.
struct Trials {
  std::vector<TriedModel> tables;
  CrossValidation eq7;
};

/// Learns each table from all presses, and tries every fold's presses on the models_of() the
/// others.
Trials cross_validate(const LearnedPresses& learned, const std::vector<std::string>& labels,
                      const CalibrationSettings& settings,
                      const std::function<void(double)>& progress) {
  const auto count = static_cast<double>(settings.tables.size());
  const auto folds = static_cast<double>(settings.folds);
  Progress work(count * (1.0 + folds) * table_cost + count + 1.0, progress);
  Trials trials;
  for (const TableKind& kind : settings.tables) {
    TriedModel& one = trials.tables.emplace_back(
        TriedModel{{}, kind, table_learning(kind, learned, settings), {}});
    one.placed = learn_table(learned.presses, learned.maps, one.learning, work.part(table_cost));
  }
  for (std::size_t fold = 0; fold < settings.folds; ++fold) {
    const std::vector<Press> others = presses_without(fold, learned.presses, settings.folds);
    const auto show_learning = work.part(count * table_cost);
    const auto show_trials = work.part((count + 1.0) / folds);
    if (others.size() < learned.presses.size()) {  // else there are fewer groups than folds
      const std::vector<FoldModel> models = models_of(others, settings, show_learning);
      for (std::size_t i = 0; i < models.size(); ++i) {
        CrossValidation& found = i < trials.tables.size() ? trials.tables[i] : trials.eq7;
        found += try_fold(fold, learned.presses, labels, models[i], settings);
        show_trials(static_cast<double>(i + 1) / static_cast<double>(models.size()));
      }
    }
    show_trials(1.0);
  }
  for (TriedModel& one : trials.tables) {
    one.after = tempered_by_folds(one.unknowns);
  }
  return trials;
}

/// The first table, unless a later one is clearly better about presses, without those of a fold.
const TriedModel& kept(const std::vector<TriedModel>& tried,
                       std::optional<std::size_t> without = {}) {
  const auto losses = [&](const TriedModel& one) {
    return losses_of(without ? of_fold(one.after, *without, false) : one.after);
  };
  const TriedModel* best = &tried.front();
  for (const TriedModel& one : tried) {
    best = difference_of(losses(one), losses(*best)).is_clear() ? &one : best;
  }
  return *best;
}

/// What is said of each fold's presses by the table that the other folds keep.
std::vector<HeldOut> said_by_kept(const std::vector<TriedModel>& tried, std::size_t folds,
                                  std::vector<HeldOut> TriedModel::*said) {
  std::vector<HeldOut> all;
  for (std::size_t fold = 0; fold < folds; ++fold) {
    std::ranges::move(of_fold(kept(tried, fold).*said, fold, true), std::back_inserter(all));
  }
  return all;
}

/// The scale of the objects' z together, of best fits and of strangers; none where no object's z
/// differ.
std::optional<FitScale> fit_scale_of(std::span<const HeldOut> unknowns,
                                     const std::vector<Press>& presses) {
  std::vector<FitScale> scales;
  for (const auto& [label, z] : by_label(unknowns, &HeldOut::fit_z)) {
    if (const std::optional<FitScale> of_label = scale_of(z)) {
      scales.push_back(*of_label);
    }
  }
  if (scales.empty()) {
    return {};
  }
  FitScale scale = pooled(scales);
  std::vector<double> best_z;
  for (const HeldOut& press : unknowns) {
    if (press.best_fit_z) {
      best_z.push_back(*press.best_fit_z);
    }
  }
  if (const auto best = scale_of(best_z)) {
    scale.single_touch = {best->mean, best->sd};
  }
  scale = with_strangers(by_label(unknowns, &HeldOut::stranger_fit), scale);
  scale.array = FitArray{static_cast<double>(presses.front().touches.front().elements_mm.size()),
                         spacing_mm_of(presses)};
  return scale;
}

/// Adds how right the cross-validation is: each fold's presses are judged by the table that the
/// other folds keep.
void judge(const Trials& trials, std::size_t folds, bool known_poses, SensorCalibration& judged) {
  const std::vector<HeldOut>& eq7 = trials.eq7.unknowns;
  const auto table = said_by_kept(trials.tables, folds, &TriedModel::unknowns);
  const auto after = said_by_kept(trials.tables, folds, &TriedModel::after);
  for (const TriedModel& one : trials.tables) {
    judged.tried.push_back({one.kind, scores_of(single_touches(one.after)).log_loss});
  }
  const auto scores = [&](std::vector<HeldOut> (*some)(std::span<const HeldOut>)) {
    return ComparedScores{scores_of(some(eq7)), scores_of(some(table)), scores_of(some(after))};
  };
  judged.touches = scores(single_touches);
  if (!groups_in(after).empty()) {
    judged.groups = scores(groups_in);
  }
  if (judged.groups || !known_poses) {
    judged.gain = gain_of(eq7, after);
  } else {
    judged.warnings.push_back(
        fmt::format("too few touches to try {} of an object together on maps without them, so that "
                    "how sure to be after several touches is not learned; give {} or more of each "
                    "object",
                    presses_in_group, presses_in_group * folds));
  }
  // What few presses could show by chance is no warning.
  const std::vector<HeldOut> without = tempered_by_folds(single_touches(eq7));
  if (difference_of(losses_of(without), losses_of(after)).is_clear()) {
    judged.warnings.push_back(fmt::format(
        "on touches that it has not seen, the learned table has a log-loss of {:.3f}, worse than "
        "{:.3f} by Eq. 7 with a temperature: give more touches of each object, or recognize "
        "without the sensor model",
        judged.touches->after.log_loss, scores_of(without).log_loss));
  }
}

/// Sets what a table and its cross-validation say.
void set_numbers(const TriedModel& model, const LearnedPresses& learned, LearnedSensor& sensor) {
  const TemperatureFit fit = fit_temperature(model.unknowns);
  sensor.table = model.placed.table;
  sensor.gamma = gamma_of(model.placed, model.learning, learned);
  sensor.temperature = fit.temperature;
  sensor.temperature_growth = fit.growth;
  if (!at_known_poses(learned.presses)) {
    sensor.features = learn_features(learned.presses, learned.readings.classifier);
    sensor.features->weight = fit.feature_weight;
  }
  sensor.fit_scale = fit_scale_of(model.unknowns, learned.presses);
  sensor.pose_scale = pose_scale_of(model.place_errors);
}

}  // namespace

std::vector<TableKind> default_tables(bool known_poses) {
  constexpr TableKind of_contact{MapLayer::log_odds, 2};
  constexpr TableKind of_pressure{MapLayer::mean_level, 7};
  return known_poses ? std::vector{of_pressure} : std::vector{of_contact, of_pressure};
}

SensorCalibration calibrate_sensor(const std::vector<Press>& given_presses,
                                   const std::vector<OccupancyGrid>& given,
                                   const CalibrationSettings& options,
                                   const std::function<void(double)>& progress) {
  if (given_presses.empty()) {
    throw Error(Fault::input, "no touches; give recordings with touches");
  }
  const bool known_poses = at_known_poses(given_presses);
  CalibrationSettings settings = options;
  settings.readings.spacing_mm = spacing_mm_of(given_presses);
  if (settings.tables.empty()) {
    settings.tables = default_tables(known_poses);
  }
  for (const OccupancyGrid& map : given) {
    settings.given.push_back({map});
  }

  std::optional<SetupFinding> array_offset;
  if (known_poses && std::ranges::any_of(given, &OccupancyGrid::drawn)) {
    array_offset = offset_on_drawings(given_presses, given,
                                      learn_readings(given_presses, settings.readings).classifier);
  }
  const std::vector<Press> presses =
      array_offset ? with_offset(given_presses, *array_offset->array_offset) : given_presses;
  const LearnedReadings readings = learn_readings(presses, settings.readings);
  std::vector<std::string> warnings;
  const std::vector<Press> known = without_unknown(presses, readings.classifier, warnings);
  if (known_poses) {
    settings.bins =
        options.bins.value_or(RecognitionBins{fine_lattice(known, settings.readings.spacing_mm)});
    const PoseLattice& lattice = settings.bins->lattice;
    lattice.validate();
    if (settings.bins->auto_pivot) {
      require_within(known, lattice);
    }
    settings.steps = {lattice.x_mm.step(), lattice.y_mm.step(), lattice.theta_rad.step()};
  }
  const LearnedPresses learned = with_maps(known, readings, settings);
  const std::vector<std::string> labels = labels_of(learned.maps);
  SensorCalibration calibration{.sensor = {.pressure_unit = settings.readings.pressure_unit,
                                           .noise = readings.noise,
                                           .classifier = readings.classifier,
                                           .prior = readings.maps.sensor.prior,
                                           .spread_mm = readings.maps.sensor.spread_mm,
                                           .bins = settings.steps},
                                .maps = readings.maps,
                                .array_offset = std::move(array_offset),
                                .objects = labels.size(),
                                .warnings = std::move(warnings)};
  std::ranges::copy(warnings_about(learned), std::back_inserter(calibration.warnings));
  if (labels.size() < 2) {
    const TableLearning table = table_learning(settings.tables.back(), learned, settings);
    const PlacedPresses placed = learn_table(learned.presses, learned.maps, table, progress);
    calibration.sensor.table = placed.table;
    calibration.sensor.gamma = gamma_of(placed, table, learned);
    calibration.warnings.emplace_back(
        "touches of one object say nothing about confidence: the temperature stays 1, and "
        "press features are not learned; give touches of two objects or more");
    return calibration;
  }
  if (known_poses) {
    settings.bins->lattice = affordable(settings, learned, labels, options.bins.has_value());
  }
  const Trials trials = cross_validate(learned, labels, settings, progress);
  set_numbers(kept(trials.tables), learned, calibration.sensor);
  judge(trials, options.folds, known_poses, calibration);
  return calibration;
}

std::string unlearned_strangers(const LearnedSensor& sensor) {
  const bool known_poses = sensor.bins.has_value();
  if (!sensor.fit_scale || (known_poses ? sensor.fit_scale->stranger_sd.has_value()
                                        : sensor.fit_scale->stranger_single_touch.has_value())) {
    return "";
  }
  return known_poses ? "\"(none)\" goes by a figure of Palpate's own for how badly strangers fit; "
                       "to learn it, give 15 touches or more of each of three objects"
                     : "how badly strangers fit is not learned, so that a press does not tell "
                       "\"(none)\"; give presses of three objects or more";
}

}  // namespace palpate
