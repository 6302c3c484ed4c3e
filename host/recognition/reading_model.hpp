#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "palpate/contact_model.hpp"
#include "palpate/estimate.hpp"

namespace palpate {

/// How often a living element reads each class at a place of given log odds: No Contact, every
/// level of In Contact, and Unknown. Eq. 7 leaves Unknown out, though Unknown is what elements at an
/// object's edge read; where the touches lie is then known less well than it could be, and sd comes
/// out too small. This model is learned from the touches themselves: probabilities at nodes, linear
/// between them, constant beyond.
class ReadingModel {
 public:
  /// Starts with the contact model's likelihoods, normalised, and Unknown as likely everywhere.
  /// @param contact with a prior
  ReadingModel(std::span<const Hypothesis> objects, const ContactModel& contact, std::size_t strata);

  std::size_t classes() const { return classes_; }
  std::size_t strata() const { return strata_; }
  /// Log-probability of a class, which is below classes(), in nats.
  double log_probability(std::size_t reading, double log_odds) const {
    const double place = (log_odds - first_) * fine_per_nat_;
    const double within = place < 0.0 ? 0.0 : place > last_place_ ? last_place_ : place;
    return log_p_[reading * fine_ + static_cast<std::size_t>(within + 0.5)];
  }

  /// Expected numbers of readings, [class, node].
  using Counts = std::vector<double>;
  Counts no_counts() const { return Counts(strata_ * classes_ * nodes_); }
  void count(Counts& counts, std::size_t reading, double log_odds, double weight) const;
  /// Takes the relative frequencies, with what it started with as a few readings more at each node.
  void learn(const Counts& counts);

 private:
  void tabulate(const std::vector<double>& probability);

  static constexpr std::size_t nodes_ = 33;
  static constexpr std::size_t fine_per_node_ = 64;
  static constexpr std::size_t fine_ = (nodes_ - 1) * fine_per_node_ + 1;
  std::size_t classes_;  ///< Unknown is the last
  std::size_t strata_;
  double first_;         ///< log odds of the first node
  double fine_per_nat_;
  double last_place_ = static_cast<double>(fine_ - 1);
  std::vector<double> start_;  ///< probabilities, [class, node]
  std::vector<float> log_p_;   ///< [class, fine node]
};

}  // namespace palpate
