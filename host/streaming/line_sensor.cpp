#include "streaming/line_sensor.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

/// A line of JSON takes fewer bytes for each reading, in full precision and with an indent.
constexpr std::size_t most_bytes_per_reading = 64;

/// A program that never ends its line may not hold up next().
constexpr int most_late = 4;

double now_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace

LineSensor::LineSensor(SensorDescription description, PosedSensor::Complaint complain, int sign)
    : description_(std::move(description)),
      complain_(std::move(complain)),
      sign_(sign),
      format_(description_.elements_mm.size()),
      reader_("frames", "-", 4096 + most_bytes_per_reading * description_.elements_mm.size(),
              [this](const LineReader::Line& line) { take(line); }) {}

std::optional<Frame> LineSensor::next(std::chrono::milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  int late = 0;  // blocks read after the deadline
  while (frames_.empty()) {
    const auto left = std::max(
        0ms, std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()));
    const bool some = reader_.read_some(left);
    if (reader_.ended() && counters_.frames == 0) {
      throw Error(Fault::input,
                  fmt::format("{} ended before the first frame; write frames to it, a line each",
                              reader_.name()));
    }
    if (frames_.empty() && (reader_.ended() || (left == 0ms && (!some || ++late == most_late)))) {
      return {};
    }
  }
  Frame frame = std::move(frames_.front());
  frames_.pop_front();
  return frame;
}

void LineSensor::take(const LineReader::Line& line) {
  using Kind = FrameLines::Problem::Kind;
  if (line.too_long) {
    refuse_line(line, Kind::malformed, "is longer than any frame");
    return;
  }
  auto read = format_.read(line.text, now_s());
  if (const auto* problem = std::get_if<FrameLines::Problem>(&read)) {
    refuse_line(line, problem->kind, problem->words);
  } else if (auto* frame = std::get_if<Frame>(&read)) {
    frame->lost_before = std::exchange(lost_before_, 0);
    for (double& value : frame->values) {
      value *= sign_;
    }
    frames_.push_back(std::move(*frame));
    ++counters_.frames;
  }
}

void LineSensor::refuse_line(const LineReader::Line& line, FrameLines::Problem::Kind kind,
                             const std::string& problem) {
  const std::string text = fmt::format(
      "{}, line {}: {}; write {{\"time\": s, \"pressure\": [{} numbers]}}, or CSV with {} "
      "readings, "
      "behind their time where it is known",
      reader_.name(), line.number, problem, format_.elements(), format_.elements());
  if (counters_.frames == 0) {
    throw Error(Fault::input, text);
  }
  ++refused_;
  ++lost_before_;
  ++counters_.lost;
  if (first_refused_.empty()) {
    first_refused_ = text;
  }
  if (complain_ && !told_[static_cast<std::size_t>(kind)]) {
    complain_(text);
  }
  told_.set(static_cast<std::size_t>(kind));
}

}  // namespace palpate
