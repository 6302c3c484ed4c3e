#include "estimation/bounded/search/mass_account.hpp"

#include <algorithm>
#include <bit>
#include <functional>
#include <tuple>

namespace palpate {

namespace {

/// Part of BoundedOptions::evidence_nats that is left for rounding.
constexpr double evidence_rounding_part = 0.2;

}  // namespace

MassAccount::MassAccount(std::span<const double> log_weight, std::span<const std::size_t> label_of,
                         const PoseLattice& lattice, const SearchGoal& goal)
    : log_weight_(log_weight),
      label_of_(label_of),
      lattice_(lattice),
      goal_(goal),
      of_(log_weight.size()) {}

void MassAccount::settle(std::int32_t object, std::int64_t bins, double log_mass, double largest,
                         double error) {
  Account& of = of_[object];
  const double mass = log_weight_[object] + log_mass;
  of.evaluated.add(mass);
  of.terms += static_cast<double>(bins);
  // Beyond, expm1 is infinite, and the log of it is the error itself.
  constexpr double limit = 700.0;
  of.rounding.add(mass + (error < limit ? std::log(std::expm1(error)) : error));
  raise_best(object, largest - error);
}

void MassAccount::drop(const UnsettledMass& tiles) {
  for (std::size_t i = 0; i < of_.size(); ++i) {
    const double mass = tiles.log_mass(i);
    of_[i].dropped.add(mass);
    all_dropped_.add(mass);
    of_[i].most_dropped = std::max(of_[i].most_dropped, tiles.largest(i) - log_weight_[i]);
  }
}

void MassAccount::note_best(const BinBox& box, std::int64_t bin_of_box, double log_likelihood) {
  const std::int64_t bin = box.bin(bin_of_box, lattice_);
  const double value = log_weight_[box.object] + log_likelihood;
  // The first of several equal bins is the mode.
  if (value > mode_value_ ||
      (value == mode_value_ && std::tie(box.object, bin) < std::tie(mode_object_, mode_bin_))) {
    mode_value_ = value;
    mode_object_ = box.object;
    mode_bin_ = bin;
  }
}

void MassAccount::raise_totals() {
  LogSum total;
  for (Account& of : of_) {
    // What rounding may have added does not count.
    const double own = log_subtract(of.evaluated.log(), of.rounding.log());
    of.log_total = std::max(of.log_total, own);
    total.add(own);
  }
  log_total_ = std::max(log_total_, total.log());
}

void MassAccount::raise_best(std::int32_t object, double log_likelihood) {
  best_ = std::max(best_, log_weight_[object] + log_likelihood);
  of_[object].best = std::max(of_[object].best, log_likelihood);
}

std::vector<std::size_t> MassAccount::droppable_from(const UnsettledMass& tiles,
                                                     double tolerance) const {
  // The most probable bin is evaluated, whatever the tolerance.
  const std::size_t of_all =
      std::max(tiles.droppable_from(std::log(tolerance) + log_total_), tiles.slot(best_) + 1);
  std::vector<std::size_t> from(of_.size(), of_all);
  if (goal_.evidence_nats) {
    const std::vector<double> largest = droppable_evidence(tolerance);
    for (std::size_t i = 0; i < from.size(); ++i) {
      from[i] = std::max(of_all, tiles.droppable_from(i, largest[i]));
    }
  }
  return from;
}

double MassAccount::slot_nats(double largest) const {
  constexpr double of_evidence = 0.25;
  constexpr double widest = 1.0;
  const double fine = goal_.evidence_nats ? std::clamp(of_evidence * *goal_.evidence_nats,
                                                       UnsettledMass::usual_slot_nats, widest)
                                          : UnsettledMass::usual_slot_nats;
  // The lowest mass that matters: a part of the total or, of a label that lies far below, of its
  // own.
  double floor = log_total_;
  if (goal_.evidence_nats) {
    for (const Account& of : of_) {
      floor = std::min(floor, of.log_total == nothing ? floor : of.log_total);
    }
    floor = std::max(floor, log_total_ - goal_.evidence_range_nats);
  }
  const auto bins = static_cast<double>(lattice_.bins()) * static_cast<double>(of_.size());
  const double part = std::min(goal_.tolerance, goal_.evidence_nats.value_or(1.0));
  constexpr double parts_of_it = 8.0;  // a level of tiles may use up a part of what may be dropped
  const double reach = largest - floor + std::log(bins / part) + parts_of_it;
  return std::isfinite(reach) ? std::max(fine, reach / (UnsettledMass::slots - 1)) : fine;
}

std::vector<double> MassAccount::droppable_evidence(double tolerance) const {
  struct Label {
    LogSum total;
    double hypotheses = 0.0;
  };
  std::vector<Label> labels(*std::ranges::max_element(label_of_) + 1);
  for (std::size_t i = 0; i < label_of_.size(); ++i) {
    labels[label_of_[i]].total.add(of_[i].log_total);
    labels[label_of_[i]].hypotheses += 1.0;
  }
  // As large a part of what may be missing as of the tolerance; the rest of the nats is for
  // rounding.
  const double part = tolerance / goal_.tolerance;
  const double missing =
      std::log(std::expm1(*goal_.evidence_nats * (1.0 - evidence_rounding_part)) * part);
  const double far_below = log_total_ - goal_.evidence_range_nats + std::log(part);
  std::vector<double> largest;
  for (const std::size_t label : label_of_) {
    largest.push_back(std::max(missing + labels[label].total.log(), far_below) -
                      std::log(labels[label].hypotheses));
  }
  return largest;
}

SearchResult MassAccount::result() const {
  SearchResult result{.mass = {},
                      .best_object = mode_object_,
                      .best_bin = mode_bin_,
                      .best_log_likelihood = mode_value_ - log_weight_[mode_object_],
                      .mode_certain = true};
  for (std::size_t i = 0; i < of_.size(); ++i) {
    const Account& of = of_[i];
    result.mode_certain = result.mode_certain && log_weight_[i] + of.most_dropped < mode_value_;
    // Each exponential and each addition of the sums rounds by a few units of 2^-53.
    const double sum_error = 4.0 * (of.terms + 1.0) * 0x1p-53;
    const double evaluated = of.evaluated.log();
    result.mass.push_back({.evaluated = evaluated,
                           .rounding = log_add(of.rounding.log(), evaluated + std::log(sum_error)),
                           .dropped = of.dropped.log()});
  }
  return result;
}

UnsettledMass::UnsettledMass(std::size_t hypotheses, double largest, double slot_nats)
    : largest_(largest), slot_nats_(slot_nats), bins_(hypotheses * slots), used_(hypotheses) {
  for (std::size_t i = 0; i < decay_.size(); ++i) {
    decay_[i] = std::exp(-static_cast<double>(i) * slot_nats);
  }
}

std::size_t UnsettledMass::slot(double bound) const {
  // Rounded down, so that a bound does not exceed its slot's upper edge, but for rounding.
  const double below = (largest_ - bound) / slot_nats_;
  return below >= static_cast<double>(slots - 1) ? slots - 1
                                                 : static_cast<std::size_t>(std::max(below, 0.0));
}

template <typename Visit>
UnsettledMass::Reached UnsettledMass::add_up(const Hypotheses& of, const Visit& visit) const {
  SlotSet used{};
  for (std::size_t i = of.first; i < of.end; ++i) {
    std::ranges::transform(used, used_[i], used.begin(), std::bit_or());
  }
  Reached reached;
  for (std::size_t word = used.size(); word-- > 0;) {
    for (std::uint64_t left = used[word]; left != 0;) {
      const std::size_t bit = 63 - static_cast<std::size_t>(std::countl_zero(left));
      left ^= std::uint64_t{1} << bit;
      const std::size_t slot = 64 * word + bit;
      std::int64_t bins = 0;
      for (std::size_t i = of.first; i < of.end; ++i) {
        bins += bins_[i * slots + slot];
      }
      if (bins > 0) {
        reached = {reached.bins * decay(reached.slot - slot) + static_cast<double>(bins), slot};
        if (!visit(reached)) {
          return reached;
        }
      }
    }
  }
  return reached;
}

UnsettledMass::Reached UnsettledMass::add_up(std::size_t hypothesis) const {
  return add_up({hypothesis, hypothesis + 1}, [](const Reached&) { return true; });
}

std::size_t UnsettledMass::droppable_from(const Hypotheses& of, double log_allowance) const {
  // The log of any number of bins is less.
  constexpr double most_log_bins = 44.0;
  std::size_t from = 0;
  add_up(of, [&](const Reached& reached) {
    const double log_room = log_allowance - upper_edge(reached.slot);
    const bool fits = !(log_room < most_log_bins && std::log(reached.bins) > log_room);
    from = fits ? 0 : reached.slot + 1;
    return fits;
  });
  return from;
}

double UnsettledMass::log_mass(std::size_t hypothesis) const {
  const Reached all = add_up(hypothesis);
  return upper_edge(all.slot) + std::log(all.bins);
}

double UnsettledMass::largest(std::size_t hypothesis) const {
  const Reached all = add_up(hypothesis);
  return all.bins > 0.0 ? upper_edge(all.slot) : -std::numeric_limits<double>::infinity();
}

}  // namespace palpate
