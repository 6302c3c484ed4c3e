#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "recognition/recognition_record.hpp"
#include "request.hpp"

namespace palpate::python {

/// Recordings as a call from Python gives them: files, or recordings in memory by their place among
/// all.
struct GivenRecordings {
  std::vector<std::string> files;
  std::map<std::size_t, Recording> in_memory;
  std::size_t size = 0;

  /// Throws Error as read_touch_recordings() does.
  std::vector<Recording> read() const;
};
/// Throws Error where there are none.
GivenRecordings given_recordings(const nb::list& items);

/// What a request is about.
struct Subject {
  Request request;  ///< completed
  std::vector<Recording> recordings;
  std::vector<Unknown> unknowns;  ///< views into the recordings
};
/// Completes the request, reads the recordings, with the scene's array, and selects the unknowns.
/// Throws Error.
Subject subject_of(const GivenRecordings& recordings, const Request& given);

}  // namespace palpate::python
