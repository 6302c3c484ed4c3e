#include "given_recordings.hpp"

#include <utility>

#include <fmt/format.h>

#include "palpate/error.hpp"
#include "recognition/recordings.hpp"
#include "touches.hpp"

namespace palpate::python {

std::vector<Recording> GivenRecordings::read() const {
  std::vector<Recording> read_files = read_touch_recordings(files);
  std::vector<Recording> all;
  auto file = read_files.begin();
  for (std::size_t i = 0; i < size; ++i) {
    const auto given = in_memory.find(i);
    all.push_back(given == in_memory.end() ? std::move(*file++) : given->second);
    require_touches(all.back(), all.front());
  }
  return all;
}

GivenRecordings given_recordings(const nb::list& items) {
  GivenRecordings recordings;
  for (const nb::handle item : items) {
    const ArrayRecording* recording = nullptr;
    if (nb::try_cast(item, recording) && recording != nullptr) {
      Recording copy = recording->copied();
      if (copy.path.empty()) {
        copy.path = fmt::format("recordings[{}]", recordings.size);
      }
      recordings.in_memory.emplace(recordings.size, std::move(copy));
    } else {
      recordings.files.push_back(nb::borrow<PathLike>(item).text());
    }
    ++recordings.size;
  }
  if (recordings.size == 0) {
    throw Error(Fault::input, "recordings: none; give a Recording or a file");
  }
  return recordings;
}

Subject subject_of(const GivenRecordings& recordings, const Request& given) {
  Subject subject{complete(given), recordings.read(), {}};
  for (Recording& recording : subject.recordings) {
    replace_array(subject.request, recording.path, recording.elements(), recording.elements_mm);
  }
  subject.unknowns = list_unknowns(subject.request, subject.recordings);
  return subject;
}

}  // namespace palpate::python
