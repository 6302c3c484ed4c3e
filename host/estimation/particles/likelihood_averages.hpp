#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace palpate {

/// Augmented MCL's two running averages of the likelihood (Thrun, Burgard and Fox 2005, Table 8.3).
/// The likelihood of a touch is the product over its known elements, 1e-20 and less, and differs by
/// orders with their number; its geometric mean per element is comparable between touches.
class LikelihoodAverages {
 public:
  LikelihoodAverages(double alpha_slow, double alpha_fast)
      : alpha_slow_(alpha_slow), alpha_fast_(alpha_fast) {}

  /// @param log_mean_weight log of the particles' mean likelihood of the touch
  void add(double log_mean_weight, std::size_t known_elements) {
    const double average = std::exp(log_mean_weight / static_cast<double>(known_elements));
    slow_ = started_ ? slow_ + alpha_slow_ * (average - slow_) : average;
    fast_ = started_ ? fast_ + alpha_fast_ * (average - fast_) : average;
    started_ = true;
  }
  /// The chance that a new particle is a random one.
  double injected() const { return slow_ > 0.0 ? std::max(0.0, 1.0 - fast_ / slow_) : 0.0; }

 private:
  double alpha_slow_;
  double alpha_fast_;
  bool started_ = false;
  double slow_ = 0.0;
  double fast_ = 0.0;
};

}  // namespace palpate
