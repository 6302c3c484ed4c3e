#include "estimation/bounded/leaves/reading_form.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {

/// Below it float32 would have to take out powers of two at every third element or oftener.
constexpr double least_ratio = 0x1p-30;
/// Stands for log 0: below all sums of log odds, and within float32.
constexpr double log_zero = -1e38;

/// Elements whose numerators, in [ratio, 2], and denominators, in [1, 2], a product takes before it
/// could leave 2^+-range. Each starts within [1, 2).
int interval_within(double range, double ratio) {
  return static_cast<int>(std::min(64.0, (range - 1.0) / std::max(1.0, -std::log2(ratio))));
}

}  // namespace

ReadingForm::ReadingForm(const ContactModel& contact) {
  if (contact.table) {
    const LikelihoodTable& from = *contact.table;
    kind = Kind::table;
    nodes = from.nodes;
    levels = from.levels();
    sets = from.sets();
    first_log_odds = from.first_log_odds;
    nodes_per_nat = static_cast<double>(nodes - 1) / (from.last_log_odds - from.first_log_odds);
    table.reserve(2 * from.log_likelihood.size());
    for (std::size_t i = 0; i < from.log_likelihood.size(); ++i) {
      const double value = from.log_likelihood[i];
      const bool last = i % nodes == nodes - 1;
      table.insert(table.end(), {value, last ? 0.0 : from.log_likelihood[i + 1] - value});
    }
    return;
  }
  const double floor = contact.gamma * contact.prior.value();
  const double scale = floor + (1.0 - contact.gamma);
  log_scale = std::log(scale);
  ratio = floor / scale;
  kind = ratio >= least_ratio ? Kind::products : Kind::sums;
  if (kind == Kind::products) {
    log_ratio = std::log(ratio);
    float_interval = interval_within(120.0, ratio);
    double_interval = interval_within(1000.0, ratio);
  } else {
    log_ratio = contact.gamma > 0.0
                    ? std::log(contact.gamma) + std::log(contact.prior.value()) - log_scale
                    : log_zero;
    // Short, so that float32 sums stay close.
    float_interval = 8;
    double_interval = 64;
  }
}

TableExtent ReadingForm::table_extent(std::size_t object) const {
  TableExtent extent{.width = static_cast<double>(nodes - 1) / nodes_per_nat};
  const double* from = row(object, Reading::no_contact);
  for (std::size_t i = 0; i < levels * nodes; ++i) {
    extent.largest = std::max(extent.largest, std::abs(from[2 * i]));
    extent.steepest = std::max(extent.steepest, std::abs(from[2 * i + 1]) * nodes_per_nat);
  }
  return extent;
}

double ReadingForm::largest_nats(double largest_log_odds) const {
  return std::min(largest_log_odds, std::abs(log_ratio)) + 1.0 + std::abs(log_scale);
}

}  // namespace palpate
