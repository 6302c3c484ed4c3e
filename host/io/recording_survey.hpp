#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/recording_file.hpp"
#include "model/element_spacing.hpp"
#include "model/extremes.hpp"

namespace palpate {

/// Counts readings in bins that are at most 0.8 % of a reading wide, in 512 KiB whatever the number
/// of readings. A bin holds the numbers that agree in the first 16 bits of a float: sign, exponent
/// and 7 bits of the mantissa.
class ReadingHistogram {
 public:
  ReadingHistogram();

  /// Counts a reading that is no NaN.
  void add(double reading) { ++counts_[bin_of(reading)]; }

  /// Returns the reading below which the fraction `part` of all readings lie, rounded towards 0 to
  /// the edge of its bin: whole numbers up to 256 are exact. At least one reading is counted.
  double quantile(double part) const;
  /// Counts the readings in the bins of `low`, of `high` and between them.
  std::uint64_t count(double low, double high) const;
  /// Counts the bins with readings from the bin of `low` to the bin of `high`.
  std::uint64_t occupied(double low, double high) const;

 private:
  static std::size_t bin_of(double reading);
  static double edge_of(std::size_t bin);

  std::vector<std::uint64_t> counts_;
};

/// What one element reads over all rows of a recording. Rows in which the element is dead or
/// Unknown do not count.
struct ElementSurvey {
  std::uint64_t known = 0;      ///< rows with a known reading
  std::uint64_t alive = 0;      ///< rows in which the element is not dead
  std::uint64_t changes = 0;    ///< known readings that differ from the known reading before
  std::uint64_t zeros = 0;      ///< readings of exactly 0
  std::uint64_t contacts = 0;   ///< readings above the threshold
  std::uint64_t strongest = 0;  ///< rows in contact in which it reads the most of all elements
  double last = 0.0;            ///< the last known reading

  bool constant() const { return known > 0 && changes == 0; }
};

/// What the pressures of a recording hold.
struct PressureSurvey {
  std::vector<ElementSurvey> elements;  ///< [e]
  ReadingHistogram readings;
  /// Extremes of the known readings of living elements; none where there are no such readings.
  std::optional<Extremes> range;
  std::uint64_t unknown = 0;     ///< NaN readings of living elements
  std::uint64_t in_contact = 0;  ///< rows in contact: all, where no threshold is known
  std::uint64_t at_most = 0;     ///< readings equal to the largest reading
  /// Separate times at which the array reads the largest reading. Frames that follow each other are
  /// one time; each touch is a time of its own.
  std::uint64_t times_at_most = 0;
};

/// What a recording holds.
struct RecordingSurvey {
  /// Ranges of the known poses T_robot_sensor.
  struct Poses {
    Extremes x_mm;
    Extremes y_mm;
    Extremes theta_rad;
  };
  /// The places of the elements in the sensor frame, over all rows where the array changes.
  struct Array {
    Extremes x_mm;
    Extremes y_mm;
  };

  RecordingHead head;
  /// Pressure above the baseline from which on a reading counts as contact; none for raw pressure.
  std::optional<double> threshold;
  PressureSurvey pressure;
  std::uint64_t with_pose = 0;  ///< rows with a known pose
  std::optional<Poses> poses;   ///< none where no pose is known
  std::optional<Array> array;   ///< none where all elements are dead
  /// Spacing of the living elements; that of the first row where the array changes.
  std::optional<ElementSpacing> spacing;
  std::optional<double> elapsed_s;  ///< from the first row to the last, see StreamTime
  std::uint64_t times_back = 0;     ///< rows whose time is before the time of the row before
  std::uint64_t first_back = 0;     ///< first such row
  std::uint64_t long_steps = 0;     ///< steps of time too long for a touch to last over them
  /// Touches in contact that equal an earlier one to the digit, pose and pressures.
  std::uint64_t repeated = 0;
  std::optional<std::uint64_t> lost = {};  ///< lost frames, where the file counts them
};

/// Reads a "palpate.recording" HDF5 file once, in pieces. Holds a few MB, some tens of bytes for
/// each element, and the file's `valid`.
/// @throws Error as read_recording() does
RecordingSurvey survey_recording(const std::filesystem::path& path);

/// Returns what is probably wrong with a recording: units, elements that do not work, poses and
/// times. Each item is one sentence of text that names the fault and mostly its remedy. The rules
/// rather miss a fault than suspect a sound recording: a simulated recording gives no sentence,
/// with or without noise, as soon as it touches its object.
std::vector<std::string> findings_of(const RecordingSurvey& survey);

}  // namespace palpate
