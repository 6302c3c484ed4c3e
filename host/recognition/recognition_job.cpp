#include "recognition/recognition_job.hpp"

#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "palpate/error.hpp"
#include "recognition/filter_choice.hpp"
#include "recognition/recordings.hpp"

namespace palpate {

namespace {

DeviceSource opened_once(const std::string& name) {
  return [name, device = std::make_shared<std::optional<Device>>()]() -> Device& {
    return *device ? **device : device->emplace(Device::open(name));
  };
}

std::vector<Recording> with_array(const Request& request, std::vector<Recording> recordings) {
  for (Recording& recording : recordings) {
    replace_array(request, recording);
  }
  return recordings;
}

Circumstances of_recordings(const std::vector<Recording>& recordings, Circumstances of) {
  of.pressure_unit = recordings.front().pressure_unit;
  of.source = recordings.front().path;
  of.reach_mm = largest_reach_mm(recordings);
  return of;
}

}  // namespace

RecognitionJob::RecognitionJob(Request request, const Circumstances& circumstances,
                               DeviceSource device)
    : request_(std::move(request)),
      device_(device ? std::move(device) : opened_once(request_.device)),
      task_(resolve(request_, circumstances, device_)) {}

RecognitionJob::RecognitionJob(Request request, std::vector<Recording> recordings,
                               Circumstances circumstances, DeviceSource device)
    : request_(std::move(request)),
      recordings_(with_array(request_, std::move(recordings))),
      unknowns_(list_unknowns(request_, recordings_)),
      device_(device ? std::move(device) : opened_once(request_.device)),
      task_(resolve(request_, of_recordings(recordings_, std::move(circumstances)), device_)) {}

Device* RecognitionJob::device() const {
  if (!task_.uses_device() && request_.device.empty()) {
    return nullptr;
  }
  Device& device = device_();
  return task_.uses_device() ? &device : nullptr;
}

std::string RecognitionJob::device_name() const {
  const Device* used = device();
  return used != nullptr ? used->name() : "none";
}

Recogniser RecognitionJob::open(const FilterResources& search) const {
  Device* used = device();
  if (used == nullptr) {
    return Recogniser(task_, search);
  }
  try {
    return {*used, task_};
  } catch (const Error& error) {
    // A resolved task is sound: only the bins' memory can be refused.
    if (error.fault() == Fault::input && traits_of(task_.filter).every_bin &&
        !task_.filter_chosen_by.empty() &&
        bounds_have_room(task_.hypotheses, {.lattice = task_.lattice(),
                                            .contact = task_.contact(),
                                            .touch_sd = task_.touch_sd()})) {
      throw Error(Fault::input,
                  fmt::format("{}, or leave out {}: `filter bounded` needs no device memory",
                              error.what(), task_.filter_chosen_by));
    }
    throw;
  }
}

}  // namespace palpate
