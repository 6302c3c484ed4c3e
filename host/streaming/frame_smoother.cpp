#include "streaming/frame_smoother.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

namespace {

// Bounds memory and work where times do not advance; more frames would hardly improve the mean.
constexpr std::size_t most_frames = 256;

double median(double a, double b, double c) {
  return std::max(std::min(a, b), std::min(std::max(a, b), c));
}

}  // namespace

const std::vector<double>& FrameSmoother::add(double time_s, const std::vector<double>& pressure) {
  append(time_s, pressure);
  while (window_.size() > 1 &&
         (window_.size() > most_frames || window_.front().time_s <= time_s - smooth_s_)) {
    spare_.push_back(std::move(window_.front().values));
    window_.pop_front();
  }
  take_means(time_s);
  return mean_;
}

void FrameSmoother::append(double time_s, const std::vector<double>& pressure) {
  const std::size_t e = pressure.size();
  recent_.resize(e);
  std::vector<double> middle;
  if (!spare_.empty()) {
    middle = std::move(spare_.back());
    spare_.pop_back();
  }
  middle.assign(e, std::numeric_limits<double>::quiet_NaN());
  bool whole = true;
  for (std::size_t i = 0; i < e; ++i) {
    if (std::isnan(pressure[i])) {
      whole = false;
      continue;
    }
    Recent& recent = recent_[i];
    if (recent.count == 0) {
      recent.readings.fill(pressure[i]);  // stands in for the missing readings
    }
    recent.readings[recent.count++ % 3] = pressure[i];
    recent.last_s = time_s;
    middle[i] = median(recent.readings[0], recent.readings[1], recent.readings[2]);
  }
  window_.push_back({.time_s = time_s, .values = std::move(middle), .whole = whole});
}

// Sums anew for every frame: in a running sum, the rounding of a single reading of 1e20 would
// exceed any pressure until the sensor is stopped.
void FrameSmoother::take_means(double time_s) {
  const std::size_t e = recent_.size();
  sum_.assign(e, 0.0);
  known_.assign(e, 0.0);
  mean_.resize(e, 0.0);
  double whole = 0.0;
  for (const Medians& medians : window_) {
    if (medians.whole) {
      // Nearly all frames are whole; this loop takes a third of the other loop's time.
      for (std::size_t i = 0; i < e; ++i) {
        sum_[i] += medians.values[i];
      }
      whole += 1.0;
    } else {
      for (std::size_t i = 0; i < e; ++i) {
        const bool known = !std::isnan(medians.values[i]);
        sum_[i] += known ? medians.values[i] : 0.0;
        known_[i] += known ? 1.0 : 0.0;
      }
    }
  }
  for (std::size_t i = 0; i < e; ++i) {
    if (const double known = whole + known_[i]; known > 0.0) {
      mean_[i] = sum_[i] / known;
    } else if (recent_[i].count == 0 || time_s - recent_[i].last_s > largest_gap_s_) {
      mean_[i] = 0.0;
    }
  }
}

void FrameSmoother::reset() {
  while (!window_.empty()) {
    spare_.push_back(std::move(window_.front().values));
    window_.pop_front();
  }
  recent_.clear();
}

}  // namespace palpate
