#pragma once

#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "call.hpp"
#include "palpate/device.hpp"
#include "recognition/recognition_record.hpp"
#include "recognition/request.hpp"
#include "recognition/resolve.hpp"

namespace palpate::python {

using Sentences = std::vector<std::string>;  ///< what is worth a warning

/// The sentences with options in the words of Python.
Sentences in_python(Sentences sentences);

/// What a call from Python asks.
struct PythonRequest : Request {
  std::shared_ptr<Device> open_device;  ///< in the place of `device`
};

/// Adds a map or an iterable of maps: files, folders, and maps in memory, beside which files are
/// read here.
void add_maps(nb::handle given, Request& request);
/// Reads the maps in the request's files, after those in memory.
void read_maps(Request& request);

/// Recordings as a call from Python gives them: files, or recordings in memory.
using GivenRecordings = std::vector<std::variant<std::string, Recording>>;
/// Throws Error as read_touch_recordings() does.
std::vector<Recording> read_recordings(const GivenRecordings& given);
/// Takes a Recording, a file, or an iterable of them. Throws Error where there are none.
GivenRecordings given_recordings(nb::handle given);

/// What a request is about.
struct Subject {
  Request request;  ///< completed
  std::vector<Recording> recordings;
  std::vector<Unknown> unknowns;  ///< views into the recordings
};
/// Completes the request, reads the recordings, with the scene's array, and selects the unknowns.
/// Throws Error.
Subject subject_of(const GivenRecordings& recordings, const Request& given);

/// The task of a subject, by what all its recordings have. Throws Error as resolve() does.
RecognitionTask task_of(const Subject& subject, Device& device, const CallerNeed& need = {});

/// The device that is open, or else the one of this name, see Device::open(). Throws Error, also
/// in a child of fork() whose parent has opened it.
inline std::shared_ptr<Device> device_of(const std::shared_ptr<Device>& open,
                                         const std::string& name) {
  if (open == nullptr) {
    return std::make_shared<Device>(Device::open(name));
  }
  open->context();
  return open;
}

/// Runs `work(subject, device, report)` on the request's device, as run() does.
template <typename F>
auto run_on_subject(nb::handle recordings, const PythonRequest& request, const Progress& progress,
                    F work) {
  const GivenRecordings given = given_recordings(recordings);
  return run(progress, [&](const Report& report) {
    const Subject subject = subject_of(given, request);
    const auto device = device_of(request.open_device, subject.request.device);
    return work(subject, *device, report);
  });
}

}  // namespace palpate::python
