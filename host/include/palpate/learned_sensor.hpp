#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "palpate/api.hpp"
#include "palpate/contact.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/estimate.hpp"
#include "palpate/fit.hpp"
#include "palpate/pose.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// What of a map readings are compared with.
enum class MapLayer {
  log_odds,    ///< of occupancy
  mean_level,  ///< the mean pressure
};

/// How a map becomes the grid that a learned likelihood table is over. The values of cells that
/// touches sensed lie in [-8, 8]:
///   log odds, clamped; or
///   mean level p as 16 log(1 + p / unit_level) / log(1 + full_level / unit_level) - 8, clamped.
/// All other cells have values of their own, by the distance d to the nearest sensed cell, centre
/// to centre, and by whether that cell is occupied (log odds above 0):
///   d <= near_mm: -10, or -15 beside an occupied cell; d <= far_mm: -11, or -14; beyond: -12.
/// So a table tells apart what an array would read where nothing was sensed: beside a border that
/// the object may cross, and far from it.
struct PALPATE_API ReadingLayer {
  static constexpr double largest_value = 8.0;
  static constexpr double near_free = -10.0;
  static constexpr double near_occupied = -15.0;
  static constexpr double midway_free = -11.0;
  static constexpr double midway_occupied = -14.0;
  static constexpr double beyond = -12.0;
  /// Nodes of a likelihood table over the values above: half a nat apart.
  static constexpr double first_node = -16.0;
  static constexpr int nodes = 49;

  MapLayer of = MapLayer::log_odds;
  double near_mm = 4.0;
  double far_mm = 12.0;
  double unit_level = 1.0;    ///< pressure, in the recordings' unit
  double full_level = 255.0;  ///< pressure of the value 8

  /// Throws Error unless 0 <= near_mm <= far_mm <= most_length_mm, and both levels are positive.
  void validate() const;
};

/// The grid of Hypothesis::layer: it covers the map and far_mm around it. Its cells stand in
/// `log_odds`, its prior is that of the value beyond. A cell was sensed where `observations` are
/// above 0; without observations, where the log odds differ from the prior's.
/// @throws Error where the map has no mean level but `settings` asks for it, or the map's cells
/// with what is around them exceed most_cells
PALPATE_API OccupancyGrid reading_layer(const OccupancyGrid& map, const ReadingLayer& settings);

/// A likelihood table that was learned from touches, for all objects together and for each object
/// that had touches enough.
struct LearnedTable {
  ReadingLayer layer;  ///< what of a map the table is over
  /// Ascending pressures that part In Contact into levels; see LikelihoodTable::level_edges.
  std::vector<double> level_edges;
  /// log P(level | layer) in nats, [level, node], over ReadingLayer::nodes nodes.
  std::vector<double> shared;
  std::map<std::string, std::vector<double>> objects;  ///< numbers as `shared`, by label

  /// Number of levels, No Contact included.
  std::size_t levels() const { return level_edges.size() + 2; }
};
/// The table of a contact model, with numbers of one or several objects, [(object,) level, node].
PALPATE_API LikelihoodTable table_of(const LearnedTable& table, std::vector<double> log_likelihood);

/// What a press is like whatever its place: logarithms of its area, total force and peak.
struct PressFeatures {
  static constexpr std::size_t count = 3;
  /// log(1 + elements In Contact), log(1 + sum of pressures / threshold) and
  /// log(1 + largest pressure / threshold), over living elements; no pressure counts below 0.
  std::array<double, count> values{};
};
/// @param classifier with a threshold above 0
/// @throws Error on a touch that is not sound, or a threshold of 0
PALPATE_API PressFeatures press_features(const Touch& touch, const ContactClassifier& classifier);

/// The normal distribution of the features of an object's presses.
struct PALPATE_API FeatureDistribution {
  /// Pairs of features: area and force, area and peak, force and peak.
  static constexpr std::size_t pairs = 3;

  std::array<double, PressFeatures::count> mean{};
  std::array<double, PressFeatures::count> sd{};
  std::array<double, pairs> correlation{};

  /// Log density in nats; NaN where no distribution has these correlations.
  double log_density(const PressFeatures& features) const;
};

/// The features of every object's presses, as a term of each label's log evidence.
struct LearnedFeatures {
  double weight = 0.0;      ///< of a press's log density, after the temperature
  FeatureDistribution any;  ///< of an object that is not listed
  std::map<std::string, FeatureDistribution> objects;  ///< by label
};

/// Steps of a lattice's bins; 0 along an axis that is fixed.
struct BinSteps {
  double x_mm = 0.0;
  double y_mm = 0.0;
  double theta_rad = 0.0;
};

/// What `palpate calibrate` or `palpate map` learned about a sensor and the objects that it
/// touched.
struct PALPATE_API LearnedSensor {
  std::string pressure_unit = "kPa";
  double noise = 0.0;  ///< standard deviation of an untouched element, in the pressure unit
  ContactClassifier classifier;
  double gamma = usual_gamma;         ///< of Eq. 7
  double prior = 0.2;                 ///< of new maps
  double spread_mm = 0.5;             ///< of new maps
  DisplacementSd touch_sd;            ///< of the touches' poses
  std::optional<LearnedTable> table;  ///< in the place of Eq. 7
  /// After one touch a label's probability is its evidence to the power of 1 / temperature,
  /// normalised, and so do the modes of a label weigh. The temperature of n touches is
  /// temperature + (n - 1) temperature_growth: what all touches share, such as the distance from
  /// the pose to the nearest bin, makes several too sure.
  double temperature = 1.0;
  double temperature_growth = 0.0;
  /// How wide the bins are that it was learned for, from touches at known poses: on wider ones,
  /// probabilities are too sure.
  std::optional<BinSteps> bins;
  std::optional<LearnedFeatures> features;
  std::optional<FitScale> fit_scale;    ///< of the z of Fit; without one, z stays as it is
  std::optional<PoseScale> pose_scale;  ///< of the table
  /// [file] digests of the maps of its folder that it was learned for; empty where it is for any.
  std::map<std::string, std::string> maps;

  /// Throws Error on a value out of range.
  void validate() const;
};

/// The temperature of a number of touches of one object, at least one; see LearnedSensor.
inline double temperature_of(std::size_t touches, double temperature, double growth) {
  return temperature + growth * (static_cast<double>(touches) - 1.0);
}

/// Gives the contact model the sensor's classifier, gamma and table, and each hypothesis the layer
/// that the table is over. The table has one set of numbers where no hypothesis's label has numbers
/// of its own, or else a set for each hypothesis, so the hypotheses must keep their order. The
/// prior of a contact model with a table is unset: it is that of the layers. Without a table,
/// readings are compared with the maps by Eq. 7, and the prior stays as it is.
/// @throws Error on a sensor out of range, or as reading_layer() does; nothing changes then
PALPATE_API void apply(const LearnedSensor& sensor, std::vector<Hypothesis>& hypotheses,
                       ContactModel& contact);

/// Read or write a sensor model, a YAML file.
/// @throws Error (Fault::input) naming the file, key and remedy; writing as write_map() does
PALPATE_API LearnedSensor read_sensor_model(const std::filesystem::path& path);
PALPATE_API void write_sensor_model(const std::filesystem::path& path, const LearnedSensor& sensor);

}  // namespace palpate
