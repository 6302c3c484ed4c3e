#include "palpate/pose_track.hpp"

#include <numbers>

#include "support/limits.hpp"

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
  EXPECT_FALSE(track.last_s());
  track.add(1.0, {});
  track.add(1.0625, {});
  track.add(2.0, {});
  EXPECT_FALSE(track.at(0.999));
  EXPECT_TRUE(track.at(1.03));
  EXPECT_FALSE(track.at(1.5));
  EXPECT_TRUE(track.at(2.0));
  EXPECT_FALSE(track.at(2.001));
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

// Poses 10 ms apart, x = their index.
double time_of(int i) { return 1.7e9 + 0.01 * i; }

void add(PoseTrack& track, int begin, int end, double ahead_s = 0.0) {
  for (int i = begin; i < end; ++i) {
    track.add(time_of(i) + ahead_s, {{1.0 * i, 0.0}, 0.0});
  }
}

// Between every two poses the track knows where the sensor was.
void expect_known(const PoseTrack& track, int begin, int end, double ahead_s = 0.0) {
  for (int i = begin; i + 1 < end; ++i) {
    const auto pose = track.at(time_of(i) + ahead_s + 0.005);
    ASSERT_TRUE(pose) << i;
    EXPECT_NEAR(pose->translation_mm.x, i + 0.5, 1e-4);  // times are good to 2.4e-7 of 10 ms
  }
}

TEST(PoseTrack, DropsOnePoseStampedWrongly) {
  for (const double wrong_s : {1.7e12, 1e300, 0.0, -1.7e9, 1.7e9 - 3600.0, 1.7e9 + 3600.0}) {
    SCOPED_TRACE(wrong_s);
    PoseTrack track;
    add(track, 0, 50);
    EXPECT_FALSE(track.add(wrong_s, {{-999.0, 0.0}, 0.0}));
    EXPECT_EQ(track.last_s(), time_of(49));
    EXPECT_EQ(track.set_aside(), 1u);
    add(track, 50, 100);
    expect_known(track, 0, 100);
    EXPECT_EQ(track.size(), 100u);
    EXPECT_EQ(track.dropped(), 1u);
    EXPECT_EQ(track.set_aside(), 0u);
    EXPECT_EQ(track.set_back(), 0u);
  }
}

TEST(PoseTrack, TwoAndEverySecondStampedWronglyAreDropped) {
  PoseTrack track;
  add(track, 0, 10);
  track.add(1.7e12, {});
  track.add(1.8e12, {});
  for (int i = 10; i < 50; ++i) {
    add(track, i, i + 1);
    track.add(1000.0 * time_of(i), {});
    track.add(time_of(i), {});
  }
  expect_known(track, 0, 50);
  EXPECT_EQ(track.dropped() + track.set_aside(), 82u);
}

TEST(PoseTrack, DropsAFirstPoseStampedWrongly) {
  for (const double wrong_s : {1.7e12, 1.7e6}) {
    PoseTrack track;
    EXPECT_TRUE(track.add(wrong_s, {}));
    add(track, 0, 20);
    expect_known(track, 0, 20);
    EXPECT_EQ(track.last_s(), time_of(19));
  }
}

TEST(PoseTrack, FollowsAClockThatIsSetBack) {
  for (const double back_s : {-3600.0, -1.0, -0.1}) {
    SCOPED_TRACE(back_s);
    PoseTrack track;
    add(track, 0, 50);
    add(track, 50, 100, back_s);
    expect_known(track, 50, 100, back_s);
    EXPECT_EQ(track.last_s(), time_of(99) + back_s);
    EXPECT_EQ(track.set_back(), 1u);
    EXPECT_EQ(track.dropped(), 0u);
  }
}

TEST(PoseTrack, LosesNoPoseByAPause) {
  for (const double ahead_s : {0.5, 0.98, 1.0, 2.0, 3600.0}) {
    PoseTrack track;
    add(track, 0, 50);
    add(track, 50, 52, ahead_s);
    // From the last pose to the next it is 10 ms more than that; 10 gaps are 1 s.
    EXPECT_EQ(track.set_aside(), ahead_s > 0.99 ? 2u : 0u);
    add(track, 52, 60, ahead_s);
    expect_known(track, 0, 50);
    expect_known(track, 50, 60, ahead_s);
    EXPECT_FALSE(track.at(time_of(49) + 0.3));
    EXPECT_EQ(track.dropped() + track.set_back() + track.set_aside(), 0u);
  }
}

TEST(PoseTrack, JoinsPosesFarApartByThreesAndThoseSentTwiceOnce) {
  PoseTrack far;
  PoseTrack twice;
  for (int i = 0; i < 10; ++i) {
    far.add(100.0 * i, {{1.0 * i, 0.0}, 0.0});
    add(twice, i, i + 1);
    EXPECT_FALSE(twice.add(time_of(i), {}));
  }
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(far.at(100.0 * i));
    EXPECT_EQ(far.at(100.0 * i)->translation_mm.x, i);
  }
  EXPECT_EQ(far.dropped(), 0u);
  expect_known(twice, 0, 10);
  EXPECT_EQ(twice.size(), 10u);
  EXPECT_EQ(twice.dropped() + twice.set_aside(), 10u);
}

TEST(PoseTrack, JoinsAtTheEndWhatIsLater) {
  for (const bool later : {true, false}) {
    PoseTrack track;
    track.end();
    EXPECT_EQ(track.size(), 0u);
    add(track, 0, 5);
    track.add(later ? time_of(5) + 5.0 : 5.0, {});
    track.end();
    EXPECT_EQ(track.size(), later ? 6u : 5u);
    EXPECT_EQ(track.dropped(), later ? 0u : 1u);
  }
}

TEST(PoseTrack, TakesNoPoseThatNoRobotHas) {
  for (const double wrong : {nan, infinity, -infinity, 1.7e308, -1.7e308, 1.1e9}) {
    SCOPED_TRACE(wrong);
    PoseTrack track;
    add(track, 0, 2);
    EXPECT_FALSE(track.add(time_of(2), {{wrong, 0.0}, 0.0}));
    EXPECT_FALSE(track.add(time_of(2), {{0.0, wrong}, 0.0}));
    EXPECT_FALSE(track.add(time_of(2), {{0.0, 0.0}, wrong}));
    EXPECT_EQ(track.dropped(), 3u);
    add(track, 2, 4);
    expect_known(track, 0, 4);
  }
  PoseTrack track;
  for (const double wrong_s : {nan, infinity, -infinity}) {
    EXPECT_FALSE(track.add(wrong_s, {}));
  }
  EXPECT_EQ(track.size(), 0u);
  EXPECT_TRUE(track.add(1.0, {{1e9, -1e9}, 1e9})) << "the bound itself";
}

}  // namespace palpate::pose_track_test
