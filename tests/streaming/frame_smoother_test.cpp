// What smoothed readings and touches are, also where elements read what none can, or no number.

#include "streaming/frame_smoother.hpp"

#include <array>
#include <cfloat>
#include <cmath>

#include "palpate/touch_detector.hpp"
#include "press.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate::frame_smoother_test {

// Sums of float64 without rounding: a window of five frames, and a gap of 64.
constexpr double period_s = 1.0 / 128.0;
constexpr double smooth_s = 5.0 * period_s;
constexpr double gap_s = 64.0 * period_s;

std::vector<std::vector<double>> noise(std::size_t frames, std::size_t elements) {
  Uniform random(11);
  std::vector<std::vector<double>> values(frames, std::vector<double>(elements));
  for (std::vector<double>& frame : values) {
    std::ranges::generate(frame, [&] { return random(10.0, 30.0); });
  }
  return values;
}

// What the smoother says after each frame.
std::vector<std::vector<double>> means_of(const std::vector<std::vector<double>>& frames) {
  FrameSmoother smoother(smooth_s, gap_s);
  std::vector<std::vector<double>> means;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    means.push_back(smoother.add(period_s * static_cast<double>(i), frames[i]));
  }
  return means;
}

TEST(FrameSmoother, IsTheMeanOfTheMediansInItsWindow) {
  const auto frames = noise(40, 3);
  const auto means = means_of(frames);
  for (std::size_t i = 6; i < frames.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      double sum = 0.0;
      for (std::size_t j = i - 4; j <= i; ++j) {
        std::array last{frames[j][k], frames[j - 1][k], frames[j - 2][k]};
        std::ranges::sort(last);
        sum += last[1];
      }
      EXPECT_NEAR(means[i][k], sum / 5.0, 1e-13) << i;  // a few roundings of numbers about 20
    }
  }
}

TEST(FrameSmoother, WhateverHasLeftTheWindowLeavesNoTrace) {
  const auto clean = noise(200, 4);
  const auto expected = means_of(clean);
  for (const double wrong : {1e20, 1e38, -1e38, double{FLT_MAX}, 1e16}) {
    auto frames = clean;
    frames[50][1] = frames[51][1] = wrong;  // the median passes two in a row
    const auto means = means_of(frames);
    EXPECT_GT(std::abs(means[52][1]), 1e14) << wrong;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      EXPECT_TRUE(std::isfinite(means[i][1]));
      for (std::size_t k = 0; k < 4; ++k) {
        // In a window of five frames, and one frame more in the medians.
        if (k != 1 || i < 50 || i > 57) {
          ASSERT_EQ(means[i][k], expected[i][k]) << wrong << ", frame " << i;
        }
      }
    }
  }
}

// A spike beside an Unknown reading is a single bad reading still.
TEST(FrameSmoother, UnknownReadingsTakeNoPartInMediansAndMeans) {
  const auto other = noise(60, 2);
  auto frames = other;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i][0] = i == 20 || i == 26 ? 1e9 : i % 2 == 0 ? 7.0 : nan;
  }
  const auto means = means_of(frames);
  const auto alone = means_of(other);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(means[i][0], 7.0) << i;
    EXPECT_EQ(means[i][1], alone[i][1]) << "of another element's";
  }
}

TEST(FrameSmoother, AnElementThatIsUnknownKeepsItsMeanForAGap) {
  std::vector<std::vector<double>> frames(100, {3.0});
  for (std::size_t i = 20; i < 90; ++i) {
    frames[i] = {nan};
  }
  const auto means = means_of(frames);
  EXPECT_EQ(means[19 + 64][0], 3.0);
  EXPECT_EQ(means[19 + 65][0], 0.0);
  EXPECT_EQ(means[90][0], 3.0);
  EXPECT_EQ(means_of({{nan}})[0][0], 0.0);
}

TEST(FrameSmoother, ResetForgetsEverything) {
  FrameSmoother smoother(smooth_s, gap_s);
  smoother.add(1.0, {1e30, 5.0});
  smoother.add(1.01, {1e30, 5.0});
  smoother.reset();
  EXPECT_EQ(smoother.add(0.5, {2.0, nan}), (std::vector<double>{2.0, 0.0}));
}

// Where times do not advance, 256 frames are kept, of those the last.
TEST(FrameSmoother, TimesThatStandStillKeepABoundedWindow) {
  FrameSmoother smoother(smooth_s, gap_s);
  for (int i = 0; i < 1000; ++i) {
    smoother.add(1.0, {100.0});
  }
  // The median of the first is still 100.
  for (int i = 0; i < 255; ++i) {
    smoother.add(1.0, {1.0});
  }
  EXPECT_EQ(smoother.add(1.0, {1.0})[0], (100.0 + 255.0) / 256.0);
  EXPECT_EQ(smoother.add(1.0, {1.0})[0], 1.0);
}

const std::vector<double> pattern = {20.0, 6.0, 0.0, 3.0};
const Pressures presses = presses_of(pattern);

TEST(UnknownReading, IsWhatFloat32DoesNotHold) {
  EXPECT_TRUE(is_known(0.0));
  EXPECT_TRUE(is_known(-1e38));
  EXPECT_TRUE(is_known(FLT_MAX));
  for (const double none : {nan, infinity, -infinity, DBL_MAX, -DBL_MAX, 3.5e38}) {
    EXPECT_FALSE(is_known(none)) << none;
  }
  const Frame frame{.values = {1.0, nan, infinity, nan}};
  EXPECT_EQ(unknown_readings(frame, {}), 3u);
  EXPECT_EQ(unknown_readings(frame, std::vector<std::uint8_t>{1, 0, 1, 1}), 2u);
  // A frame without a known reading is lost, and has none that are unknown besides.
  EXPECT_EQ(unknown_readings(frame, std::vector<std::uint8_t>{0, 1, 1, 1}), 0u);
}

// Three known readings are the fewest that one wrong reading does not decide.
TEST(UnknownReading, AnElementOfFewerThanThreeReadingsIsNotValidInTheTouch) {
  for (const std::size_t known : {0u, 2u, 3u}) {
    SCOPED_TRACE(known);
    std::vector<Frame> frames = PressStream{.noise = 0.0}.frames(3.0, presses);
    std::size_t count = 0;
    for (Frame& frame : frames) {
      const double t = frame.host_time_s - stream_begin_s;
      if (t < 1.0 && (t < 0.45 || ++count > known)) {  // in the first press
        frame.values[1] = nan;
      }
    }
    const std::vector<DetectedTouch> touches = touches_in(frames);
    ASSERT_EQ(touches.size(), 3u);
    for (const std::size_t i : {0u, 1u, 2u}) {
      const bool valid = i > 0 || known == 3;
      EXPECT_EQ(touches[i].valid, (std::vector<std::uint8_t>{1, valid, 1, 1}));
      EXPECT_NEAR(touches[i].pressure[0], 20.0, 0.33);
      EXPECT_NEAR(touches[i].pressure[1], valid ? 6.0 : 0.0, valid ? 0.33 : 0.0);
    }
  }
}

// Held for a moment at most: a press whose elements all go dark has an end.
TEST(UnknownReading, ATouchThatGoesDarkEnds) {
  TouchDetector detector({.drift_s = 0.0}, {}, {});
  const auto held = [](double t) {
    const double p = 8.0 * press(t, 0.5, 1e6);
    return t < 2.0 ? std::vector<double>{p, p, 0.0} : std::vector<double>{nan, nan, 0.0};
  };
  std::optional<DetectedTouch> touch;
  double ended_s = 0.0;
  for (const Frame& frame : PressStream{.noise = 0.0}.frames(4.0, held)) {
    if (auto ended = detector.add(frame)) {
      touch = ended;
      ended_s = frame.host_time_s - stream_begin_s;
    }
  }
  ASSERT_TRUE(touch);
  EXPECT_EQ(touch->valid, (std::vector<std::uint8_t>{1, 1, 1}));
  EXPECT_EQ(touch->pressure[0], 8.0);
  EXPECT_NEAR(ended_s, 2.5, 0.03);  // two frames for each of the median and the gap's rounding
  EXPECT_FALSE(detector.touching());
}

TEST(UnknownReading, FramesThatSayNothingArePassedOver) {
  std::vector<Frame> frames = PressStream{}.frames(3.0, presses);
  const std::vector<DetectedTouch> expected = touches_in(frames);
  for (std::size_t i = 9; i < frames.size(); i += 8) {
    Frame none = frames[i];
    none.values.assign(4, i % 16 == 1 ? nan : infinity);
    Frame timeless = frames[i];
    timeless.host_time_s = i % 16 == 1 ? nan : infinity;
    frames.insert(frames.begin() + static_cast<std::ptrdiff_t>(i), {none, timeless});
  }
  expect_same(touches_in(frames), expected);
}

// An array that was pressed while its baseline was taken reads below it from then on.
TEST(TouchDetector, BaselineFollowsWhatIsReadBelowItByTheOnsetAtMost) {
  const auto below = [](double) { return std::vector<double>{-10.0}; };
  TouchDetector detector({.onset = 2.0}, {}, {});
  for (const Frame& frame : PressStream{.noise = 0.0}.frames(3.0, below)) {
    detector.add(frame);
  }
  // 2 in a second; one step of 0.01 s less than 3 s.
  EXPECT_NEAR(detector.baseline()[0], -6.0, 0.03);
}

// After finish() another stream may begin, at any time.
TEST(TouchDetector, BaselineFollowsInAStreamOfEarlierTimes) {
  TouchDetector detector({}, {}, {});
  const auto drifted = [](double) { return std::vector<double>{0.5}; };
  std::vector<Frame> frames = PressStream{.noise = 0.0}.frames(1.0, drifted);
  for (Frame& frame : frames) {
    detector.add(frame);
  }
  const double once = detector.baseline()[0];
  detector.finish();
  for (Frame& frame : frames) {
    frame.host_time_s -= 1e6;
    detector.add(frame);
  }
  // 1 - 1/e, and as much of the rest; each frame a step of 0.01 of a mean
  // over 0.05 s, whose frames are above the baseline of 0.02 s before: 1.02 of a second each.
  EXPECT_NEAR(once, 0.5 * (1.0 - std::exp(-1.0)), 6e-3);
  EXPECT_NEAR(detector.baseline()[0], 0.5 * (1.0 - std::exp(-2.0)), 6e-3);
}

}  // namespace palpate::frame_smoother_test
