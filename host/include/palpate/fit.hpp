#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "palpate/api.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// How well one object at one pose explains the touches.
enum class Verdict { fits, doubtful, does_not_fit };
struct Fit {
  /// Standard deviations by which the touches' log-likelihood differs from what the object predicts
  /// for touches of its own; negative: the touches fit worse. Within +-`largest_fit_z`.
  double z = 0.0;
  Verdict verdict = Verdict::fits;
};

/// The touches fit from this z on. Of touches drawn from the object's own predictions 98 % or more
/// fit: z is not normally distributed, since a surprising reading costs far more than an expected
/// one gains.
inline constexpr double fits_from_z = -3.0;
/// Below this z the touches do not fit, as less than 0.5 % of those drawn do not.
inline constexpr double doubtful_from_z = -4.0;
/// z is cut off here, for readings that the object holds to be impossible.
inline constexpr double largest_fit_z = 1e6;

/// On a FitScale that was learned the touches fit from this z on: of touches of learned objects
/// about 1 % do not, ...
inline constexpr double scaled_fits_from_z = -3.5;
/// ... and about 0.1 % are below this z.
inline constexpr double scaled_doubtful_from_z = -5.0;

/// The mean and standard deviation of the z of single touches where they fit best.
struct PALPATE_API SingleFitScale {
  double mean = 0.0;
  double sd = 1.0;
};

/// The array of touches, as far as the spread of z depends on it.
struct PALPATE_API FitArray {
  double elements = 0.0;    ///< that are known, of a touch
  double spacing_mm = 0.0;  ///< of neighbours
};

/// What z is like for touches of an object on a map that had not seen them. Neighbouring elements
/// of a large array are far from independent, as z takes them to be, maps are not perfect, and a
/// sensor may err more or less often than Eq. 7 says.
struct PALPATE_API FitScale {
  double mean = 0.0;       ///< of the z of single touches at their own poses
  double sd = 1.0;         ///< their standard deviation, but for what all touches share
  double shared_sd = 0.0;  ///< of what all touches of an object share, such as its map's errors
  /// One touch fits some object at some pose better than its own, and z varies less there. None: it
  /// is not known how much.
  std::optional<SingleFitScale> single_touch = {};
  /// What every touch after the first adds to the standard deviation of z on this scale where the
  /// object was never learned; none: Palpate's own figure.
  std::optional<double> stranger_sd = {};
  /// What z on this scale is like of one touch of an object that was never learned; its sd is 1 or
  /// more. None: one touch of it is taken to fit as well as one of a learned object.
  std::optional<SingleFitScale> stranger_single_touch = {};
  /// The array that it was learned with; none: it is not known, and the scale is of any.
  std::optional<FitArray> array = {};

  /// The scale for touches by another array. What each element deviates by adds up, while z divides
  /// by the square root of their number: the means and `shared_sd` grow with the square root of the
  /// number of elements. Elements that stand closer than those that learned share more, so that the
  /// other deviations grow as their spacing falls.
  FitScale for_array(const FitArray& other) const;

  /// The fit on this scale: (z - mean sqrt(n)) / sqrt(sd^2 + n shared_sd^2), within
  /// +-`largest_fit_z`, with its verdict. The deviations of n independent touches add up, and so do
  /// their variances; what they share counts n times. What the search for the pose gains in
  /// likelihood stays the same, and so adds (alone.mean - mean) / sqrt(n) to the mean; of one touch
  /// `alone` is the whole scale. The scale of mean 0 and sd 1 leaves the fit as it is.
  /// @param touches n, those with an element In Contact
  Fit of(const Fit& fit, std::size_t touches) const;
};

/// The scale of objects together, each with the mean and the sd of its own touches' z. Half of what
/// the objects' means differ by is `shared_sd`: an object's touches elsewhere than it was learned
/// from resemble those of all objects as much as its own. `sd` is at least 0.25 and `shared_sd`
/// 0.03, as far as touches of learned letters at new places spread.
/// @param objects one or more
PALPATE_API FitScale pooled(std::span<const FitScale> objects);

/// Compares the log-likelihood of the touches' known elements with what the object at this pose
/// predicts for them. An element at log odds l of the map reads r with probability
///   q(r) = P(r | l) / sum over all r' of P(r' | l), P by Eq. 7 or the table,
/// over No Contact and In Contact at every level. With L(r) = log P(r | l), mean M and variance V
/// of L(r) under q, and sums over the known elements of all touches,
///   z = sum (L(reading) - M) / sqrt(sum V).
/// Elements count as independent; Unknown elements do not count. So z is where `touch_sd` is zero.
///
/// Where it is not, each touch may have been displaced by itself: the sensor really was at
/// T_robot_sensor * delta, delta normally distributed. L is then a touch's log-likelihood
/// averaged over delta, log E P(readings), and M and V are its mean and variance over touches of
/// the object: delta drawn first, then each element's reading from q at that place. With sums over
/// the touches,
///   z = sum (L - M) / sqrt(sum V).
/// E is a mean over 128 displacements, M and V are estimated from 64 drawn touches each, which
/// leaves z uncertain by about 0.1; the seed is fixed.
/// @param T_object_robot pose of the robot frame in the object frame
/// @param contact its prior is the map's where it has none
/// @param touch_sd standard deviations of the sensor's pose at each touch, along x and y in mm and
/// of theta in rad; by default none
/// @param object index of the object whose numbers of a table are used
/// @returns none where no element is known
/// @throws Error on a touch, map or contact model that is not sound, a pose that is not finite, or
/// a table without numbers for the object
PALPATE_API std::optional<Fit> fit_of(std::span<const Touch> touches, const Pose& T_object_robot,
                                      const OccupancyGrid& map, const ContactModel& contact,
                                      const DisplacementSd& touch_sd = {}, std::size_t object = 0);

}  // namespace palpate
