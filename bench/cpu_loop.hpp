#pragma once

#include <span>
#include <vector>

#include "estimation/contact_evidence.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/pose_histogram.hpp"

namespace palpate::bench {

/// A map with its border, and the lattice's axes in its cells.
struct BorderedMap {
  double cell_mm;
  int width;
  int height;
  std::vector<float> log_odds;       ///< [height, width]
  std::vector<shaders::Split> axes;  ///< nx of x, then ny of y
};

/// The likelihood on the host's cores, for comparison: a thread per core, rows of bins vectorised
/// by the compiler. Coordinates are split into cell and fraction as on the device.
class CpuLoop {
 public:
  CpuLoop(std::span<const Hypothesis> hypotheses, const PoseLattice& lattice,
          const ContactModel& model);

  /// Adds the touches' log-likelihood to all bins.
  void update(std::span<const Touch> touches);
  /// The log-likelihood of every bin of one object in nats, [theta, y, x].
  const std::vector<double>& log_likelihood(std::size_t object) const { return belief_[object]; }

 private:
  /// `rotated` are the elements of the row's theta.
  void add_row(std::size_t object, std::int64_t row, std::span<const shaders::Segment> segments,
               const shaders::RotatedElement* rotated);

  PoseLattice lattice_;
  float random_floor_;  ///< gamma m
  float trust_;         ///< 1 - gamma
  std::vector<BorderedMap> maps_;
  std::vector<std::vector<double>> belief_;
};

}  // namespace palpate::bench
