#include "reading_model.hpp"

#include <algorithm>
#include <cmath>

#include "predicted_readings.hpp"

namespace palpate {

ReadingModel::ReadingModel(std::span<const Hypothesis> objects, const ContactModel& contact, std::size_t strata)
    : classes_(reading_levels(contact) + 1), strata_(strata), first_(0.0), fine_per_nat_(1.0) {
  // All but the most certain cells: few readings would fall between nodes far apart.
  std::vector<float> log_odds;
  for (const Hypothesis& object : objects) {
    log_odds.insert(log_odds.end(), object.map.log_odds.begin(), object.map.log_odds.end());
  }
  std::sort(log_odds.begin(), log_odds.end());
  const std::size_t tail = log_odds.size() / 50;
  const double prior = log_odds_from_probability(contact.prior.value());
  constexpr double least = 4.0;  // nats about the prior, also for a map of one value
  first_ = std::min(static_cast<double>(log_odds[tail]), prior - least);
  const double last =
      std::max(static_cast<double>(log_odds[log_odds.size() - 1 - tail]), prior + least);
  fine_per_nat_ = last_place_ / (last - first_);

  constexpr double unknown = 0.1;
  start_.resize(classes_ * nodes_, unknown);
  for (std::size_t node = 0; node < nodes_; ++node) {
    const MapSample sample{first_ + static_cast<double>(node * fine_per_node_) / fine_per_nat_};
    double sum = 0.0;
    for (std::size_t level = 0; level + 1 < classes_; ++level) {
      sum += start_[level * nodes_ + node] =
          std::exp(contact.log_likelihood(static_cast<Reading>(level), sample));
    }
    for (std::size_t level = 0; level + 1 < classes_; ++level) {
      start_[level * nodes_ + node] *= (1.0 - unknown) / sum;
    }
  }
  const std::vector<double> one(start_);
  while (start_.size() < strata_ * one.size()) start_.insert(start_.end(), one.begin(), one.end());
  tabulate(start_);
}

void ReadingModel::tabulate(const std::vector<double>& probability) {
  log_p_.clear();
  for (std::size_t c = 0; c < strata_ * classes_; ++c) {
    for (std::size_t i = 0; i < fine_; ++i) {
      const std::size_t node = std::min(i / fine_per_node_, nodes_ - 2);
      const double* at = &probability[c * nodes_ + node];
      const double part = static_cast<double>(i - node * fine_per_node_) / fine_per_node_;
      log_p_.push_back(static_cast<float>(std::log(std::lerp(at[0], at[1], part))));
    }
  }
}

void ReadingModel::count(Counts& counts, std::size_t reading, double log_odds,
                         double weight) const {
  const double place = std::clamp((log_odds - first_) * fine_per_nat_, 0.0, last_place_) /
                       static_cast<double>(fine_per_node_);
  const std::size_t node = std::min(static_cast<std::size_t>(place), nodes_ - 2);
  const double part = place - static_cast<double>(node);
  counts[reading * nodes_ + node] += weight * (1.0 - part);
  counts[reading * nodes_ + node + 1] += weight * part;
}

void ReadingModel::learn(const Counts& counts) {
  constexpr double known_before = 2.0;  // readings
  std::vector<double> probability(start_);
  for (std::size_t s = 0; s < strata_; ++s)
  for (std::size_t node = 0; node < nodes_; ++node) {
    double sum = known_before;
    for (std::size_t c = s * classes_; c < (s + 1) * classes_; ++c) {
      sum += counts[c * nodes_ + node];
    }
    for (std::size_t c = s * classes_; c < (s + 1) * classes_; ++c) {
      double& p = probability[c * nodes_ + node];
      p = (known_before * p + counts[c * nodes_ + node]) / sum;
    }
  }
  tabulate(probability);
}

}  // namespace palpate
