#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace palpate {

/// What the elements of a drifting array read untouched, as far as its stream tells by now.
///
/// While the array is untouched, the rest follows the readings with a time constant of a second.
/// Where the array was not untouched for `drift_s`, longer than any press, drift has overtaken the
/// rest: an element's rest is then the lower quintile of what it read meanwhile, in presses and
/// between them. Memory: a hundred readings of each element.
class RestFollower {
 public:
  /// @param rest [e]; empty: zeros
  /// @param drift_s 0: the rest stays
  /// @param lowest how far below the rest a reading counts at most, so that wild ones do not become
  /// the rest
  RestFollower(std::vector<double> rest, double drift_s, double lowest)
      : rest_(std::move(rest)), drift_s_(drift_s), lowest_(lowest) {}

  const std::vector<double>& rest() const { return rest_; }
  void resize(std::size_t elements) { rest_.resize(elements, 0.0); }

  /// Takes smoothed pressures of the untouched array, [e] above the rest.
  void follow(std::span<const double> pressure, double elapsed_s) {
    if (drift_s_ <= 0.0) {
      return;
    }
    constexpr double time_constant_s = 1.0;
    const double part = std::clamp(elapsed_s / time_constant_s, 0.0, 1.0);
    for (std::size_t i = 0; i < rest_.size(); ++i) {
      rest_[i] += part * std::max(pressure[i], -lowest_);
    }
    forget();
  }

  /// Takes smoothed pressures of the touched array, [e] above the rest.
  /// @returns whether the rest was learned anew
  bool keep(std::span<const double> pressure, double elapsed_s) {
    if (drift_s_ <= 0.0) {
      return false;
    }
    touched_s_ += std::max(elapsed_s, 0.0);
    if (touched_s_ >= static_cast<double>(kept_) * drift_s_ / most_kept) {
      for (std::size_t i = 0; i < rest_.size(); ++i) {
        readings_.push_back(static_cast<float>(rest_[i] + pressure[i]));
      }
      ++kept_;
    }
    if (touched_s_ < drift_s_) {
      return false;
    }
    std::vector<float> values(kept_);
    for (std::size_t i = 0; i < rest_.size(); ++i) {
      for (std::size_t k = 0; k < kept_; ++k) {
        values[k] = readings_[k * rest_.size() + i];
      }
      const auto low = values.begin() + static_cast<std::ptrdiff_t>(kept_ / 5);
      std::nth_element(values.begin(), low, values.end());
      rest_[i] = *low;
    }
    forget();
    return true;
  }

  /// Forgets what was read in the touch under way.
  void forget() {
    touched_s_ = 0.0;
    kept_ = 0;
    readings_.clear();
  }

 private:
  static constexpr double most_kept = 100.0;

  std::vector<double> rest_;
  double drift_s_;
  double lowest_;
  double touched_s_ = 0.0;
  std::size_t kept_ = 0;
  std::vector<float> readings_;  ///< [kept, e]
};

}  // namespace palpate
