#include "cli/press_watch.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <glm/geometric.hpp>

namespace palpate::cli {

namespace {

constexpr std::size_t most_shown = 3;

}  // namespace

void PressWatch::add(const Frame& frame, const std::vector<double>& smoothed, bool touching) {
  first_s_ = first_s_.value_or(frame.host_time_s);
  last_s_ = frame.host_time_s;
  for (const double pressure : smoothed) {
    if (pressure > largest_) {
      largest_ = pressure;
      largest_s_ = last_s_ - *first_s_;
    }
  }
  if (!touching) {
    return;
  }
  pressed_s_ = pressed_s_.value_or(last_s_);
  if (const std::optional<Pose>& pose = frame.T_robot_sensor) {
    first_pose_ = first_pose_.value_or(*pose);
    moved_mm_ =
        std::max(moved_mm_, glm::distance(first_pose_->translation_mm, pose->translation_mm));
  }
}

void PressWatch::end(bool makes_touches) {
  if (!makes_touches && pressed_s_ && missed_++ < most_shown) {
    const std::string press = fmt::format("the press {:.1f} s from its start, of {:.2f} s,",
                                          *pressed_s_ - *first_s_, last_s_ - *pressed_s_);
    words_.push_back(
        moved_mm_ >= options_.steady_mm
            ? fmt::format("{} moved by {:.1f} mm (hold the array still, or give --slide MM)", press,
                          moved_mm_)
            : fmt::format("{} was never steady for {:g} s (press longer, or give another "
                          "--min-steady-s or --steady)",
                          press, options_.min_steady_s));
  }
  pressed_s_.reset();
  first_pose_.reset();
  moved_mm_ = 0.0;
}

std::vector<std::string> PressWatch::reasons(const std::string& unit) const {
  std::vector<std::string> words = words_;
  if (missed_ > most_shown) {
    words.push_back(fmt::format("and {} more presses make no touch", missed_ - most_shown));
  }
  if (missed_ == 0) {
    words.push_back(
        fmt::format("its readings reach {:.3g} {} above their rest, {:.1f} s from its start, and a "
                    "touch begins "
                    "above {:g} (lower --onset)",
                    largest_, unit, largest_s_, options_.onset));
  }
  return words;
}

}  // namespace palpate::cli
