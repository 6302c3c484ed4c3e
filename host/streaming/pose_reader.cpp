#include "streaming/pose_reader.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>

#include <nlohmann/json.hpp>

#include "palpate/error.hpp"

namespace palpate {

namespace {

// Far longer than any pose; what never ends a line must not fill the memory.
constexpr std::size_t longest_line = 4096;
// One read() takes at most this many bytes, and PoseReader::read() this many blocks.
constexpr std::size_t block_bytes = 1 << 14;
constexpr int blocks_at_once = 4;

std::optional<double> number(const nlohmann::json& line, const char* key) {
  const auto found = line.find(key);
  if (found == line.end() || !found->is_number()) {
    return {};
  }
  const double value = found->get<double>();
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

}  // namespace

PoseReader::PoseReader(const std::string& name, PoseTrack& track, PosedSensor::Complaint complain)
    : name_(name == "-" ? "standard input" : name), track_(track), complain_(std::move(complain)) {
  if (name != "-") {
    file_ = Descriptor(name, O_RDONLY | O_NONBLOCK);  // not waiting for the writer of a FIFO
  }
  descriptor_ = name == "-" ? STDIN_FILENO : file_.get();
  struct stat status {};
  if (descriptor_ < 0 || ::fstat(descriptor_, &status) != 0) {
    throw Error(Fault::input, fmt::format("poses {}: cannot be read: {}; give a file, a FIFO or "
                                          "- for standard input",
                                          name, std::strerror(errno)));
  }
  if (S_ISDIR(status.st_mode)) {
    throw Error(Fault::input, fmt::format("poses {}: is a folder; name a file in it", name));
  }
  is_file_ = S_ISREG(status.st_mode);
  is_fifo_ = S_ISFIFO(status.st_mode) && descriptor_ != STDIN_FILENO;
  while (is_file_ && read_some()) {
  }
}

void PoseReader::read() {
  for (int block = 0; block < blocks_at_once && read_some(); ++block) {
  }
}

// Reads one block; false where there is none, or none yet.
bool PoseReader::read_some() {
  char bytes[block_bytes];
  pollfd ready{.fd = descriptor_, .events = POLLIN, .revents = 0};
  if (ended_ || (!is_file_ && ::poll(&ready, 1, 0) <= 0)) {
    return false;
  }
  const ssize_t got = ::read(descriptor_, bytes, sizeof bytes);
  if (got > 0) {
    take({bytes, static_cast<std::size_t>(got)});
    return true;
  }
  if (got < 0 && is_file_) {
    throw Error(Fault::input, fmt::format("poses {}: cannot be read: {}; copy or record it again",
                                          name_, std::strerror(errno)));
  }
  if (got == 0 && !is_fifo_) {  // a FIFO may get another writer
    ended_ = true;
    if (!line_.empty() || overlong_) {
      end_line();
    }
    const std::uint64_t dropped = track_.dropped();
    track_.end();
    judge_order(dropped, track_.set_back());
  }
  return false;
}

void PoseReader::take(std::string_view bytes) {
  while (!bytes.empty()) {
    const std::size_t end = bytes.find('\n');
    const std::string_view part = bytes.substr(0, end);
    if (line_.size() + part.size() > longest_line) {
      overlong_ = true;
    } else {
      line_ += part;
    }
    if (end == std::string_view::npos) {
      return;
    }
    end_line();
    bytes.remove_prefix(end + 1);
  }
}

void PoseReader::end_line() {
  ++lines_;
  const std::string text = std::exchange(line_, {});
  if (std::exchange(overlong_, false)) {
    refuse_line(Flaw::too_long, lines_, "is longer than any pose");
    return;
  }
  if (text.find_first_not_of(" \t\r") == std::string::npos) {
    return;
  }
  const nlohmann::json line = nlohmann::json::parse(text, nullptr, false);
  if (!line.is_object()) {
    refuse_line(Flaw::no_json, lines_, "is no JSON object");
    return;
  }
  std::vector<double> numbers;
  for (const char* key : {"time", "x_mm", "y_mm", "theta_rad"}) {
    const std::optional<double> found = number(line, key);
    if (!found) {
      refuse_line(Flaw::no_number, lines_, fmt::format("has no number '{}'", key));
      return;
    }
    numbers.push_back(*found);
  }
  const Pose T_robot_sensor{{numbers[1], numbers[2]}, numbers[3]};
  if (!is_robot_pose(T_robot_sensor)) {
    refuse_line(Flaw::far_away, lines_,
                fmt::format("x_mm = {}, y_mm = {}, theta_rad = {}: no robot is further away than "
                            "1e9 mm, or has turned by more than 1e9 rad",
                            numbers[1], numbers[2], numbers[3]));
    return;
  }
  add(numbers[0], T_robot_sensor);
}

void PoseReader::add(double time_s, const Pose& T_robot_sensor) {
  const std::uint64_t dropped = track_.dropped();
  const std::uint64_t set_back = track_.set_back();
  const double before_s = track_.last_s().value_or(time_s);
  ++poses_;
  track_.add(time_s, T_robot_sensor);
  judge_order(dropped, set_back);
  if (track_.set_aside() == 1) {
    aside_ = {.line = lines_, .time_s = time_s, .before_s = before_s};
  }
}

// Reports what the track did with the poses that it had set aside.
void PoseReader::judge_order(std::uint64_t dropped_before, std::uint64_t set_back_before) {
  const bool early = aside_.time_s <= aside_.before_s;
  if (track_.dropped() != dropped_before) {
    refuse_line(Flaw::out_of_order, aside_.line,
                fmt::format("time = {} s is {} the poses around it, at {} s", aside_.time_s,
                            early ? "not later than" : "far later than", aside_.before_s));
  }
  if (track_.set_back() != set_back_before) {
    const std::string problem = fmt::format(
        "time = {} s is not later than the pose before, at {} s, and the poses after "
        "it go on from there: the robot's clock was set",
        aside_.time_s, aside_.before_s);
    refuse_line(Flaw::clock_set_back, aside_.line, problem);
  }
}

void PoseReader::refuse_line(Flaw flaw, std::uint64_t line, std::string_view problem) {
  const std::string text = fmt::format(
      "{}, line {}: {}; write {{\"time\": s, \"x_mm\": mm, \"y_mm\": mm, \"theta_rad\": rad}}",
      name_, line, problem);
  if (is_file_) {
    throw Error(Fault::input, text);
  }
  malformed_ += flaw < Flaw::out_of_order ? 1 : 0;  // the track counts the others
  if (first_refused_.empty() &&
      flaw != Flaw::clock_set_back) {  // those poses have joined the track
    first_refused_ = text;
  }
  const auto kind = static_cast<std::size_t>(flaw);
  if (complain_ && !told_[kind]) {
    complain_("poses " + text);
  }
  told_[kind] = true;
}

}  // namespace palpate
