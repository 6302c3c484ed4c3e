#include "cli/endless_touch.hpp"

#include <fmt/format.h>

#include "model/elements_that.hpp"

namespace palpate::cli {

void EndlessTouch::add(const Frame& frame, const TouchDetector& detector) {
  ++frames_;
  time_.advance(frame.host_time_s);
  const std::vector<double>& pressure = detector.smoothed();
  held_.resize(pressure.size(), 0);
  for (std::size_t i = 0; i < pressure.size(); ++i) {
    held_[i] = pressure[i] < release_ ? 0 : held_[i] + 1;
  }
  if (detector.touching()) {
    onset_s_ = touched_ == 0 ? time_.elapsed_s() : onset_s_;
    ++touched_;
  } else {
    released_before_ = released_before_ || touched_ > 0;
    touched_ = 0;
  }
}

std::string EndlessTouch::complaint(const std::string& pressure_unit,
                                    const std::string& remedy) const {
  const double part = released_before_ ? 0.5 : 0.9;
  if (static_cast<double>(touched_) <= part * static_cast<double>(frames_)) {
    return "";
  }
  std::vector<std::size_t> held;
  for (std::size_t i = 0; i < held_.size(); ++i) {
    if (held_[i] >= touched_) {
      held.push_back(i);
    }
  }
  const std::string below =
      fmt::format("below {:.4g} {} from {:.2f} s on", release_, pressure_unit, onset_s_);
  // Where most elements are held, the whole array reads too much.
  if (held.empty() || 2 * held.size() > held_.size()) {
    return fmt::format("the array never reads {}, so that its touch does not end; {}", below,
                       remedy);
  }
  return fmt::format(
      "{} {}, so that the touch does not end; mark broken elements dead in 'valid', or {}",
      elements_that(held, "never reads", "never read"), below, remedy);
}

}  // namespace palpate::cli
