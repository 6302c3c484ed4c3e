#include "io/recording_reader.hpp"

#include <algorithm>
#include <cstring>
#include <string>
#include <system_error>
#include <type_traits>
#include <vector>

#include "io/forked_child.hpp"
#include "io/hdf5_handle.hpp"
#include "io/hdf5_process.hpp"
#include "model/printable.hpp"
#include "palpate/error.hpp"
#include "palpate/files.hpp"

namespace palpate {

namespace {

using namespace std::chrono_literals;

/// Files beyond this have a child of their own: its cost is small beside theirs, and the limits
/// below need not allow for them.
constexpr std::uint64_t most_file_bytes = 16 << 20;
constexpr std::uint64_t child_bytes = 512 << 20;
/// CPU time for one file, whose reading takes milliseconds.
constexpr std::uint64_t file_cpu_seconds = 5;
/// At 1 MB/s, the rate of the slowest disk that is worth waiting for, the largest file takes 16 s.
constexpr auto silence = 90s;
/// A path, a label or a unit is shorter.
constexpr std::uint64_t most_text_bytes = 1 << 20;

static_assert(std::is_trivially_copyable_v<Pose> && std::is_trivially_copyable_v<glm::dvec2>);

enum class Answer : std::uint8_t { recording, input_fault, system_fault };

void send(ForkedSender& sender, const Recording& recording) {
  const bool known = recording.truth.has_value();
  sender.list(recording.object);
  sender.list(recording.pressure_unit);
  sender.list(recording.rows);
  sender.list(recording.T_robot_sensor);
  sender.list(recording.pressure);
  sender.list(recording.elements_mm);
  sender.list(recording.valid);
  sender.list(known ? recording.truth->object : std::string());
  sender.list(known ? std::vector{recording.truth->T_object_robot} : std::vector<Pose>{});
}

/// Whether the sizes are those of a recording, and its texts are texts.
bool is_whole(const Recording& recording) {
  const std::size_t all = recording.pressure.size();
  const std::size_t e = recording.elements();
  const auto fits = [&](std::size_t count) { return count == e || count == all; };
  return all > 0 && all == e * recording.size() && fits(recording.elements_mm.size()) &&
         (recording.valid.empty() || fits(recording.valid.size())) &&
         is_printable(recording.object) &&
         (!recording.truth || is_printable(recording.truth->object)) &&
         (recording.pressure_unit == "kPa" || recording.pressure_unit == "raw") &&
         (recording.rows == "touches" || recording.rows == "frames");
}

/// In the child: reads here, and once more as the command does where that fails, for its words.
Recording read_twice(const std::string& path) {
  try {
    read_hdf5_in_children(false);
    return read_recording(path);
  } catch (const Error&) {
    read_hdf5_in_children(true);
    return read_recording(path);
  }
}

/// In the child: answers paths with recordings or with what is wrong with them.
void serve(int socket) {
  // The fork took place while its thread held this mutex, and that thread lives on as this one.
  hdf5_mutex.unlock();
  for (;;) {
    std::uint64_t size = 0;
    forked_read(socket, &size, sizeof size);  // ends the child after the last path
    std::string path(size, '\0');
    forked_read(socket, path.data(), size);
    allow_cpu_seconds(file_cpu_seconds);
    ForkedSender sender(socket);
    try {
      const Recording recording = read_twice(path);
      sender.value(Answer::recording);
      send(sender, recording);
    } catch (const Error& error) {
      const bool input = error.fault() == Fault::input;
      sender.value(input ? Answer::input_fault : Answer::system_fault);
      sender.list(std::string(error.what()));
    }
    sender.flush();
  }
}

/// Receives a recording without its path; false where the child fails. Nothing is trusted: a
/// damaged file may have corrupted the child's memory.
bool receive(ForkedChild& child, Recording& recording) {
  std::string true_object;
  std::vector<Pose> true_pose;
  const bool received = child.list(recording.object, most_text_bytes) &&
                        child.list(recording.pressure_unit, most_text_bytes) &&
                        child.list(recording.rows, most_text_bytes) &&
                        child.list(recording.T_robot_sensor, child_bytes) &&
                        child.list(recording.pressure, child_bytes) &&
                        child.list(recording.elements_mm, child_bytes) &&
                        child.list(recording.valid, child_bytes) &&
                        child.list(true_object, most_text_bytes) &&
                        child.list(true_pose, child_bytes) && true_pose.size() <= 1;
  if (received && !true_pose.empty()) {
    recording.truth = Truth{std::move(true_object), true_pose.front()};
  }
  return received && is_whole(recording);
}

}  // namespace

RecordingReader::RecordingReader() {
  if (reads_hdf5_in_children()) {
    fork_child();
  }
}

RecordingReader::~RecordingReader() = default;

void RecordingReader::fork_child() {
  initialise_hdf5();
  child_ = std::make_unique<ForkedChild>(
      serve,
      ForkedLimits{
          .cpu_seconds = file_cpu_seconds, .memory_bytes = child_bytes, .silence = silence},
      hdf5_mutex);
}

Recording RecordingReader::read(const std::filesystem::path& path) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  if (!error && bytes <= most_file_bytes && reads_hdf5_in_children()) {
    if (std::optional<Recording> recording = read_in_child(path)) {
      return *std::move(recording);
    }
    child_.reset();  // its memory may be damaged
  }
  return read_recording(path);
}

std::optional<Recording> RecordingReader::read_in_child(const std::filesystem::path& path) {
  if (!child_) {
    fork_child();
  }
  const std::string& name = path.native();
  const std::uint64_t size = name.size();
  std::vector<char> request(sizeof size + size);
  std::memcpy(request.data(), &size, sizeof size);
  std::copy(name.begin(), name.end(), request.begin() + sizeof size);
  Answer answer{};
  if (!child_->write(request.data(), request.size()) || !child_->read(&answer, sizeof answer)) {
    return {};
  }
  Recording recording;
  std::string problem;
  switch (answer) {
    case Answer::recording:
      if (receive(*child_, recording)) {
        recording.path = path.string();
        return recording;
      }
      break;
    case Answer::input_fault:
    case Answer::system_fault:
      if (child_->list(problem, most_text_bytes) && is_printable(problem)) {
        throw Error(answer == Answer::input_fault ? Fault::input : Fault::system, problem);
      }
  }
  return {};
}

}  // namespace palpate
