#include "pose_window.hpp"

#include <algorithm>
#include <numbers>

#include <gtest/gtest.h>

#include "letters.hpp"
#include "palpate/pose_histogram.hpp"
#include "trials.hpp"

namespace palpate::bench::pose_window_test {

const PoseLattice lattice = lattice_of(20, 24, 36);

PlacedBody placed(int symmetry) {
  return {.body = {.centroid_mm = {0.7, -0.4}, .inertia_mm2 = 80.0},
          .symmetry = symmetry,
          .T_object_robot = {{6.0, -7.5}, 0.2}};
}

double error_of(const PlacedBody& body, const Pose& T_object_robot) {
  return pose_error_mm(body.body, body.symmetry, T_object_robot, body.T_object_robot);
}

bool same_bin(const Pose& a, const Pose& b) {
  // Rounding of the axes' ends.
  const glm::dvec2 away_mm = a.translation_mm - b.translation_mm;
  return std::max(std::abs(away_mm.x), std::abs(away_mm.y)) < 1e-9 &&
         std::abs(wrap_angle(a.theta_rad - b.theta_rad, 2.0 * std::numbers::pi)) < 1e-9;
}

TEST(PoseWindow, HoldsEveryNearBinAndOnlyBinsOfTheLattice) {
  constexpr double reach_mm = 3.0;
  for (const int symmetry : {0, 1, 2}) {
    const PlacedBody body = placed(symmetry);
    std::vector<Pose> in_windows;
    for (const PoseLattice& window : windows_about(lattice, body, reach_mm)) {
      for (std::int64_t bin = 0; bin < window.bins(); ++bin) {
        in_windows.push_back(window.T_object_robot(bin));
      }
    }
    EXPECT_LT(in_windows.size(), static_cast<std::size_t>(lattice.bins()));
    std::size_t of_lattice = 0;
    for (std::int64_t bin = 0; bin < lattice.bins(); ++bin) {
      const Pose pose = lattice.T_object_robot(bin);
      const auto count = std::count_if(in_windows.begin(), in_windows.end(),
                                       [&](const Pose& other) { return same_bin(pose, other); });
      of_lattice += static_cast<std::size_t>(count);
      if (error_of(body, pose) <= reach_mm) {
        EXPECT_GE(count, 1) << symmetry << " at bin " << bin;
      }
    }
    EXPECT_EQ(of_lattice, in_windows.size()) << symmetry;
  }
}

TEST(PoseWindow, NearestBinIsTheNearestOfAll) {
  for (const int symmetry : {0, 1, 2}) {
    const PlacedBody body = placed(symmetry);
    double least_mm = 1e9;
    for (std::int64_t bin = 0; bin < lattice.bins(); ++bin) {
      least_mm = std::min(least_mm, error_of(body, lattice.T_object_robot(bin)));
    }
    EXPECT_DOUBLE_EQ(nearest_bin_mm(lattice, body), least_mm) << symmetry;
  }
}

TEST(PoseWindow, GivesThePosesOfTheFullPosterior) {
  Device device = Device::open();
  const std::vector<Hypothesis> letters = letter_maps(device, training_recordings(), MapOptions{});
  const PoseLattice fine = lattice_of(32, 32, 122);
  PoseHistogram histogram(device, letters, {.lattice = fine});
  // Without, with two-fold and with full symmetry.
  const std::vector<std::string> names = {"E", "I", "O"};
  for (const Recording& trial : make_trials(names, 1, 15, 5)) {
    histogram.reset();
    histogram.update(all_touches(trial));
    const Mode mode = histogram.estimate().mode;
    ASSERT_EQ(letters[mode.object].map.label, trial.truth->object);
    const RecognitionStep step = estimate_in_window(device, letters, trial, fine);
    EXPECT_TRUE(same_bin(step.mode.T_object_robot, mode.T_object_robot)) << trial.truth->object;
    const OccupancyGrid& map = letters[mode.object].map;
    const Body body = body_of(map);
    // Float32 logs differ by some 1e-5 nats, for other tiles of bins; the window cuts off less.
    EXPECT_LT(
        pose_error_mm(body, 1, step.refined->T_object_robot, histogram.refine(mode).T_object_robot),
        1e-5)
        << trial.truth->object;
    EXPECT_EQ(step.error_mm, pose_error_mm(body, map.symmetry, step.mode.T_object_robot,
                                           trial.truth->T_object_robot));
  }
}

}  // namespace palpate::bench::pose_window_test
