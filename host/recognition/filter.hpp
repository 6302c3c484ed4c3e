#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "model/touch_evidence.hpp"
#include "palpate/bounded_posterior.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/device.hpp"
#include "palpate/lattice.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose.hpp"
#include "palpate/pose_histogram.hpp"

namespace palpate {

/// The filter that recognises, by its options.
using FilterOptions = std::variant<HistogramOptions, BoundedOptions, ParticleOptions>;

/// What a filter can tell, and what others than the filter itself ask of its options.
struct FilterTraits {
  /// Believes in bins of a lattice, and so has a refined pose, a log-likelihood of the mode and
  /// plans. Particles have none: motion noise comes between.
  bool bins = false;
  /// Evaluates every bin, in the device's memory, as soon as a touch comes. Posteriors of every bin
  /// need it.
  bool every_bin = false;
  /// Keeps touches, searches on the host once it is asked about the belief, and proves what it left
  /// out (Certificate).
  bool certificate = false;
  /// How far a touch may be displaced; none with particles, which take every touch's pose to be
  /// exact.
  DisplacementSd touch_sd = {};
  /// How far the object may move between two touches; none with bounds, and with particles, whose
  /// motion noise is not meant.
  DisplacementSd slip_sd = {};
  std::optional<double> none_weight = {};  ///< of "none of these"; particles have none
  std::optional<double> tolerance = {};    ///< of the certificate
  std::optional<double> budget_s = {};     ///< after which a search for the certificate ends
};
FilterTraits traits_of(const FilterOptions& options);

/// The lattice of a histogram or of a bounded posterior, or the particles' region, whose bins only
/// marginals have.
const PoseLattice& lattice_of(const FilterOptions& options);
const ContactModel& contact_of(const FilterOptions& options);
/// The filter on another lattice.
FilterOptions with_lattice(FilterOptions options, const PoseLattice& lattice);
/// What the belief is divided into: "25 x 25 x 16 bins each", "10000 particles".
std::string size_words(const FilterOptions& options);

/// How a search by bounds runs on the host. What it finds does not depend on it.
struct FilterResources {
  std::size_t threads = 0;                  ///< 0: BoundedOptions::threads
  std::function<void()> cancel_point = {};  ///< BoundedOptions::cancel_point
};

/// A Bayes filter over object identity and pose. Functions do and throw what those of
/// PoseHistogram, BoundedPosterior and ParticleFilter do; what a filter lacks is empty.
class Filter {
 public:
  virtual ~Filter() = default;

  virtual void reset() = 0;
  virtual void move_pivot(const glm::dvec2& pivot_mm) = 0;
  /// @param touches classified by contact_of() the filter's options
  virtual void update(std::span<const TouchEvidence> touches,
                      const std::function<void(double)>& progress) = 0;

  /// @param tolerance see BoundedPosterior::estimate(); ignored where FilterTraits::certificate is
  /// false
  virtual Estimate estimate(std::optional<double> tolerance) const = 0;
  virtual std::optional<RefinedPose> refine(const Mode& /*mode*/) const { return {}; }
  /// Draws from the belief; of particles by their weights.
  virtual std::vector<PoseSample> sample(std::size_t count, std::uint64_t seed) const = 0;
  /// Marginal probabilities of one object's poses: a histogram's on its lattice, which is
  /// `lattice`; those of others on marginal_grid(lattice). A particle counts in the nearest bin.
  virtual Marginals marginals(int object, const PoseLattice& lattice) const = 0;
  /// See PoseHistogram::likely_bins(). A particle counts in the nearest bin.
  /// @param lattice of the filter; receives the particles' own, in steps of their Parzen grid
  virtual std::vector<std::vector<BinShare>> likely_bins(std::span<const int> objects,
                                                         double least_share,
                                                         PoseLattice& lattice) const = 0;
  /// Entropy over objects and bins in nats.
  virtual std::optional<double> entropy() const { return {}; }
  /// See PoseHistogram::expected_gain().
  virtual std::vector<TouchGain> expected_gain(std::span<const Pose> /*T_robot_sensor*/,
                                               std::span<const glm::dvec2> /*elements_mm*/,
                                               const PlanOptions& /*plan*/) const {
    return {};
  }
  virtual std::optional<double> effective_sample_size() const { return {}; }

  /// How the filter computes and why, its numbers and its memory on the host, in lines.
  virtual std::vector<std::string> words() const = 0;
  virtual std::uint64_t device_bytes() const { return 0; }
  virtual std::uint64_t host_bytes() const { return 0; }
  /// The belief over every bin; nullptr where FilterTraits::every_bin is false.
  virtual const PoseHistogram* histogram() const { return nullptr; }
  /// BoundedPosterior::evaluated_bins(); nothing where FilterTraits::certificate is false.
  virtual std::optional<EvaluatedBelief> evaluated_bins() const { return {}; }
};

/// The filter that the options name.
/// @param device may be null where FilterTraits::certificate is true
/// @param search ignored where FilterTraits::certificate is false
std::unique_ptr<Filter> make_filter(Device* device, std::span<const Hypothesis> hypotheses,
                                    const FilterOptions& options,
                                    const FilterResources& search = {});

/// The lattice, or where it is finer than a picture shows a coarser grid of the same poses: at most
/// 400 bins along x and along y and 360 along theta. Bins along x and y are a whole number of the
/// lattice's wide, so that a picture of them shows no stripes; the last of them may reach beyond
/// the region.
PoseLattice marginal_grid(const PoseLattice& lattice);

}  // namespace palpate
