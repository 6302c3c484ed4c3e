#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "learning/stranger_fit.hpp"

namespace palpate {

/// A press, or a group of several presses of one object, and what a model that has not seen it says
/// of it. What does not apply is none.
struct HeldOut {
  std::size_t truth = 0;    ///< index of its label
  std::size_t fold = 0;     ///< of the cross-validation
  std::size_t touches = 1;  ///< of one object, together
  /// Which of two halves that share no press a group is of; none of a press alone.
  std::optional<std::size_t> half = {};
  std::vector<double> log_evidence;  ///< of every label, in nats; -infinity: without a map
  /// Log density of the press's features under every label, in nats; empty without features.
  std::vector<double> log_density = {};
  /// Of groups of the first half: the error (Eq. 17-20), in mm, of the mean by their likelihood
  /// over poses about their own, on their object's map.
  std::optional<double> error_mm = {};
  /// Fit::z of a press alone with an element In Contact: at its pose where that is known, or else
  /// on the best map at about the best pose.
  std::optional<double> fit_z = {};
  /// Fit::z of a press alone at a known pose with an element In Contact, by a table: on the map
  /// that fits best, at about the best pose.
  std::optional<double> best_fit_z = {};
  /// How it fits the best of all other objects, at about its best pose, by a table. Of what has an
  /// element In Contact, where two others have maps.
  std::optional<StrangerFit> stranger_fit = {};
};

/// The held-out presses and groups for which `is(unknown)` holds.
template <typename Is>
std::vector<HeldOut> those(std::span<const HeldOut> all, const Is& is) {
  std::vector<HeldOut> some;
  std::ranges::copy_if(all, std::back_inserter(some), is);
  return some;
}
/// Those of a fold (inside) or of all other folds.
inline std::vector<HeldOut> of_fold(std::span<const HeldOut> all, std::size_t fold, bool inside) {
  return those(all, [=](const HeldOut& one) { return (one.fold == fold) == inside; });
}
/// Presses alone.
inline std::vector<HeldOut> alone(std::span<const HeldOut> all) {
  return those(all, [](const HeldOut& one) { return !one.half; });
}
/// Groups of a half.
inline std::vector<HeldOut> of_half(std::span<const HeldOut> all, std::size_t half) {
  return those(all, [=](const HeldOut& one) { return one.half == half; });
}
/// Groups, those of the first half before those of the second.
inline std::vector<HeldOut> groups_in(std::span<const HeldOut> all) {
  std::vector<HeldOut> groups = of_half(all, 0);
  std::ranges::move(of_half(all, 1), std::back_inserter(groups));
  return groups;
}

/// [label] What those say that say it.
template <typename Value>
std::map<std::size_t, std::vector<Value>> by_label(std::span<const HeldOut> all,
                                                   std::optional<Value> HeldOut::*said) {
  std::map<std::size_t, std::vector<Value>> of_label;
  for (const HeldOut& one : all) {
    if (one.*said) {
      of_label[one.truth].push_back(*(one.*said));
    }
  }
  return of_label;
}

}  // namespace palpate
