#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "palpate/device.hpp"
#include "palpate/touch.hpp"
#include "recognition/recogniser.hpp"
#include "recognition/recognition_record.hpp"
#include "recognition/recognition_task.hpp"
#include "recognition/request.hpp"

namespace palpate {

/// What a task follows from beside its request.
struct Circumstances {
  std::string pressure_unit;  ///< of the touches to come
  std::string source;         ///< that gives them, for messages
  double reach_mm = 0.0;      ///< of the largest array that touches; see array_reach_mm()
  /// Option that reads every bin, for which `auto` takes the histogram; "" where none does.
  std::string every_bin_for = {};
  /// Counts of x, y and theta that were settled before, in the place of those that the request
  /// leaves open.
  std::optional<std::array<int, 3>> counts = {};
};

/// Gives the device that recognises, which may be opened only then.
using DeviceSource = std::function<Device&()>;

/// The task that a completed request asks for: the objects, the sensor, the region, whether
/// "(none)" is one of the objects, and the filter.
/// @param device asked for where counts of bins follow from its memory, and where maps of unlike
/// priors are built again
/// @throws Error where a file cannot be read, and naming the option, or the scene file and its key,
/// whose value cannot be meant
RecognitionTask resolve(const Request& request, const Circumstances& circumstances,
                        const DeviceSource& device = {});

/// A recognition from what is asked to the filter that answers. Every caller begins here: a
/// command, Python, a batch.
class RecognitionJob {
 public:
  /// Of touches to come.
  /// @param request completed
  /// @param device by default the one that the request names, opened once it is needed
  /// @throws Error as resolve() does
  RecognitionJob(Request request, const Circumstances& circumstances, DeviceSource device = {});
  /// Of the unknowns that the request selects from recordings, which get the scene's array, where
  /// it has one.
  /// @param recordings of touches, one or more
  /// @param circumstances pressure_unit, source and reach_mm are those of the recordings
  /// @throws Error as list_unknowns() and resolve() do
  RecognitionJob(Request request, std::vector<Recording> recordings,
                 Circumstances circumstances = {}, DeviceSource device = {});
  // The unknowns are views into the recordings.
  RecognitionJob(const RecognitionJob&) = delete;
  RecognitionJob(RecognitionJob&&) = default;

  const Request& request() const { return request_; }
  const std::vector<Query>& unknowns() const { return unknowns_; }
  const RecognitionTask& task() const { return task_; }

  /// The device on which the task's filter computes, open; null where it uses none.
  /// @throws Error where there is no device of the name that is asked for, also where none is used
  Device* device() const;
  /// "none" where none is used.
  std::string device_name() const;
  /// Opens the task's filter; several may be open.
  /// @throws Error; where the device has no memory for the histogram's bins, it names the options
  /// without which bounds would take them
  Recogniser open(const FilterResources& search = {}) const;

 private:
  Request request_;
  std::vector<Recording> recordings_;
  std::vector<Query> unknowns_;
  DeviceSource device_;
  RecognitionTask task_;
};

}  // namespace palpate
