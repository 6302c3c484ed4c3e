#include "estimation/bounded/search/mass_account.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace palpate {

namespace {

constexpr double nothing = -std::numeric_limits<double>::infinity();

}  // namespace

MassAccount::MassAccount(std::span<const double> log_weight, std::span<const std::size_t> label_of,
                         const PoseLattice& lattice, const SearchGoal& goal)
    : log_weight_(log_weight),
      label_of_(label_of),
      lattice_(lattice),
      goal_(goal),
      evaluated_(log_weight.size()),
      rounding_(log_weight.size()),
      terms_(log_weight.size()),
      dropped_(log_weight.size()),
      log_total_(nothing),
      log_totals_(log_weight.size(), nothing),
      best_(nothing),
      best_of_(log_weight.size(), nothing),
      largest_dropped_of_(log_weight.size(), nothing),
      mode_value_(nothing) {}

void MassAccount::settle(std::int32_t object, std::int64_t bins, double log_mass, double largest,
                         double error) {
  const double mass = log_weight_[object] + log_mass;
  evaluated_[object].add(mass);
  terms_[object] += static_cast<double>(bins);
  // Beyond, expm1 is infinite, and the log of it is the error itself.
  constexpr double most = 700.0;
  const double rounding = mass + (error < most ? std::log(std::expm1(error)) : error);
  rounding_[object].add(rounding);
  all_rounding_.add(rounding);
  raise_best(object, largest - error);
}

void MassAccount::drop(const UnsettledMass& tiles) {
  for (std::size_t i = 0; i < dropped_.size(); ++i) {
    const double mass = tiles.log_mass(i);
    dropped_[i].add(mass);
    all_dropped_.add(mass);
    largest_dropped_of_[i] = std::max(largest_dropped_of_[i], tiles.largest(i) - log_weight_[i]);
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

void MassAccount::raise_totals(std::span<const LogSum> pending) {
  LogSum total;
  for (std::size_t i = 0; i < evaluated_.size(); ++i) {
    // What rounding may have added does not count.
    const double own =
        log_add(log_subtract(evaluated_[i].log(), rounding_[i].log()), pending[i].log());
    log_totals_[i] = std::max(log_totals_[i], own);
    total.add(own);
  }
  log_total_ = std::max(log_total_, total.log());
}

void MassAccount::raise_best(std::int32_t object, double log_likelihood) {
  best_ = std::max(best_, log_weight_[object] + log_likelihood);
  best_of_[object] = std::max(best_of_[object], log_likelihood);
}

std::vector<std::size_t> MassAccount::droppable_from(const UnsettledMass& tiles,
                                                     double tolerance) const {
  std::size_t of_all = tiles.droppable_from(std::log(tolerance) + log_total_);
  if (goal_.mode) {
    of_all = std::max(of_all, tiles.slot(best_) + 1);
  }
  std::vector<std::size_t> from(evaluated_.size(), of_all);
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
    for (const double own : log_totals_) {
      floor = std::min(floor, own == nothing ? floor : own);
    }
    floor = std::max(floor, log_total_ - goal_.evidence_range_nats);
  }
  const auto bins = static_cast<double>(lattice_.bins()) * static_cast<double>(evaluated_.size());
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
    labels[label_of_[i]].total.add(log_totals_[i]);
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

double MassAccount::dropped_share() const { return std::exp(all_dropped_.log() - log_total_); }

double MassAccount::rounding_share() const { return std::exp(all_rounding_.log() - log_total_); }

SearchResult MassAccount::result() const {
  SearchResult result{.mass = {},
                      .best_object = mode_object_,
                      .best_bin = mode_bin_,
                      .best_log_likelihood = mode_value_ - log_weight_[mode_object_],
                      .mode_certain = true};
  for (std::size_t i = 0; i < evaluated_.size(); ++i) {
    result.mode_certain =
        result.mode_certain && log_weight_[i] + largest_dropped_of_[i] < mode_value_;
    // Each exponential and each addition of the sums rounds by a few units of 2^-53.
    const double sum_error = 4.0 * (terms_[i] + 1.0) * 0x1p-53;
    result.mass.push_back(
        {.evaluated = evaluated_[i].log(),
         .rounding = log_add(rounding_[i].log(), evaluated_[i].log() + std::log(sum_error)),
         .dropped = dropped_[i].log()});
  }
  return result;
}

}  // namespace palpate
