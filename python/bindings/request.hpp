#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "call.hpp"
#include "palpate/device.hpp"
#include "recognition/recognition_job.hpp"
#include "recognition/request.hpp"

namespace palpate::python {

/// What a result holds, as in the JSON of a command; palpate.results makes attributes of the keys.
using Fields = nb::typed<nb::dict, nb::str, nb::any>;

nb::object to_python(const nlohmann::ordered_json& json);
/// @param json an object
inline Fields fields_of(const nlohmann::ordered_json& json) {
  return nb::borrow<Fields>(to_python(json));
}

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

/// The recordings of touches that a Recording, a file, or an iterable of them gives.
/// @throws Error as read_touch_recordings() does, and where there are none
std::vector<Recording> recordings_of(nb::handle given);

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

/// Runs `work(job, report)` on the request's device, as run() does.
template <typename F>
auto run_job(nb::handle recordings, const PythonRequest& request, const Progress& progress,
             F work) {
  // First: what is wrong with options is told before recordings are read.
  const Request completed = run([&] { return complete(request); });
  std::vector<Recording> touched = recordings_of(recordings);
  return run(progress, [&](const Report& report) {
    const auto device = device_of(request.open_device, completed.device);
    return work(
        RecognitionJob(completed, std::move(touched), {}, [&]() -> Device& { return *device; }),
        report);
  });
}

}  // namespace palpate::python
