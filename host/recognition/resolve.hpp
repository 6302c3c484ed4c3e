#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "recognition/recogniser.hpp"
#include "recognition/request.hpp"

namespace palpate {

/// What a caller needs, beside what the request says.
struct CallerNeed {
  std::string option = {};  ///< that asks for what needs the histogram
  std::string why = {};     ///< why that needs the histogram; "" where every filter will do
  /// Every unknown is one of the maps' objects, or cannot be told from "(none)", which then has no
  /// weight unless it is given one.
  bool learned_only = false;
  /// Every touch is waited for: `auto` takes bounds for any number of bins, which tell sooner.
  bool waited_for = false;
};

/// What a task follows from beside its request.
struct Circumstances {
  std::string pressure_unit;  ///< of the touches to come
  std::string source;         ///< that gives them, for messages
  double reach_mm = 0.0;      ///< of the largest array that touches; see array_reach_mm()
  CallerNeed need = {};
  /// Gives the device that recognises. Called where counts of bins follow from its memory, and
  /// where maps of unlike priors are built again.
  std::function<Device&()> device = {};
  /// Counts of x, y and theta that were settled before, in the place of those that the request
  /// leaves open.
  std::optional<std::array<int, 3>> counts = {};
};

/// The task that a completed request asks for: reads the maps and the sensor model, settles the
/// lattice, the filter, and how closely bounds find the evidence.
/// @throws Error where a file cannot be read, and naming the option, or the scene file and its key,
/// whose value cannot be meant
RecognitionTask resolve(const Request& request, const Circumstances& circumstances);

/// Whether the task's filter computes on a device. Bounds search on the host.
bool uses_device(const RecognitionTask& task);

/// Opens the task's filter.
/// @param device may be null where uses_device() is false
/// @throws Error; where the device has no memory for the histogram's bins,
/// it names the options without which bounds would take them
Recogniser open_recogniser(Device* device, const RecognitionTask& task,
                           const FilterResources& search = {});

/// What to say where the lattice does not resolve the task's touch_sd or slip_sd at one of these
/// poses of the sensor; else "".
/// @param lattice the task's, about the pivot in use
std::string unresolved_words(const RecognitionTask& task, const PoseLattice& lattice,
                             std::span<const Pose> T_robot_sensor);
/// As above, at these touches' poses.
std::string unresolved_words(const RecognitionTask& task, const PoseLattice& lattice,
                             std::span<const Touch> touches);

}  // namespace palpate
