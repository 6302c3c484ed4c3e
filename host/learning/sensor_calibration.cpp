#include "learning/sensor_calibration.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "estimation/maps/left_out_fit.hpp"
#include "learning/array_place.hpp"
#include "learning/feature_learning.hpp"
#include "learning/host_progress.hpp"
#include "model/element_spacing.hpp"
#include "palpate/error.hpp"

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

/// The bins for which touches at known poses are learned.
RecognitionBins bins_for(const std::vector<Press>& presses, const SensorCalibrationOptions& options,
                         double spacing_mm) {
  const RecognitionBins bins =
      options.bins.value_or(RecognitionBins{fine_lattice(presses, spacing_mm)});
  bins.lattice.validate();
  if (bins.auto_pivot) {
    require_within(presses, bins.lattice);
  }
  return bins;
}

/// No more of these bins than touches are tried on in a short time.
RecognitionBins affordable_bins(const RecognitionBins& bins, const LearnedPresses& learned,
                                const SensorCalibrationOptions& options) {
  // Among the maps of folds, a touch is tried on the one that was built without it.
  std::map<std::string, std::size_t> maps_of;
  for (const TrainingMap& map : learned.maps) {
    std::size_t& count = maps_of[map.map.label];
    count = map.presses.empty() ? std::min(count + 1, options.most_maps) : 1;
  }
  std::size_t maps = 0;
  for (const auto& [label, count] : maps_of) {
    maps += count;
  }
  const TrialCost cost{.maps = maps,
                       .spacing_mm = learned.readings.spacing_mm,
                       .minutes = options.bins ? minutes_at_bins : minutes};
  return {affordable_lattice(bins.lattice, learned.presses, learned.readings.classifier, cost),
          bins.auto_pivot};
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
  std::vector<std::string> warnings = stuck_elements(
      learned.presses, learned.readings.classifier.threshold, learned.readings.pressures);
  std::set<std::string> alone;
  for (const Press& press : learned.presses) {
    alone.insert(press.label);
  }
  for (const std::string& label : compared_labels(learned)) {
    alone.erase(label);
  }
  for (const std::string& label : alone) {
    warnings.push_back(
        fmt::format("'{}': no touch has a map of the object that it is no part of, so that "
                    "nothing is learned of its readings; give it two touches{} or a map",
                    label, learned.presses.front().group.empty() ? "" : " of different groups"));
  }
  return warnings;
}

/// The sensor without what a table and its cross-validation say.
LearnedSensor sensor_of(const LearnedReadings& readings, const std::string& pressure_unit,
                        const std::optional<BinSteps>& bins) {
  LearnedSensor sensor{
      .pressure_unit = pressure_unit, .noise = readings.noise, .classifier = readings.classifier};
  sensor.prior = readings.prior;
  sensor.spread_mm = readings.spread_mm;
  sensor.bins = bins;
  return sensor;
}

/// Gamma by the placed presses, counted over log odds.
double gamma_of(const PlacedPresses& placed, const TableLearning& table,
                const LearnedPresses& learned) {
  TableLearning how = table;
  how.layer = {.near_mm = table.layer.near_mm, .far_mm = table.layer.far_mm};
  how.level_edges.clear();
  how.counted_within = {};  // gamma is of the sensor, whatever the bins
  LevelCounts all(2);
  for (const auto& [label, counts] :
       count_placed(placed.placements, learned.presses, layers_of(learned.maps, how.layer), how)) {
    all += counts;
  }
  return fit_gamma(all, learned.readings.prior);
}

/// Tries every fold's presses on the models_of() the others, [model][fold].
std::vector<std::vector<CrossValidation>> cross_validate(const std::vector<Press>& presses,
                                                         const std::vector<std::string>& labels,
                                                         const std::vector<TableKind>& tables,
                                                         const ModelLearning& how,
                                                         const CrossValidationOptions& options,
                                                         SerialProgress& progress) {
  std::vector<std::vector<CrossValidation>> tried(tables.size() + 1);
  const double share = 1.0 / static_cast<double>(options.folds);
  const double learning = static_cast<double>(tables.size()) * table_cost;
  for (std::size_t fold = 0; fold < options.folds; ++fold) {
    const std::vector<Press> others = presses_without(fold, presses, options.folds);
    if (others.size() == presses.size()) {  // there are fewer groups than folds
      progress.part(learning + static_cast<double>(tried.size()) * share)(1.0);
      for (std::vector<CrossValidation>& of_model : tried) {
        of_model.emplace_back();
      }
      continue;
    }
    const std::vector<FoldModel> models = models_of(others, tables, how, progress.part(learning));
    for (std::size_t i = 0; i < tried.size(); ++i) {
      tried[i].push_back(models.empty() ? CrossValidation()
                                        : try_fold(fold, presses, labels, models[i], options,
                                                   progress.part(share)));
    }
  }
  return tried;
}

/// A table, and what it says of presses that it has not seen.
struct TriedModel {
  TableLearning how;
  PlacedPresses placed;
  std::vector<CrossValidation> folds;
  CrossValidation all;    ///< the folds together
  TemperedPresses after;  ///< the folds together, with temperature and features
};

/// The first table, unless a later one is clearly better about presses, without those of a fold.
const TriedModel& kept(const std::vector<TriedModel>& tried,
                       std::optional<std::size_t> without = {}) {
  const auto losses = [&](const TriedModel& one) {
    return losses_of(without ? of_fold(one.after.presses, *without, false) : one.after.presses);
  };
  const TriedModel* best = &tried.front();
  for (const TriedModel& one : tried) {
    best = is_clearly_less(losses(one), losses(*best)) ? &one : best;
  }
  return *best;
}

/// Adds how right the cross-validation is: each fold's presses are judged by the table that the
/// other folds keep.
void judge(const CrossValidation& eq7, const std::vector<TriedModel>& tried, bool known_poses,
           SensorCalibration& judged) {
  const std::size_t folds = tried.front().folds.size();
  std::vector<CrossValidation> of_folds;
  TemperedPresses after;
  for (std::size_t fold = 0; fold < folds; ++fold) {
    const TriedModel& model = kept(tried, fold);
    of_folds.push_back(model.folds[fold]);
    std::ranges::copy(of_fold(model.after.presses, fold, true), std::back_inserter(after.presses));
    std::ranges::copy(of_fold(model.after.groups, fold, true), std::back_inserter(after.groups));
  }
  const CrossValidation table = joined(of_folds);
  judged.before = scores_of(eq7.presses, 1.0);
  judged.table = scores_of(table.presses, 1.0);
  judged.after = scores_of(after.presses, 1.0);
  if (!after.groups.empty()) {
    judged.groups = GroupScores{.touches = presses_in_group,
                                .before = scores_of(both(eq7.groups), 1.0),
                                .table = scores_of(both(table.groups), 1.0),
                                .after = scores_of(after.groups, 1.0)};
    judged.gain = gain_of(eq7, table, after.presses);
  } else if (known_poses) {
    judged.warnings.push_back(
        fmt::format("too few touches to try {} of an object together on maps without them, so "
                    "that how sure to be after several touches is not learned; give {} or more "
                    "of each object",
                    presses_in_group, presses_in_group * folds));
  } else {
    judged.gain = gain_of(eq7, table, after.presses);
  }
  const std::vector<ScoredPress> without = tempered_by_folds(eq7.presses).presses;
  // What few presses could show by chance is no warning.
  if (is_clearly_less(losses_of(without), losses_of(after.presses))) {
    judged.warnings.push_back(fmt::format(
        "on touches that it has not seen, the learned table has a log-loss of {:.3f}, worse than "
        "{:.3f} by Eq. 7 with a temperature: give more touches of each object, or recognize "
        "without the sensor model",
        judged.after->log_loss, scores_of(without, 1.0).log_loss));
  }
}

/// The scale of the objects' z together; none where no object's differ.
std::optional<FitScale> fit_scale_of(const std::map<std::string, std::vector<double>>& objects) {
  std::vector<FitScale> scales;
  for (const auto& [label, z] : objects) {
    if (const std::optional<FitScale> scale = scale_of(z)) {
      scales.push_back(*scale);
    }
  }
  return scales.empty() ? std::nullopt : std::optional(pooled(scales));
}

/// The sensor with how sure to be of what its table says.
LearnedSensor with_confidence(LearnedSensor sensor, const CrossValidation& validation,
                              const std::vector<Press>& presses) {
  const TemperatureFit fit = fit_temperature(validation.presses, validation.groups);
  sensor.temperature = fit.temperature;
  sensor.temperature_growth = fit.growth;
  if (!at_known_poses(presses)) {
    sensor.features = learn_features(presses, sensor.classifier);
    sensor.features->weight = fit.feature_weight;
  }
  sensor.fit_scale = fit_scale_of(validation.fit_z);
  if (sensor.fit_scale) {
    if (const auto best = scale_of(validation.best_fit_z)) {
      sensor.fit_scale->alone = {best->mean, best->sd};
    }
    sensor.fit_scale = with_strangers(validation.stranger_fits, *sensor.fit_scale);
    sensor.fit_scale->array =
        FitArray{static_cast<double>(presses.front().touches.front().elements_mm.size()),
                 spacing_mm_of(presses)};
  }
  sensor.pose_scale = pose_scale_of(validation.place_errors);
  return sensor;
}

/// The calibration of the sensor with one table, of which nothing can be judged.
SensorCalibration of_one_object(SensorCalibration calibration, const LearnedPresses& learned,
                                const TableLearning& table,
                                const std::function<void(double)>& progress) {
  const PlacedPresses placed = learn_table(learned.presses, learned.maps, table, progress);
  calibration.sensor.table = placed.table;
  calibration.sensor.gamma = gamma_of(placed, table, learned);
  calibration.warnings.emplace_back(
      "touches of one object say nothing about confidence: the temperature stays 1, and "
      "press features are not learned; give touches of two objects or more");
  return calibration;
}

}  // namespace

std::vector<TableKind> default_tables(bool known_poses) {
  constexpr TableKind of_contact{MapLayer::log_odds, 2};
  constexpr TableKind of_pressure{MapLayer::mean_level, 7};
  return known_poses ? std::vector{of_pressure} : std::vector{of_contact, of_pressure};
}

SensorCalibration calibrate_sensor(const std::vector<Press>& given_presses,
                                   const std::vector<OccupancyGrid>& given,
                                   const SensorCalibrationOptions& options,
                                   const std::function<void(double)>& progress) {
  if (given_presses.empty()) {
    throw Error(Fault::input, "no touches; give recordings with touches");
  }
  require_poses_of_one_kind(given_presses);
  const bool known_poses = at_known_poses(given_presses);
  const std::vector<TableKind> tables =
      options.tables.empty() ? default_tables(known_poses) : options.tables;
  ModelLearning how{.readings = {.pressure_unit = options.pressure_unit,
                                 .threshold = options.threshold,
                                 .ratio = options.ratio,
                                 .spacing_mm = spacing_mm_of(given_presses),
                                 .maps = options.maps},
                    .folds = options.folds};
  for (const OccupancyGrid& map : given) {
    how.given.push_back({map});
  }

  std::optional<SetupFinding> array_offset;
  if (known_poses && std::ranges::any_of(given, &OccupancyGrid::drawn)) {
    array_offset = offset_on_drawings(given_presses, given,
                                      learn_readings(given_presses, how.readings).classifier);
  }
  const std::vector<Press> presses =
      array_offset ? with_offset(given_presses, *array_offset->array_offset) : given_presses;
  const LearnedReadings readings = learn_readings(presses, how.readings);
  const CheckedPresses checked = without_unknown(presses, readings.classifier);
  std::optional<RecognitionBins> bins;
  if (known_poses) {
    bins = bins_for(checked.presses, options, readings.spacing_mm);
    const PoseLattice& lattice = bins->lattice;
    how.bins = {lattice.x_mm.step(), lattice.y_mm.step(), lattice.theta_rad.step()};
  }
  const LearnedPresses learned = with_maps(checked.presses, readings, how);
  const std::vector<std::string> labels = labels_of(learned.maps);
  SensorCalibration calibration{.sensor = sensor_of(readings, options.pressure_unit, how.bins),
                                .maps = readings.maps(),
                                .array_offset = std::move(array_offset),
                                .objects = labels.size(),
                                .warnings = checked.warnings};
  std::ranges::copy(warnings_about(learned), std::back_inserter(calibration.warnings));
  if (labels.size() < 2) {
    return of_one_object(std::move(calibration), learned,
                         table_learning(tables.back(), learned, how), progress);
  }

  if (bins) {
    bins = affordable_bins(*bins, learned, options);
  }
  const auto table_count = static_cast<double>(tables.size());
  const double learnings = table_count * (1.0 + static_cast<double>(options.folds));
  SerialProgress work(learnings * table_cost + table_count + 1.0, progress);
  std::vector<TriedModel> tried;
  for (const TableKind& kind : tables) {
    TriedModel& one = tried.emplace_back();
    one.how = table_learning(kind, learned, how);
    one.placed = learn_table(learned.presses, learned.maps, one.how, work.part(table_cost));
  }
  const std::vector<std::vector<CrossValidation>> validations =
      cross_validate(learned.presses, labels, tables, how,
                     {.folds = options.folds,
                      .maps_per_object = options.most_maps,
                      .bins = bins,
                      .spacing_mm = readings.spacing_mm},
                     work);
  for (std::size_t i = 0; i < tables.size(); ++i) {
    TriedModel& one = tried[i];
    one.folds = validations[i];
    one.all = joined(one.folds);
    one.after = tempered_by_folds(one.all.presses, one.all.groups);
    calibration.tried.push_back({tables[i], scores_of(one.after.presses, 1.0).log_loss});
  }
  const TriedModel& best = kept(tried);
  calibration.sensor.table = best.placed.table;
  calibration.sensor.gamma = gamma_of(best.placed, best.how, learned);
  calibration.sensor = with_confidence(calibration.sensor, best.all, learned.presses);

  judge(joined(validations.back()), tried, known_poses, calibration);
  return calibration;
}

}  // namespace palpate
