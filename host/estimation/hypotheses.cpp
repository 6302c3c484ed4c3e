#include "estimation/hypotheses.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "model/refuse.hpp"

namespace palpate {

namespace {

/// log of the sum of the prior weights.
double log_total_weight(std::span<const Hypothesis> hypotheses) {
  // Relative to the largest, for the sum of the weights themselves may be infinite.
  const double largest = std::ranges::max(hypotheses, {}, &Hypothesis::weight).weight;
  double total = 0.0;
  for (const Hypothesis& hypothesis : hypotheses) {
    total += hypothesis.weight / largest;
  }
  return std::log(largest) + std::log(total);
}

}  // namespace

void validate_hypotheses(std::span<const Hypothesis> hypotheses) {
  if (hypotheses.empty()) {
    throw Error(Fault::input, "no objects: give at least one map");
  }
  for (const Hypothesis& hypothesis : hypotheses) {
    const OccupancyGrid& map = hypothesis.map;
    const double weight = hypothesis.weight;
    for (const OccupancyGrid* grid : {&map, &hypothesis.compared()}) {
      require_sound_map(*grid);
    }
    if (!(weight > 0.0) || !std::isfinite(weight)) {
      refuse(fmt::format("map '{}'", map.label),
             "weight = {}: give a positive number, or leave the object out", weight);
    }
  }
}

std::optional<std::size_t> differing_prior(std::span<const Hypothesis> hypotheses) {
  for (std::size_t i = 1; i < hypotheses.size(); ++i) {
    // Readers may have rounded one of them.
    if (std::abs(hypotheses[i].compared().prior - hypotheses.front().compared().prior) > 1e-6) {
      return i;
    }
  }
  return {};
}

ContactModel resolve(const ContactModel& contact, std::span<const Hypothesis> hypotheses) {
  contact.validate();
  if (contact.table && contact.table->sets() != 1 && contact.table->sets() != hypotheses.size()) {
    refuse("likelihood table",
           "numbers of {} objects, but there are {} maps; give one set for all, or one for each",
           contact.table->sets(), hypotheses.size());
  }
  ContactModel resolved = contact;
  if (!contact.prior) {
    const OccupancyGrid& first = hypotheses.front().compared();
    if (const auto other = differing_prior(hypotheses)) {
      const OccupancyGrid& map = hypotheses[*other].compared();
      refuse(fmt::format("map '{}'", map.label),
             "prior {} differs from {} of map '{}'; build the maps together, or say which prior to "
             "use",
             map.prior, first.prior, first.label);
    }
    resolved.prior = first.prior;
  }
  return resolved;
}

std::vector<double> log_weights(std::span<const Hypothesis> hypotheses) {
  const double log_total = log_total_weight(hypotheses);
  std::vector<double> logs;
  for (const Hypothesis& hypothesis : hypotheses) {
    logs.push_back(std::log(hypothesis.weight) - log_total);
  }
  return logs;
}

double none_log_weight(double none_weight, std::span<const Hypothesis> hypotheses,
                       const PoseLattice& lattice) {
  return std::log(none_weight) - log_total_weight(hypotheses) +
         std::log(static_cast<double>(lattice.bins()));
}

void require_object(int object, std::size_t objects) {
  if (object < 0 || static_cast<std::size_t>(object) >= objects) {
    refuse(fmt::format("object {}", object), "there are {}, counted from 0", objects);
  }
}

PoseLattice with_pivot(PoseLattice lattice, const glm::dvec2& pivot_mm, const char* filter,
                       bool touched) {
  if (touched) {
    refuse(filter, "its touches are about the pivot {}, {} mm; call reset() before the pivot moves",
           lattice.pivot_mm.x, lattice.pivot_mm.y);
  }
  lattice.pivot_mm = pivot_mm;
  lattice.validate();
  return lattice;
}

std::vector<double> normalised(std::vector<double> logs) {
  const double largest = std::ranges::max(logs);
  double total = 0.0;
  for (double& p : logs) {
    p = std::exp(p - largest);
    total += p;
  }
  for (double& p : logs) {
    p /= total;
  }
  return logs;
}

}  // namespace palpate
