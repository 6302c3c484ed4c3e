// What touches that a map has not seen are like.

#include "estimation/maps/left_out_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "model/body_spread.hpp"
#include "model/random.hpp"
#include "palpate/files.hpp"
#include "palpate/simulation.hpp"
#include "support/scratch_folder.hpp"
#include "support/shared_device.hpp"

namespace palpate::left_out_fit_test {

/// Touches of the letter E.
Recording touches(std::size_t count, std::uint64_t seed) {
  Simulator simulator(make_shape("E"), {}, digitacts_array(), 5);
  Recording recording = simulator.touch(random_poses(count, seed), {});
  recording.object = "E";
  return recording;
}

OccupancyGrid map_of(const Recording& recording) {
  MapBuilder builder(shared_device(), MapOptions());
  builder.add(recording.touches(0, recording.size()));
  return builder.build("E");
}

/// The source of a map of these touches, with what they are like where they are left out.
MapSource judged(const Recording& recording, const std::vector<std::string>& groups = {}) {
  MapSource source{.touches = recording, .options = MapOptions(), .groups = groups};
  judge_left_out(shared_device(), source);
  return source;
}

TEST(LeftOutFit, IsThatOfTouchesToCome) {
  const Recording learned = touches(150, 1);
  const OccupancyGrid map = map_of(learned);
  std::vector<double> z;
  const Recording others = touches(100, 2);
  for (const Touch& touch : others.touches(0, 100)) {
    z.push_back(fit_of(std::span(&touch, 1), Pose{}, map, ContactModel{})->z);
  }
  const FitScale to_come = scale_of(z).value();
  const FitScale told = judged(learned).left_out.value();
  // Three standard errors; a quarter less touches makes the maps a little worse, too.
  EXPECT_NEAR(told.mean, to_come.mean, 3.0 * told.sd * std::sqrt(1.0 / 150 + 1.0 / 100) + 0.03);
  EXPECT_NEAR(told.sd / to_come.sd, 1.0, 0.5) << "rare touches make most of it";
}

TEST(LeftOutFit, NeedsSixteenTouchesInContact) {
  Recording few = touches(40, 1);
  std::fill_n(few.pressure.begin(), 25 * few.elements(), 0.0);
  EXPECT_FALSE(judged(few).left_out);
  EXPECT_FALSE(judged(few).pose_scale);
}

TEST(LeftOutFit, IsKeptInTheMapsFile) {
  const ScratchFolder folder;
  const Recording learned = touches(40, 1);
  OccupancyGrid map = map_of(learned);
  MapSource grouped = judged(learned);
  grouped.groups.assign(25, "anna");
  grouped.groups.resize(40, "b\"en");
  grouped.pose_scale = PoseScale{.factor = 0.5, .map_sd_mm = 0.125};
  MapSource back;
  for (const MapSource& source : {MapSource{learned, MapOptions()}, grouped}) {
    map.source = std::make_shared<const MapSource>(source);
    write_map(folder / "E.map.h5", map);
    back = *read_map(folder / "E.map.h5").source;
    EXPECT_EQ(back.groups, source.groups);
    ASSERT_EQ(back.left_out.has_value(), source.left_out.has_value());
    ASSERT_EQ(back.pose_scale.has_value(), source.pose_scale.has_value());
    EXPECT_EQ(with_prior(shared_device(), map, 0.3).source->left_out.has_value(),
              source.left_out.has_value());
  }
  EXPECT_EQ(back.left_out->mean, grouped.left_out->mean);
  EXPECT_EQ(back.left_out->sd, grouped.left_out->sd);
  EXPECT_EQ(back.pose_scale->factor, 0.5);
  EXPECT_EQ(back.pose_scale->map_sd_mm, 0.125);
}

/// Errors of groups whose belief is some 0.5 or 0.1 mm wide along each axis, and really spread by
/// the factor, with the map's own part.
std::vector<PlaceError> drawn(const PoseScale& truth, int count) {
  Random random(7, Stream::readings);
  std::vector<PlaceError> errors;
  for (int i = 0; i < count; ++i) {
    const double sd = i % 2 == 0 ? 0.5 : 0.1;
    PlaceError error{.covariance = glm::dmat3(sd * sd)};
    for (int axis = 0; axis < 3; ++axis) {
      error.moved_mm[axis] =
          std::hypot(std::sqrt(truth.factor) * sd, truth.map_sd_mm) * random.normal();
    }
    errors.push_back(error);
  }
  return errors;
}

TEST(PoseScale, TellsWhatTouchesShareFromWhatFallsAsTheyAddUp) {
  for (const PoseScale& truth : {PoseScale{0.4, 0.0}, PoseScale{1.0, 0.08}, PoseScale{2.0, 0.2}}) {
    const PoseScale found = pose_scale_of(drawn(truth, 400)).value();
    // 600 squares tell a variance to 6 %.
    EXPECT_NEAR(found.factor / truth.factor, 1.0, 0.2);
    EXPECT_NEAR(found.map_sd_mm, truth.map_sd_mm, 0.025);
  }
  EXPECT_FALSE(pose_scale_of(drawn({}, 15))) << "too few";
}

TEST(PoseScale, MovesTheBodyAsFarAlongEveryAxis) {
  const Body body{.centroid_mm = {3.0, -2.0}, .inertia_mm2 = 49.0};
  const ObjectPose pose{{{5.0, 1.0}, 0.7}, {0.2, 0.05, 0.01, 0.05, 0.3, -0.02, 0.01, -0.02, 0.004}};
  const glm::dmat3 before = motion_covariance(body, pose);
  const glm::dmat3 after = motion_covariance(body, scaled(body, pose, {0.5, 0.1}));
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(after[i][k], 0.5 * before[i][k] + (i == k ? 0.01 : 0.0), 1e-12);
    }
  }
}

TEST(LeftOutFit, TouchesOfATurnedArrayAreAtOnePlace) {
  Recording recording = touches(6, 1);
  const glm::dvec2 middle_mm = array_centre_mm(recording.elements_mm);
  const std::vector<glm::dvec2> at_mm{{0.2, 0.0}, {7.0, 0.0}, {0.2, 0.0},
                                      {1.0, 0.0}, {7.0, 0.0}, {7.0, 1.1}};
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const double theta_rad = 0.5 * static_cast<double>(i);
    recording.T_robot_sensor[i] = {at_mm[i] - rotate(theta_rad, middle_mm), theta_rad};
  }
  const std::vector<TouchEvidence> evidence =
      evidence_of(recording.touches(0, recording.size()), ContactModel{});
  EXPECT_EQ(places_of(evidence, 3), (std::vector<std::size_t>{0, 1, 0, 0, 1, 2}));
  EXPECT_EQ(places_of(evidence, 4), (std::vector<std::size_t>{0, 1, 2, 3, 4, 5})) << "too few";
}

// On every day the object lies elsewhere, by more than touches of one day can tell.
TEST(LeftOutFit, IsOfGroupsOnMapsWithoutThem) {
  constexpr std::array offsets_mm{0.5, -0.5, 0.4, -0.4};
  Recording recording = touches(120, 3);
  const PoseScale still = judged(recording).pose_scale.value();
  EXPECT_LT(still.factor, 0.7) << "Eq. 7 is less sure of poses than this sensor deserves";
  EXPECT_GT(still.factor, 0.1);
  EXPECT_LT(still.map_sd_mm, 0.15);
  std::vector<std::string> days;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    recording.T_robot_sensor[i].translation_mm +=
        glm::dvec2(offsets_mm[i / 30], -offsets_mm[(i / 30 + 2) % 4]);
    days.push_back("day " + std::to_string(i / 30));
  }
  const MapSource by_places = judged(recording);
  const MapSource by_days = judged(recording, days);
  EXPECT_LT(by_places.pose_scale->map_sd_mm, 0.25) << "others of the same day are in the map";
  // Three other days move a map by a third of a day's offset the other way; theta moves by less.
  EXPECT_GT(by_days.pose_scale->map_sd_mm, 0.35);
  EXPECT_LT(by_days.pose_scale->map_sd_mm, 0.75);
  EXPECT_LT(by_days.left_out->mean, by_places.left_out->mean);
  const MapSource one_day = judged(recording, std::vector<std::string>(120, "one day"));
  EXPECT_EQ(one_day.pose_scale->map_sd_mm, by_places.pose_scale->map_sd_mm)
      << "one group tells of no other";
}

// The map of three corners knows nothing of the fourth, at whatever angle it was touched there.
TEST(LeftOutFit, PosesAreSoughtOnMapsWithoutTheirPlaces) {
  const glm::dvec2 middle_mm = array_centre_mm(digitacts_array());
  std::vector<Pose> poses;
  for (int k = 0; k < 80; ++k) {
    const glm::dvec2 corner_mm(k % 2 == 0 ? -9.0 : 9.0, k / 2 % 2 == 0 ? -13.0 : 13.0);
    poses.push_back({corner_mm - rotate(0.3 * k, middle_mm), 0.3 * k});
  }
  Simulator simulator(make_shape("E"), {}, digitacts_array(), 5);
  const MapSource source = judged(simulator.touch(poses, {}));
  EXPECT_TRUE(source.left_out) << "touches were judged";
  EXPECT_FALSE(source.pose_scale) << "but found nowhere";
}

}  // namespace palpate::left_out_fit_test
