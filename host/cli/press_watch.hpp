#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "palpate/touch_detector.hpp"

namespace palpate::cli {

/// Watches the presses of a stream for what keeps them from being touches.
class PressWatch {
 public:
  explicit PressWatch(const TouchDetectorOptions& options) : options_(options) {}

  /// @param smoothed what the detector judges the frame by
  void add(const Frame& frame, const std::vector<double>& smoothed, bool touching);
  /// Takes the end of a press, and whether it makes touches.
  void end(bool makes_touches);

  std::size_t missed() const { return missed_; }
  /// Why no press made a touch, and what to give, in sentences.
  /// @param unit of the pressures
  std::vector<std::string> reasons(const std::string& unit) const;

 private:
  TouchDetectorOptions options_;
  std::optional<double> first_s_;    ///< of the stream
  std::optional<double> pressed_s_;  ///< when the press under way began
  double last_s_ = 0.0;
  std::optional<Pose> first_pose_;  ///< of the press under way
  double moved_mm_ = 0.0;           ///< from it, at most
  double largest_ = 0.0;            ///< pressure above the rest
  double largest_s_ = 0.0;          ///< when, from the first frame on
  std::size_t missed_ = 0;
  std::vector<std::string> words_;  ///< of the first presses without a touch
};

}  // namespace palpate::cli
