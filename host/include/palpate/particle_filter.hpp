#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "palpate/api.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/device.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// How the next generation of particles is drawn from the weighted one.
enum class Resampling {
  multinomial,  ///< n independent draws, as in the paper
  systematic,   ///< one draw and n - 1 equal steps: the same expectation, the least variance
};

struct ParticleOptions {
  int particles = 10'000;  ///< n, over all objects together; at most 1,000,000
  /// Particles start uniformly distributed over the ranges of this lattice, about its pivot; its
  /// bin counts are ignored.
  PoseLattice region = {};
  ContactModel contact = {};  ///< what the sensor says about a place (Eq. 3, 7)
  double motion_mm = 1.0;     ///< standard deviation of the noise added to x and y at each touch
  double motion_rad = 0.1;    ///< standard deviation of the noise added to theta at each touch
  Resampling resampling = Resampling::multinomial;
  /// Augmented MCL (Thrun, Burgard and Fox 2005, Table 8.3), the paper's second variant: each new
  /// particle is a random one with probability max(0, 1 - w_fast / w_slow). Both are running
  /// averages of the particles' mean likelihood of a touch, to the power of 1 / (number of its
  /// known elements), since the likelihood itself falls by orders with every element.
  bool augmented = false;
  double alpha_slow = 0.05;  ///< rate of w_slow, above 0 and below alpha_fast
  double alpha_fast = 0.5;   ///< rate of w_fast, at most 1
  std::uint64_t seed = 0;    ///< the same seed gives the same run on one device
};

/// Monte Carlo localization over object identity and planar pose (Sec. III-B, Eq. 8-12) on the
/// device. Per touch: resample by weight, add motion noise, weigh by Eq. 7. The first touch finds
/// all weights equal and resamples nothing; a touch without a known element adds motion noise and
/// leaves the weights as they are. Weights are kept in logs relative to the largest, so that they
/// never all vanish. Particles are free to leave the region.
///
/// Random numbers depend on the seed, the touch and the particle alone, not on the order of
/// execution. Every call on a moved-from filter throws Error.
class PALPATE_API ParticleFilter {
 public:
  /// @throws Error as PoseHistogram does, and on a number of particles, a noise or a rate out of
  /// range.
  ParticleFilter(Device& device, std::span<const Hypothesis> hypotheses,
                 const ParticleOptions& options);

  /// Restores the initial particles for the next unknown: the same touches give the same run.
  /// @throws Error if the device fails
  void reset();

  /// Moves the region to another pivot, in the robot frame, and the initial particles with it. The
  /// pivot stays over reset(). @throws Error after an update() or on a pivot out of range, and
  /// changes nothing
  void move_pivot(const glm::dvec2& pivot_mm);

  /// Resamples, moves and weighs the particles by each touch in turn (Eq. 7-8).
  /// @param progress called with the fraction done after each touch
  /// @throws Error on a touch that is not sound, and changes nothing; Error if the device fails;
  /// what `progress` throws. After that, or where memory ends, the particles may be updated in
  /// part, and every call but reset() throws
  void update(std::span<const Touch> touches, const std::function<void(double)>& progress = {});
  void update(const Touch& touch) { update(std::span(&touch, 1)); }
  /// Touches that are classified by the options' contact model already.
  PALPATE_LOCAL void update(std::span<const TouchEvidence> touches,
                            const std::function<void(double)>& progress);

  /// Identity by Eq. 9; the pose is the maximum of the Parzen estimate with a cone kernel (Eq.
  /// 10-12), rho = 1 mm and 1 rad, on a grid of 0.5 mm and 0.04 pi rad through the region's centre.
  /// The mode has no bin, and `mode.log_likelihood` is the log of the Parzen sum's value there, at
  /// most 0.
  ///
  /// `contradicted` uses the best particle of each touch in place of the best bin. It is a hint:
  /// too few particles may miss the pose that explains the touches, and motion noise may carry a
  /// particle to another pose for each touch.
  /// @throws Error if the device fails
  Estimate estimate() const;

  /// 1 / sum of squared weights (Kong 1992), in [1, n].
  double effective_sample_size() const;

  struct Particle {
    int object = 0;  ///< index into the hypotheses
    Pose T_object_robot;
    double weight = 0.0;  ///< all together sum to 1
  };
  /// All particles, for inspection. @throws Error if the device fails
  std::vector<Particle> particles() const;

  /// Device memory in bytes: what the filter holds, plus the most that an estimate needed so far.
  std::uint64_t device_bytes() const;

 private:
  struct PALPATE_LOCAL Impl;
  PALPATE_LOCAL Impl& impl() const;
  /// Like impl(), but throws Error where a failed update left the particles half-way.
  PALPATE_LOCAL Impl& unbroken() const;
  std::unique_ptr<Impl, void (*)(Impl*)> impl_{nullptr, nullptr};
};

}  // namespace palpate
