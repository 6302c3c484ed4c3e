// Touches of a robot that misplaces them, aligned to the map that they make.

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "learning/touch_alignment.hpp"
#include "model/displacement_points.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/simulation.hpp"
#include "reference/reference.hpp"
#include "support/shared_device.hpp"

namespace palpate::touch_alignment_test {

constexpr DisplacementSd robot_sd{1.0, 0.05};

/// Touches of a letter at every other pose of the training grid, as a robot reports them that
/// misplaces them by `sd`.
struct Touched {
  explicit Touched(const DisplacementSd& sd = {}) {
    Simulator simulator(make_shape("E"), {}, digitacts_array(), 7);
    const std::vector<Pose> grid = training_grid();
    std::vector<Pose> poses;
    for (std::size_t i = 0; i < grid.size(); i += 2) {
      poses.push_back(grid[i]);
    }
    truth = simulator.touch(poses, {});
    held_out = simulator.touch(random_poses(50, 5), {});
    reported = truth;
    Random random(11, Stream::pose_noise);
    for (Pose& pose : reported.T_robot_sensor) {
      pose = pose * inverse(random_displacement(sd, random));
    }
  }

  /// Aligns them, in place.
  TouchAlignment align(const DisplacementSd& sd) {
    std::vector<ObjectTouches> objects{{"E", reported.touches(0, reported.size())}};
    const TouchAlignment found = align_touches(objects, sd, {});
    for (std::size_t i = 0; i < reported.size(); ++i) {
      reported.T_robot_sensor[i] = objects[0].touches[i].T_robot_sensor;
    }
    return found;
  }

  /// Root mean square distance from the truth along x and y, in mm.
  double error_mm() const {
    double squares = 0.0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const glm::dvec2 d =
          reported.T_robot_sensor[i].translation_mm - truth.T_robot_sensor[i].translation_mm;
      squares += glm::dot(d, d) / 2.0;
    }
    return std::sqrt(squares / static_cast<double>(truth.size()));
  }

  /// Mean log-likelihood of exact touches that the map of these has not seen, in nats.
  double held_out_nats(const Recording& learned) const {
    MapBuilder builder(shared_device(), {});
    builder.add(learned.touches(0, learned.size()));
    const OccupancyGrid map = builder.build("E");
    const ContactModel contact{.prior = map.prior};
    double sum = 0.0;
    for (const Touch& touch : held_out.touches(0, held_out.size())) {
      sum += reference::log_likelihood(touch, {}, map, contact);
    }
    return sum / static_cast<double>(held_out.size());
  }

  Recording truth;
  Recording held_out;
  Recording reported;
};

TEST(TouchAlignment, OfAnExactRobotChangesNoBitAndLeavesWhatHasNoDeviation) {
  Touched touched(robot_sd);
  const std::vector<Pose> before = touched.reported.T_robot_sensor;
  const auto same = [&](const auto& part) {
    return std::ranges::equal(touched.reported.T_robot_sensor, before, {}, part, part);
  };
  EXPECT_EQ(touched.align({}).rounds, 0);
  EXPECT_TRUE(same(&Pose::translation_mm) && same(&Pose::theta_rad));
  touched.align({0.0, 0.05});
  EXPECT_TRUE(same(&Pose::translation_mm));
  EXPECT_FALSE(same(&Pose::theta_rad));
}

TEST(TouchAlignment, MovesExactTouchesByLittle) {
  Touched touched;
  const TouchAlignment found = touched.align(robot_sd);
  EXPECT_LT(found.moved.mm, 0.35 * robot_sd.mm);
  EXPECT_LT(found.moved.rad, 0.35 * robot_sd.rad);
  EXPECT_LT(found.displaced.mm, 0.75 * robot_sd.mm) << "fewer than were said";
}

TEST(TouchAlignment, BringsBackWhatMisplacedTouchesCostAndKeepsThemTogether) {
  Touched touched(robot_sd);
  const std::vector<Pose> before = touched.reported.T_robot_sensor;
  const double before_mm = touched.error_mm();
  const double exact = touched.held_out_nats(touched.truth);
  const double misplaced = touched.held_out_nats(touched.reported);
  const TouchAlignment found = touched.align(robot_sd);
  const double aligned = touched.held_out_nats(touched.reported);
  EXPECT_LT(touched.error_mm(), 0.6 * before_mm);
  EXPECT_LT(misplaced, exact - 1.0) << "there is something to bring back";
  EXPECT_GT(aligned, misplaced + 0.75 * (exact - misplaced));
  EXPECT_NEAR(found.displaced.mm, robot_sd.mm, 0.15);
  EXPECT_LE(found.rounds, 5);

  const std::vector<Pose>& after = touched.reported.T_robot_sensor;
  glm::dvec2 shift{0.0};
  glm::dvec2 middle{0.0};
  for (std::size_t i = 0; i < before.size(); ++i) {
    shift += after[i].translation_mm - before[i].translation_mm;
    middle += after[i].translation_mm / static_cast<double>(before.size());
  }
  EXPECT_LT(glm::length(shift), 1e-9);
  double turn = 0.0;  // of the sum of squares, relative to the standard deviations
  for (std::size_t i = 0; i < before.size(); ++i) {
    const glm::dvec2 arm = after[i].translation_mm - middle;
    const glm::dvec2 d = after[i].translation_mm - before[i].translation_mm;
    turn += (arm.x * d.y - arm.y * d.x) / std::pow(robot_sd.mm, 2.0) +
            (after[i].theta_rad - before[i].theta_rad) / std::pow(robot_sd.rad, 2.0);
  }
  // One step of Gauss and Newton from round to round leaves what is beyond first order.
  EXPECT_LT(std::abs(turn), 5.0);
}

TEST(PredictiveMap, OfTheOthersIsTheMapWithoutTheTouch) {
  const Touched touched;
  const std::vector<Touch> all = touched.truth.touches(0, 40);
  PredictiveMap map(all, {});
  map.take_out(7);
  std::vector<Touch> others = all;
  others.erase(others.begin() + 7);
  MapOptions options;
  OccupancyGrid grid{.cell_mm = 0.5, .origin_mm = {-22.0, -22.0}, .nx = 89, .ny = 89};
  grid.prior = options.sensor.prior;
  for (const double l : reference::log_odds_map(others, grid, options.classifier, options.sensor)) {
    grid.log_odds.push_back(static_cast<float>(l));
  }
  ContactModel contact;
  contact.prior = options.sensor.prior;
  // Each reading's log odds lack tails below 1e-3 nats, of a few readings around it.
  EXPECT_NEAR(map.log_likelihood(7, all[7].T_robot_sensor),
              reference::log_likelihood(all[7], {}, grid, contact), 0.1);
  const double without = map.log_likelihood(7, all[7].T_robot_sensor);
  map.put_in(7, all[7].T_robot_sensor);
  EXPECT_GT(map.log_likelihood(7, all[7].T_robot_sensor), without) << "it predicts itself";
  map.take_out(7);
  EXPECT_NEAR(map.log_likelihood(7, all[7].T_robot_sensor), without, 1e-9);
}

}  // namespace palpate::touch_alignment_test
