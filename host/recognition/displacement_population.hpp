#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "model/random.hpp"
#include "palpate/displacement.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "recognition/reading_model.hpp"

namespace palpate {

/// What one unknown says about the logarithms of both standard deviations (mm, rad): the expected
/// derivatives of log p(displacements | sd), their expected negative second derivatives, and the
/// covariance of the derivatives. The mean is the derivative of the log evidence (Fisher's
/// identity), complete - covariance its negative second derivative (Louis 1982).
struct SdScore {
  std::array<double, 2> mean{};
  std::array<double, 2> complete{};
  std::array<double, 3> covariance{};  ///< (mm, mm), (mm, rad), (rad, rad)

  void add(const SdScore& other, double weight) {
    for (std::size_t k = 0; k < mean.size(); ++k) {
      mean[k] += weight * other.mean[k];
      complete[k] += weight * other.complete[k];
    }
    for (std::size_t k = 0; k < covariance.size(); ++k) {
      covariance[k] += weight * other.covariance[k];
    }
  }
};

/// Samples of one unknown's object, pose and displacements of every touch from their posterior
///   p(C, T, delta | touches) ~ prod_i f_i(T T_robot_sensor_i delta_i | C) N(delta_i; 0, sd^2),
/// T uniform over a region. The samples follow changes of sd: reweigh(), then move().
class DisplacementPopulation {
 public:
  /// @param touches and @param objects outlive this object
  /// @param region with the pivot that the unknown was recognised with; its counts are not read
  /// @param starts from the belief about the unknown, one for every sample
  DisplacementPopulation(std::span<const LivingElements> touches,
                         std::span<const SmoothOccupancy> objects, const ReadingModel& readings,
                         const PoseLattice& region, std::span<const PoseSample> starts,
                         std::uint64_t seed);

  /// Moves every sample by Metropolis' rule, which keeps the posterior.
  /// @returns the score over the second half of the sweeps
  SdScore move(const DisplacementSd& sd, int sweeps);

  /// Draws the samples again by their posterior with another sd.
  /// @returns the logarithm of the evidence's ratio, to / from (Del Moral, Doucet and Jasra 2006)
  double reweigh(const DisplacementSd& from, const DisplacementSd& to);

  /// Counts what the elements read where the samples have them.
  void count(ReadingModel::Counts& counts) const;
  /// Takes note that the model of the readings has changed.
  void refresh();

  std::size_t touches() const { return touches_.size(); }

 private:
  struct Sample {
    int object = 0;
    Pose T_object_robot;
    std::vector<Pose> displacement;      ///< [touch]
    std::vector<double> log_likelihood;  ///< [touch]
  };

  double likelihood(const Sample& sample, const Pose& T_object_robot, std::size_t touch,
                    const Pose& displacement) const;
  /// The pose turned and shifted about the middle of the touches, within the region's fixed axes.
  Pose moved(const Pose& T_object_robot, double scale_mm, double scale_rad);
  bool in_region(const Pose& T_object_robot) const;
  bool accepts(double log_ratio);

  void move_touches(Sample& sample, const DisplacementSd& sd);
  /// Moves the object below the sensors, which stay.
  void move_object(Sample& sample, const DisplacementSd& sd);
  /// Moves the object, and the sensors with the robot.
  void move_robot(Sample& sample);

  std::span<const LivingElements> touches_;
  std::span<const SmoothOccupancy> objects_;
  const ReadingModel& readings_;
  PoseLattice region_;
  glm::dvec2 middle_mm_{0.0, 0.0};  ///< of the sensors' origins, robot frame
  double spread_mm2_ = 0.0;         ///< summed squared distance of the origins from the middle
  std::vector<Sample> samples_;
  Random random_;
};

}  // namespace palpate
