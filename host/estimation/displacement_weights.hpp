#pragma once

#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/lattice.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// Bins to either side that a Gaussian reaches: 4 standard deviations. An axis of one bin is not
/// blurred.
int blur_steps(const Axis& axis, double sd);
/// The weight of a bin so many steps away; that of the bin itself is 1.
double blur_weight(int steps, const Axis& axis, double sd);

/// A Gaussian along x or y, between tiles of bins. Of tiles of one bin, these are the weights of
/// the definition; of larger tiles, no bin of a tile gives another tile's bins together more than
/// this.
struct AxisBlur {
  /// @param bins of a tile along the axis
  AxisBlur(const Axis& axis, double sd, int bins);

  int reach() const { return static_cast<int>(weight.size()) - 1; }

  int steps = 0;               ///< bins to either side that the Gaussian reaches
  std::vector<double> weight;  ///< [distance in tiles]
  std::vector<double> scale;   ///< [tile] 1 over the sum of the weights inside the region
};

/// What a touch's mean takes from one theta: the likelihoods of bins that lie `bins` + `fraction`
/// away along x and y. By definition, fractions are rounded to 2^-20 of a bin: then float32 holds
/// them, and no rounding of the place lets a neighbour in that it does not reach.
struct Tap {
  int theta = 0;
  int steps = 0;  ///< of theta, by which it is turned
  double weight = 0.0;
  glm::ivec2 bins{0};
  glm::dvec2 fraction{0.0};
};

/// The part of bilinear weights along an axis, of a bin and of the next one, that lies inside the
/// region.
/// @param fraction of the way from the bin to the next
inline double part_inside(const Axis& axis, int bin, double fraction) {
  const auto holds = [&](int at) { return at >= 0 && at < axis.count; };
  return (holds(bin) ? 1.0 - fraction : 0.0) + (holds(bin + 1) ? fraction : 0.0);
}

/// The displacements of a touch on a lattice.
class DisplacementWeights {
 public:
  DisplacementWeights(const PoseLattice& lattice, const DisplacementSd& sd);

  const PoseLattice& lattice() const { return lattice_; }
  const DisplacementSd& sd() const { return sd_; }
  int theta_steps() const { return theta_steps_; }
  /// The thetas that a mean at this theta takes likelihoods from, as far as the region reaches.
  /// @param sensor_from_pivot_mm the sensor's origin, in the robot frame
  /// @param reuse memory for the result
  std::vector<Tap> taps(int theta, const glm::dvec2& sensor_from_pivot_mm,
                        std::vector<Tap> reuse = {}) const;
  /// How far the bins that a mean takes lie from a tap's place, in mm along x and y, at most.
  glm::dvec2 reach_mm() const;

 private:
  PoseLattice lattice_;
  DisplacementSd sd_;
  int theta_steps_;
};

/// The largest standard deviations that a lattice takes: for mm the smaller extent of x and y, for
/// rad the extent of theta. An axis of one bin limits nothing; infinity where no axis does.
DisplacementSd widest_displacement(const PoseLattice& lattice);

/// Throws Error, "<name> mm = ..." or "<name> rad = ...", unless both standard deviations are
/// finite, at least 0 and within widest_displacement().
void validate_displacement(const DisplacementSd& sd, const PoseLattice& lattice, const char* name);

// A lattice does not resolve a displacement where it blurs too little or at the wrong place. Each
// function returns that as a sentence with the remedy, or none where the lattice does resolve it.
// `name` is that of the displacement. An axis of one bin, or a deviation of 0, is not blurred.

/// A standard deviation is below half a step of an axis.
std::optional<std::string> unresolved_by_steps(const DisplacementSd& sd, const PoseLattice& lattice,
                                               const char* name);
/// A step of theta moves the sensor's origin by more than twice the larger of sd.mm and the step of
/// x: |r| theta_step > 2 max(sd.mm, x_step), with r from the pivot to the sensor's origin.
std::optional<std::string> unresolved_at(const Pose& T_robot_sensor, const DisplacementSd& sd,
                                         const PoseLattice& lattice, const char* name);

}  // namespace palpate
