#include "frame_smoother.hpp"

#include <algorithm>

namespace palpate {

namespace {

// Bounds the memory where times do not advance; more would not make the mean much better.
constexpr std::size_t most_frames = 256;

double median(double a, double b, double c) {
  return std::max(std::min(a, b), std::min(std::max(a, b), c));
}

}  // namespace

const std::vector<double>& FrameSmoother::add(double time_s, const std::vector<double>& pressure) {
  recent_[frames_ % 3] = pressure;
  ++frames_;
  append(time_s);
  while (window_.size() > most_frames || window_.front().first <= time_s - smooth_s_) {
    if (window_.size() == 1) {
      break;
    }
    drop_oldest();
  }
  const double scale = 1.0 / static_cast<double>(window_.size());
  for (std::size_t i = 0; i < sum_.size(); ++i) {
    mean_[i] = scale * sum_[i];
  }
  return mean_;
}

void FrameSmoother::append(double time_s) {
  const std::size_t e = recent_[0].size();
  sum_.resize(e, 0.0);
  mean_.resize(e);
  std::vector<double> middle;
  if (!spare_.empty()) {
    middle = std::move(spare_.back());
    spare_.pop_back();
  }
  middle.resize(e);
  // Before the third frame the first stands for those that are missing.
  const std::vector<double>& a = recent_[0];
  const std::vector<double>& b = recent_[frames_ < 2 ? 0 : 1];
  const std::vector<double>& c = recent_[frames_ < 3 ? 0 : 2];
  for (std::size_t i = 0; i < e; ++i) {
    middle[i] = median(a[i], b[i], c[i]);
    sum_[i] += middle[i];
  }
  window_.emplace_back(time_s, std::move(middle));
}

void FrameSmoother::drop_oldest() {
  std::vector<double>& oldest = window_.front().second;
  for (std::size_t i = 0; i < sum_.size(); ++i) {
    sum_[i] -= oldest[i];
  }
  spare_.push_back(std::move(oldest));
  window_.pop_front();
}

void FrameSmoother::reset() {
  frames_ = 0;
  while (!window_.empty()) {
    spare_.push_back(std::move(window_.front().second));
    window_.pop_front();
  }
  std::fill(sum_.begin(), sum_.end(), 0.0);  // without what rounding left in it
}

}  // namespace palpate
