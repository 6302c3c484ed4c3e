#include "streaming/line_sensor.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include <fmt/format.h>

#include "io/csv_cells.hpp"
#include "model/printable.hpp"
#include "model/stream_time.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

/// A line of JSON takes fewer bytes for each reading, in full precision and with an indent.
constexpr std::size_t most_bytes_per_reading = 64;

/// A program that never ends its line may not hold up next().
constexpr int most_late = 4;

}  // namespace

LineSensor::LineSensor(SensorDescription description, PosedSensor::Warn warn, int sign)
    : description_(std::move(description)),
      warn_(std::move(warn)),
      sign_(sign),
      format_(description_.elements_mm.size()),
      flaws_(warn_),
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
      throw Error(
          Fault::input,
          before_ > 0
              ? flaw_before_
              : fmt::format("{} ended before the first frame; write frames to it, a line each",
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
  if (line.too_long) {
    refuse_line(line, {FrameLines::Flaw::Kind::too_long, "is longer than any frame"});
    return;
  }
  const double read_s = host_clock_s();
  auto read = format_.read(line.text, read_s);
  if (std::holds_alternative<FrameLines::Flaw>(read) && counters_.frames == 0) {
    format_ = FrameLines(format_.elements());  // what looked like a header was a greeting
    if (std::exchange(has_header_, false)) {
      ++before_;
      read = format_.read(line.text, read_s);
    }
  }
  if (const auto* flaw = std::get_if<FrameLines::Flaw>(&read)) {
    if (!may_stand_before(line, *flaw)) {
      refuse_line(line, *flaw);
    }
  } else if (auto* frame = std::get_if<Frame>(&read)) {
    say_first(read_s, frame->host_time_s);
    frame->lost_before = std::exchange(lost_before_, 0);
    for (double& value : frame->values) {
      value *= sign_;
    }
    frames_.push_back(std::move(*frame));
    ++counters_.frames;
  } else {
    has_header_ = true;
  }
}

/// Leaves out a line before the first frame that a board prints as it starts.
bool LineSensor::may_stand_before(const LineReader::Line& line, const FrameLines::Flaw& flaw) {
  constexpr std::uint64_t limit = 100;
  const bool is_cut = line.number == 1 && !trimmed(line.text).starts_with('{');
  if (counters_.frames > 0 || before_ == limit || format_.names_columns(line.text) ||
      !(is_cut || FrameLines::is_text(line.text))) {
    return false;
  }
  format_ = FrameLines(format_.elements());  // numbers among the words are no columns
  if (before_++ == 0) {
    constexpr std::size_t enough = 60;
    first_before_ = printable(trimmed(line.text).substr(0, enough));
    flaw_before_ = words_about(line, flaw);
  }
  return true;
}

/// Says once what was left out before the first frame, and where times are in no seconds.
void LineSensor::say_first(double now_s, double time_s) {
  if (!warn_) {
    return;
  }
  if (counters_.frames == 0 && before_ > 0) {
    warn_(fmt::format("{}: {} before the first frame {} left out{}", reader_.name(),
                      before_ == 1 ? "a line" : fmt::format("{} lines", before_),
                      before_ == 1 ? "is" : "are",
                      first_before_.empty() ? "" : fmt::format(": '{}'", first_before_)));
  }
  constexpr std::size_t enough = 20;
  constexpr double latest_s = 1e11;
  if (time_s == now_s || first_s_.size() == enough) {
    return;
  }
  first_s_.push_back(time_s);
  if (first_s_.size() < enough) {
    return;
  }
  // Times since 1970 show their unit by their size, others by how far frames lie apart.
  const double step_s = (first_s_.back() - first_s_.front()) / static_cast<double>(enough - 1);
  if (time_s > latest_s || step_s > 2.0) {
    const double per_s = time_s > latest_s ? time_s / latest_s : step_s;
    warn_(fmt::format(
        "{}: its frames are {:.3g} s apart by their times, which look like {}; write seconds",
        reader_.name(), step_s,
        per_s >= 1e6   ? "nanoseconds"
        : per_s >= 1e3 ? "microseconds"
                       : "milliseconds"));
  }
}

std::string LineSensor::words_about(const LineReader::Line& line,
                                    const FrameLines::Flaw& flaw) const {
  return fmt::format(
      "{}, line {}: {}; write {{\"time\": s, \"pressure\": [{} numbers]}}, or CSV with {} "
      "readings, behind their time where it is known",
      reader_.name(), line.number, flaw.words, format_.elements(), format_.elements());
}

void LineSensor::refuse_line(const LineReader::Line& line, const FrameLines::Flaw& flaw) {
  const std::string text = words_about(line, flaw);
  if (counters_.frames == 0) {
    throw Error(Fault::input, text);
  }
  ++lost_before_;
  ++counters_.lost;
  flaws_.add(flaw.kind, text);
}

}  // namespace palpate
