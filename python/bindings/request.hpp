#pragma once

#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "recognition/recognition_job.hpp"
#include "recognition/request.hpp"
#include "session.hpp"

namespace palpate::python {

using Sentences = std::vector<std::string>;  ///< what is worth a warning

/// The sentences with options in the words of Python.
Sentences in_python(Sentences sentences);

/// What a call from Python asks.
struct PythonRequest : Request {
  std::shared_ptr<Session> session;  ///< in the place of `device`
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

/// The session, or where there is none, one that is nobody else's: of the device of this name, see
/// Device::open(). Throws Error.
inline std::shared_ptr<Session> session_on(const std::shared_ptr<Session>& session,
                                           const std::string& name) {
  return session ? session : std::make_shared<Session>(Device::open(name));
}

/// Runs `work(job, call)` on the request's device, as run() does.
template <typename F>
auto run_job(nb::handle recordings, const PythonRequest& request, const Progress& progress,
             F work) {
  return run({}, progress,
             [given = given_recordings(recordings), request, work = std::move(work)](Call& call) {
               const Request completed = complete(request);
               std::vector<Recording> read = read_recordings(given);
               const auto session = session_on(request.session, completed.device);
               auto lock = session->lock(call);
               return work(RecognitionJob(completed, std::move(read), {},
                                          [&]() -> Device& { return lock.device(); }),
                           call);
             });
}

}  // namespace palpate::python
