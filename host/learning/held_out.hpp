#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "palpate/fit.hpp"
#include "palpate/learned_sensor.hpp"
#include "recognition/evaluation.hpp"

namespace palpate {

/// How touches of an object that is left out fit the best of all others.
struct StrangerFit {
  Fit fit;                  ///< by evidence_fit(), on no scale
  std::size_t touches = 0;  ///< with an element In Contact
};

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
std::vector<HeldOut> selected(std::span<const HeldOut> all, const Is& is) {
  std::vector<HeldOut> some;
  std::ranges::copy_if(all, std::back_inserter(some), is);
  return some;
}
/// Those of a fold (inside) or of all other folds.
inline std::vector<HeldOut> of_fold(std::span<const HeldOut> all, std::size_t fold, bool inside) {
  return selected(all, [=](const HeldOut& one) { return (one.fold == fold) == inside; });
}
/// Presses that are in no group.
inline std::vector<HeldOut> single_touches(std::span<const HeldOut> all) {
  return selected(all, [](const HeldOut& one) { return !one.half; });
}
/// Groups of a half.
inline std::vector<HeldOut> of_half(std::span<const HeldOut> all, std::size_t half) {
  return selected(all, [=](const HeldOut& one) { return one.half == half; });
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

/// Logarithms of the labels' probabilities: proportional to evidence^(1 / temperature) *
/// density^weight.
std::vector<double> log_probabilities(const HeldOut& press, double temperature,
                                      double feature_weight = 0.0);
/// How right and how honest the probabilities of presses are; see evaluate().
Scores scores_of(std::span<const HeldOut> presses, double temperature = 1.0,
                 double feature_weight = 0.0);
/// -log of the true label's probability, of each single touch; `log_evidence` holds log
/// probabilities, see tempered_by_folds().
std::vector<double> losses_of(std::span<const HeldOut> all);

/// By how much more the second of two models loses on the same presses.
struct LossDifference {
  double mean = 0.0;
  double standard_error = 0.0;
  /// Whether the first loses less beyond chance: by more than two standard errors.
  bool is_clear() const;
};
LossDifference difference_of(std::span<const double> losses, std::span<const double> others);

/// What recognition gains by a learned sensor over Eq. 7 on touches that neither has seen.
struct SensorGain {
  double log_loss_before = 0.0;  ///< of single touches by Eq. 7 with gamma 0.1, in nats
  double log_loss = 0.0;         ///< of single touches by the table and the temperature
  LossDifference less_loss;      ///< of single touches, in nats
  /// Geometric means of HeldOut::error_mm; none where there are no groups.
  std::optional<double> error_mm_before;  ///< by Eq. 7
  std::optional<double> error_mm;         ///< by the table
  LossDifference less_error;              ///< of the errors' logarithms, where there are groups
  /// Either the loss or the error is less beyond chance, and neither is more beyond chance by over
  /// 0.02 nats, or a tenth of the error: touches that are all told apart have next to no loss, with
  /// a temperature a little more.
  bool better = false;
  bool gains = false;  ///< the first of both
};

/// @param eq7 what Eq. 7 says, with gamma 0.1
/// @param tempered what the table says, see tempered_by_folds()
SensorGain gain_of(std::span<const HeldOut> eq7, std::span<const HeldOut> tempered);

/// The scale with stranger_sd and stranger_single_touch by which the fits are likeliest, those of
/// several touches and of one; each object counts alike. Either is none where fewer than three
/// objects have five such fits.
/// @param objects [label]
/// @param scale of learned objects' z
/// @returns stranger_sd from 1 to 16, stranger_single_touch with a mean from -16 to 0 and an sd
/// from 1 to 16
FitScale with_strangers(const std::map<std::size_t, std::vector<StrangerFit>>& objects,
                        FitScale scale);

/// See LearnedSensor::temperature.
struct TemperatureFit {
  double temperature = 1.0;
  double feature_weight = 0.0;
  double growth = 0.0;

  double temperature_after(std::size_t touches) const {
    return temperature_of(touches, temperature, growth);
  }
};
/// The temperature of at least 0.01, and the weight in [0, 2] of the features where presses have
/// them, of the least log-loss. Besides the presses, one more counts, of two labels whose log
/// evidences differ by the median margin of the presses (label against the best other): it is
/// right or wrong with equal weights, so that presses which are all told apart, however clearly, do
/// not make the temperature 0. For the features a further such press counts, whose log densities
/// differ by their median margin.
///   The evidence has at least the say that it has alone: features lower the temperature, but do
/// not raise it. Where they tell all presses apart, the log-loss would leave the evidence none, and
/// a day of lighter presses would be taken for other objects.
///   The weight is 0 unless what the other folds show helps each fold's presses, all together: the
/// presses of a fold were made at another time than the others, see folds_of().
///   The growth has the least log-loss of the groups; it is 0 unless what each half of them
/// shows helps the other half, both taken together.
/// @param all presses of one touch each, with a log evidence for each of the same labels, finite
/// for their own, and groups
/// @throws Error on no press, and where no press has two labels to choose from
TemperatureFit fit_temperature(std::span<const HeldOut> all);

/// The presses and groups with the logarithms of their labels' probabilities in the place of the
/// evidences. The presses and groups of a fold have the numbers of the other folds' presses, or of
/// all where none of these has two labels to choose from; the groups have the growth of the other
/// half.
/// @throws Error as fit_temperature()
std::vector<HeldOut> tempered_by_folds(std::span<const HeldOut> all);

}  // namespace palpate
