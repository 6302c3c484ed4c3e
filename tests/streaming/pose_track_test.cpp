#include "palpate/pose_track.hpp"

#include <numbers>

#include "support/limits.hpp"

namespace palpate::pose_track_test {

constexpr double pi = std::numbers::pi;

TEST(PoseTrack, InterpolatesBetweenPosesTheShortWay) {
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
  track.add(12.0, {{}, 1.5 + 2.0 * pi - 0.2});
  EXPECT_NEAR(track.at(11.75)->theta_rad, 1.5 - 0.15, 1e-12);  // rounding
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

/// Poses [begin, end) stamped ahead of their time, and whether the track knows them afterwards.
struct Stretch {
  int begin;
  int end;
  double ahead_s = 0.0;
  bool known = true;
};

struct Stamps {
  const char* name;
  std::vector<Stretch> runs;
  std::uint64_t dropped = 0;
  std::uint64_t set_aside = 0;
  std::uint64_t set_back = 0;
  bool ended = false;
};

const Stamps stamps[] = {
    {"one is wrong so far", {{0, 50}, {50, 51, 3600.0, false}}, 0, 1},
    {"one beyond all times", {{0, 50}, {50, 51, 1e300, false}, {50, 100}}, 1},
    {"one an hour back", {{0, 50}, {50, 51, -3600.0, false}, {50, 100}}, 1},
    {"one an hour ahead", {{0, 50}, {50, 51, 3600.0, false}, {50, 100}}, 1},
    {"the first in milliseconds", {{0, 1, 1.7e12, false}, {0, 20}}, 0, 0, 1},
    {"the first of 1970", {{0, 1, -1.7e9}, {0, 20}}},
    {"a clock set back by an hour", {{0, 50, 0.0, false}, {50, 100, -3600.0}}, 0, 0, 1},
    {"a clock set back by little", {{0, 40}, {40, 50, 0.0, false}, {50, 100, -0.1}}, 0, 0, 1},
    // From the last pose to the next it is 10 ms more than that; 10 gaps are 1 s.
    {"a short pause", {{0, 50}, {50, 52, 0.98}}},
    {"two after a pause", {{0, 50}, {50, 52, 1.0, false}}, 0, 2},
    {"a pause of an hour", {{0, 50}, {50, 60, 3600.0}}},
    {"two later ones at the end", {{0, 5}, {5, 7, 5.0}}, 0, 0, 0, true},
    {"one of 1970 at the end", {{0, 5}, {5, 6, -1.7e9, false}}, 1, 0, 0, true},
    {"none at the end", {}, 0, 0, 0, true}};

TEST(PoseTrack, KeepsPosesWhateverTheirStamps) {
  for (const Stamps& row : stamps) {
    SCOPED_TRACE(row.name);
    PoseTrack track;
    std::size_t size = 0;
    std::optional<double> last_s;
    for (const Stretch& run : row.runs) {
      add(track, run.begin, run.end, run.ahead_s);
      size += run.known ? static_cast<std::size_t>(run.end - run.begin) : 0;
      last_s = run.known ? time_of(run.end - 1) + run.ahead_s : last_s;
    }
    if (row.ended) {
      track.end();
    }
    for (const Stretch& run : row.runs) {
      expect_known(track, run.begin, run.known ? run.end : run.begin, run.ahead_s);
    }
    EXPECT_EQ(track.size(), size);
    EXPECT_EQ(track.last_s(), last_s);
    EXPECT_EQ(track.dropped(), row.dropped);
    EXPECT_EQ(track.set_aside(), row.set_aside);
    EXPECT_EQ(track.set_back(), row.set_back);
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

TEST(PoseTrack, JoinsPosesFarApartByThreesAndThoseSentTwiceOnce) {
  PoseTrack far;
  PoseTrack twice;
  for (int i = 0; i < 10; ++i) {
    far.add(100.0 * i, {{1.0 * i, 0.0}, 0.0});
    add(twice, i, i + 1);
    EXPECT_FALSE(twice.add(time_of(i), {}));
  }
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(far.at(100.0 * i).value().translation_mm.x, i);
  }
  EXPECT_EQ(far.dropped(), 0u);
  expect_known(twice, 0, 10);
  EXPECT_EQ(twice.size(), 10u);
  EXPECT_EQ(twice.dropped() + twice.set_aside(), 10u);
}

TEST(PoseTrack, TakesNoPoseThatNoRobotHas) {
  PoseTrack track;
  add(track, 0, 2);
  for (const double wrong : {nan, infinity, -infinity, 1.7e308, -1.7e308, 1.1e9}) {
    EXPECT_FALSE(track.add(time_of(2), {{wrong, 0.0}, 0.0})) << wrong;
    EXPECT_FALSE(track.add(time_of(2), {{0.0, wrong}, 0.0})) << wrong;
    EXPECT_FALSE(track.add(time_of(2), {{0.0, 0.0}, wrong})) << wrong;
  }
  for (const double wrong_s : {nan, infinity, -infinity}) {
    EXPECT_FALSE(track.add(wrong_s, {})) << wrong_s;
  }
  EXPECT_EQ(track.dropped(), 21u);
  add(track, 2, 4);
  expect_known(track, 0, 4);
  EXPECT_TRUE(track.add(time_of(4), {{1e9, -1e9}, 1e9})) << "the bound itself";
}

}  // namespace palpate::pose_track_test
