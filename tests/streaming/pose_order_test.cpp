// Poses out of the order of time, and from robots that no one has.

#include <gtest/gtest.h>

#include "palpate/pose_track.hpp"
#include "support/limits.hpp"

namespace palpate::pose_order_test {

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

TEST(PoseOrder, OnePoseStampedWronglyIsDropped) {
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

TEST(PoseOrder, SoAreTwoAndEverySecond) {
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

TEST(PoseOrder, TheFirstPoseMayBeTheWrongOne) {
  for (const double wrong_s : {1.7e12, 1.7e6}) {
    PoseTrack track;
    EXPECT_TRUE(track.add(wrong_s, {}));
    add(track, 0, 20);
    expect_known(track, 0, 20);
    EXPECT_EQ(track.last_s(), time_of(19));
  }
}

TEST(PoseOrder, AClockThatIsSetBackIsFollowed) {
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

TEST(PoseOrder, APauseLosesNoPose) {
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

TEST(PoseOrder, PosesFarApartJoinByThrees) {
  PoseTrack track;
  for (int i = 0; i < 10; ++i) {
    track.add(100.0 * i, {{1.0 * i, 0.0}, 0.0});
  }
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(track.at(100.0 * i));
    EXPECT_EQ(track.at(100.0 * i)->translation_mm.x, i);
  }
  EXPECT_EQ(track.dropped(), 0u);
}

TEST(PoseOrder, PosesSentTwiceAreTakenOnce) {
  PoseTrack track;
  for (int i = 0; i < 100; ++i) {
    add(track, i, i + 1);
    add(track, i, i + 1);
  }
  expect_known(track, 0, 100);
  EXPECT_EQ(track.size(), 100u);
  EXPECT_EQ(track.dropped() + track.set_aside(), 100u);
}

TEST(PoseOrder, AtTheEndWhatIsLaterJoins) {
  PoseTrack later;
  add(later, 0, 5);
  later.add(time_of(5) + 5.0, {});
  later.end();
  EXPECT_EQ(later.size(), 6u);
  EXPECT_EQ(later.dropped(), 0u);
  PoseTrack earlier;
  add(earlier, 0, 5);
  earlier.add(5.0, {});
  earlier.end();
  EXPECT_EQ(earlier.size(), 5u);
  EXPECT_EQ(earlier.dropped(), 1u);
  PoseTrack none;
  none.end();
  EXPECT_EQ(none.size(), 0u);
}

TEST(PoseOrder, TakesNoPoseThatNoRobotHas) {
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

}  // namespace palpate::pose_order_test
