#include "palpate/sensor.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

namespace {

// Returns the median; reorders the values.
double median(std::span<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Returns the largest difference between the medians of the four quarters; reorders the values
// within each quarter.
double change_over(std::span<double> values) {
  const std::size_t quarter = values.size() / 4;
  double least = median(values.first(quarter));
  double highest = least;
  for (std::size_t i = 1; i < 4; ++i) {
    const double middle = median(values.subspan(i * quarter, quarter));
    least = std::min(least, middle);
    highest = std::max(highest, middle);
  }
  return highest - least;
}

}  // namespace

std::vector<double> baseline_of(std::span<const Frame> frames, const SensorDescription& sensor,
                                std::optional<double> onset) {
  if (frames.empty()) {
    throw Error(Fault::input, "no frame came for the baseline; is the sensor connected?");
  }
  // With fewer frames, noise alone makes the quarters differ.
  constexpr std::size_t least_frames = 40;
  std::vector<double> baseline(sensor.elements_mm.size(), 0.0);
  for (const Frame& frame : frames) {
    if (frame.values.size() != baseline.size()) {
      throw Error(Fault::input, fmt::format("a frame of the baseline has {} values but the sensor "
                                            "{} elements; take the frames of one array",
                                            frame.values.size(), baseline.size()));
    }
  }
  std::vector<double> values(frames.size());
  for (std::size_t k = 0; k < baseline.size(); ++k) {
    if (!sensor.valid.empty() && sensor.valid[k] == 0) {
      continue;
    }
    std::size_t count = 0;
    for (const Frame& frame : frames) {
      if (is_known(frame.values[k])) {
        values[count++] = frame.values[k];
      }
    }
    if (count == 0) {
      throw Error(Fault::input,
                  fmt::format("element {} reads no number while the baseline is taken; mark it "
                              "dead or repair it",
                              k));
    }
    if (onset && count >= least_frames) {
      const double change = change_over(std::span(values).first(count));
      if (change > *onset) {
        throw Error(Fault::input,
                    fmt::format("the array is touched while its baseline is taken: element {} "
                                "changes by {:.3g} {}; let go of it and try again",
                                k, change, sensor.pressure_unit));
      }
    }
    baseline[k] = median(std::span(values).first(count));
  }
  return baseline;
}

}  // namespace palpate
