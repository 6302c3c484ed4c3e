#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "array_overlap.hpp"
#include "bin_likelihood.hpp"
#include "bounding_box.hpp"
#include "known_elements.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// Bins at which a touch's likelihood is evaluated for its mean. An object that would get less than
/// two of them gets two.
inline constexpr std::int64_t bins_per_touch_mean = 100'000;

/// The mean likelihood of one touch, over the hypotheses by prior weight and over the bins at which
/// the touch's array overlaps the object.
struct TouchMean {
  double log_mean = 0.0;          ///< in nats
  double squared_error = 0.0;     ///< squared standard error of log_mean; 0 where all bins count
  double log_share = 0.0;         ///< of such bins among all bins, by prior weight, in nats
  std::uint64_t fingerprint = 0;  ///< of the touch's known elements
};

/// "None of these" over a lattice of any size: the log evidence
///   log s + sum over the touches of log (mean of the touch's likelihood),
/// where the mean is over the bins at which the array overlaps the object (over all bins where
/// there is no such bin) and s is the share of such bins at the first touch with a known element.
/// Counts the bins exactly, and takes the mean over a stratified sample of them.
///
/// The overlapping bins of an object, in the order of theta, y and x, are cut into strata of equal
/// size; two different bins are drawn in each. The standard error follows from the strata's
/// variances by the delta method. Draws depend on the touch and on how often it has come before, so
/// that errors of touches are independent and the order of touches does not count, but for s.
class SampledTouchMeans {
 public:
  /// @param contact resolved: with its prior
  /// @param log_weight of every hypothesis, over their sum
  /// @param likelihood outlives this object and has the same pivot
  SampledTouchMeans(std::span<const Hypothesis> hypotheses, const ContactModel& contact,
                    const PoseLattice& lattice, std::span<const double> log_weight,
                    const BinLikelihood& likelihood);

  void reset();
  void move_pivot(const glm::dvec2& pivot_mm);

  /// The means of touches that come after those added so far; touches without a known element have
  /// none. On the threads of the caller's arena; the bits do not depend on their number.
  /// @param progress called after each touch with the number of touches done
  /// @throws Error on a touch that is not sound; what `progress` throws
  std::vector<TouchMean> evaluate(std::span<const Touch> touches,
                                  const std::function<void(std::size_t)>& progress = {}) const;
  /// Takes in what evaluate() returned; all of it, or nothing where memory ends.
  void add(std::span<const TouchMean> means);
  void update(const Touch& touch) { add(evaluate(std::span(&touch, 1))); }

  /// Log of the product of s and the touches' mean likelihoods, in nats; 0 before any touch.
  double log_evidence() const;
  /// Standard error of log_evidence() in nats.
  double standard_error() const;

 private:
  struct PlaceOfBin {
    std::int32_t object = 0;
    std::int32_t theta = 0;
    std::int32_t y = 0;
    std::int32_t x = 0;
  };
  /// The bins of every plane over which a mean is, [object, theta].
  struct Overlap {
    std::vector<std::int64_t> plane_end;  ///< ordinal after the plane's last bin, among all objects
    std::vector<std::int64_t> bins;       ///< [object]
    double weighted_bins = 0.0;           ///< by prior weight
    bool everywhere = false;              ///< whether all bins count, wherever the array is
  };
  /// Two draws from each stratum of an object's bins, or all of them once.
  struct Strata {
    std::int64_t bins = 0;
    std::int64_t count = 0;  ///< 0: all bins are taken

    std::int64_t draws() const { return count == 0 ? bins : 2 * count; }
    std::int64_t begin(std::int64_t stratum) const;
  };

  TouchMean mean_of(const Touch& touch, const KnownElements& elements, std::uint64_t fingerprint,
                    std::uint64_t times_before) const;
  Overlap overlap_of(const ArrayRectangle& array) const;
  std::vector<Strata> strata_of(const Overlap& overlap) const;
  std::vector<PlaceOfBin> places_of(std::span<const std::int64_t> ordinals, const Overlap& overlap,
                                    const ArrayRectangle& array) const;
  std::vector<double> evaluated(std::span<const PlaceOfBin> places,
                                const KnownElements& elements) const;

  std::vector<BoundingBox> boxes_;  ///< around each object's occupied cells
  ContactModel contact_;
  PoseLattice lattice_;
  std::vector<double> log_weight_;
  const BinLikelihood& likelihood_;
  std::vector<TouchMean> means_;
};

}  // namespace palpate
