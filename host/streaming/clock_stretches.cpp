#include "streaming/clock_stretches.hpp"

#include <algorithm>
#include <span>

#include <fmt/format.h>

#include "io/input_file.hpp"

namespace palpate {

namespace {

constexpr double between_s = 10.0;

/// The times of a table, and where they step back.
struct TableClock {
  const std::string& path;
  std::vector<double>& time_s;
  const std::vector<ClockStep>& steps;

  /// The times of the stretch, from 0 on.
  std::span<double> stretch(std::size_t k) const {
    const std::size_t begin = k == 0 ? 0 : steps[k - 1].row;
    const std::size_t end = k == steps.size() ? time_s.size() : steps[k].row;
    return std::span(time_s).subspan(begin, end - begin);
  }
};

void require_as_many(const TableClock& clock, const TableClock& other) {
  if (clock.steps.size() > other.steps.size()) {
    const ClockStep& step = clock.steps.front();
    refuse(fmt::format("{}:{}", clock.path, step.line),
           "{} s is earlier than the row before, at {} s, and the clock of {} does not step back "
           "with it; sort the rows by time",
           step.to_s, step.from_s, other.path);
  }
}

}  // namespace

std::vector<std::string> lay_out_stretches(const ImportOptions& options, PressureTable& pressures,
                                           std::optional<PoseTable>& poses) {
  std::vector<TableClock> clocks{{options.pressures, pressures.time_s, pressures.steps}};
  if (poses && !poses->time_s.empty()) {
    clocks.push_back({options.poses, poses->time_s, poses->steps});
    require_as_many(clocks[0], clocks[1]);
    require_as_many(clocks[1], clocks[0]);
  }
  std::vector<std::string> words;
  for (std::size_t k = 1; k <= pressures.steps.size(); ++k) {
    double end_s = clocks[0].stretch(k - 1).back();
    double begin_s = clocks[0].stretch(k).front();
    for (const TableClock& clock : clocks) {
      end_s = std::max(end_s, clock.stretch(k - 1).back());
      begin_s = std::min(begin_s, clock.stretch(k).front());
    }
    for (const TableClock& clock : clocks) {
      for (double& time_s : clock.stretch(k)) {
        time_s += end_s + between_s - begin_s;
      }
    }
    const ClockStep& step = pressures.steps[k - 1];
    words.push_back(fmt::format(
        "{}:{}: the clock steps back from {} to {} s; a new stretch begins there, {} s after the "
        "last",
        options.pressures, step.line, step.from_s, step.to_s, between_s));
  }
  return words;
}

}  // namespace palpate
