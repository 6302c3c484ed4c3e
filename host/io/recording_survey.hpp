#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "io/element_spacing.hpp"
#include "io/extremes.hpp"
#include "io/pressure_survey.hpp"
#include "io/recording_scan.hpp"

namespace palpate {

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
  std::optional<double> elapsed_s;         ///< from the first row to the last, see StreamTime
  std::uint64_t times_back = 0;            ///< rows whose time is before the time of the row before
  std::uint64_t first_back = 0;            ///< first such row
  std::uint64_t long_steps = 0;            ///< steps of time too long for a touch to last over them
  std::optional<std::uint64_t> lost = {};  ///< lost frames, where the file counts them
};

/// Reads a "palpate.recording" HDF5 file once, in pieces. Holds a few MB, some tens of bytes for
/// each element, and the file's `valid`.
/// @throws Error as read_recording() does
RecordingSurvey survey_recording(const std::filesystem::path& path);

}  // namespace palpate
