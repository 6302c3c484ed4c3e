#include "palpate/pose_track.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace palpate::pose_track_test {

constexpr double pi = std::numbers::pi;

TEST(PoseTrack, InterpolatesBetweenPoses) {
  PoseTrack track(1.0);
  EXPECT_TRUE(track.add(10.0, {{0.0, 4.0}, 0.5}));
  EXPECT_TRUE(track.add(11.0, {{2.0, 0.0}, 1.5}));
  const auto pose = track.at(10.25);
  ASSERT_TRUE(pose);
  EXPECT_DOUBLE_EQ(pose->translation_mm.x, 0.5);
  EXPECT_DOUBLE_EQ(pose->translation_mm.y, 3.0);
  EXPECT_DOUBLE_EQ(pose->theta_rad, 0.75);
  EXPECT_DOUBLE_EQ(track.at(11.0)->theta_rad, 1.5);
  EXPECT_DOUBLE_EQ(track.at(10.0)->theta_rad, 0.5);
}

TEST(PoseTrack, TurnsTheShortWay) {
  PoseTrack track(1.0);
  track.add(0.0, {{}, pi - 0.1});
  track.add(1.0, {{}, -pi + 0.1});
  EXPECT_NEAR(track.at(0.5)->theta_rad, pi, 1e-12);  // rounding
  EXPECT_NEAR(track.at(0.75)->theta_rad, pi + 0.05, 1e-12);
}

TEST(PoseTrack, KnowsNothingOutsideAndInAGap) {
  PoseTrack track(0.1);
  EXPECT_FALSE(track.at(0.0));
  track.add(1.0, {});
  track.add(1.0625, {});
  track.add(2.0, {});
  EXPECT_FALSE(track.at(0.999));
  EXPECT_TRUE(track.at(1.03));
  EXPECT_FALSE(track.at(1.5));
  EXPECT_TRUE(track.at(2.0));
  EXPECT_FALSE(track.at(2.001));
}

TEST(PoseTrack, TakesPosesInOrderOnly) {
  PoseTrack track;
  EXPECT_FALSE(track.last_s());
  EXPECT_TRUE(track.add(1.0, {}));
  EXPECT_FALSE(track.add(1.0, {}));
  EXPECT_FALSE(track.add(0.5, {}));
  EXPECT_EQ(track.last_s(), 1.0);
  EXPECT_EQ(track.size(), 1u);
}

TEST(PoseTrack, ForgettingKeepsWhatIsStillAskedFor) {
  PoseTrack track(1.0);
  for (int i = 0; i < 100; ++i) {
    track.add(0.5 * i, {{0.5 * i, 0.0}, 0.0});
  }
  track.forget_before(40.25);
  EXPECT_EQ(track.size(), 20u);
  ASSERT_TRUE(track.at(40.25));
  EXPECT_DOUBLE_EQ(track.at(40.25)->translation_mm.x, 40.25);
  track.forget_before(1e9);
  EXPECT_EQ(track.last_s(), 49.5);
}

}  // namespace palpate::pose_track_test
