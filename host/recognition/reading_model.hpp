#pragma once

#include <cstddef>
#include <vector>

#include "palpate/contact_model.hpp"

namespace palpate {

/// How often a living element reads each class at a place of given smooth occupancy (see
/// SmoothOccupancy): No Contact, every level of In Contact, and Unknown. Learned from the touches
/// themselves: probabilities at nodes, linear between them. Eq. 7 leaves Unknown out, though that
/// is what elements at an object's edge read; under it the largest evidence is at standard
/// deviations that are too small.
class ReadingModel {
 public:
  /// Starts with the contact model's likelihoods, normalised, and Unknown as likely everywhere.
  /// @param contact with a prior
  explicit ReadingModel(const ContactModel& contact);

  std::size_t classes() const { return classes_; }
  /// Log-probability of a class, which is below classes(), in nats.
  /// @param occupancy from 0 to 1
  double log_probability(std::size_t reading, double occupancy) const {
    const auto part = static_cast<std::size_t>(occupancy * static_cast<double>(parts_));
    return log_p_[reading * parts_ + (part < parts_ ? part : parts_ - 1)];
  }

  /// Expected numbers of readings, [class, node].
  using Counts = std::vector<double>;
  Counts no_counts() const { return Counts(classes_ * nodes_); }
  void count(Counts& counts, std::size_t reading, double occupancy, double weight) const;
  /// Takes the relative frequencies, with what it started with as a few readings more at each node.
  void learn(const Counts& counts);

 private:
  void tabulate(const std::vector<double>& probability);

  static constexpr std::size_t nodes_ = 33;
  static constexpr std::size_t parts_ = 2048;
  std::size_t classes_;        ///< Unknown is the last
  std::vector<double> start_;  ///< probabilities, [class, node]
  std::vector<float> log_p_;   ///< [class, part of the occupancy], at the middle of each part
};

}  // namespace palpate
