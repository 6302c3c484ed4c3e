// What a stream with readings that no element can have, or that are no numbers, makes of touches.

#include <cfloat>
#include <cmath>

#include "palpate/touch_detector.hpp"
#include "press.hpp"
#include "support/limits.hpp"

namespace palpate::unknown_reading_test {

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

TEST(UnknownReading, HugeReadingsLeaveNoTraceInLaterTouches) {
  const std::vector<Frame> clean = PressStream{}.frames(30.0, presses);
  // The baseline follows an untouched array's noise, of which a glitch hides a few frames.
  for (const double drift_s : {0.0, 10.0}) {
    const TouchDetectorOptions options{.drift_s = drift_s};
    const std::vector<DetectedTouch> expected = touches_in(clean, options);
    ASSERT_EQ(expected.size(), 30u);
    for (const double wrong : {1e38, -1e38, 1e20, -1e20, double{FLT_MAX}, DBL_MAX, -DBL_MAX}) {
      SCOPED_TRACE(wrong);
      for (const std::size_t first : {10u, 60u}) {  // untouched, and in a steady phase
        std::vector<Frame> frames = clean;
        frames[first].values[0] = frames[first + 1].values[0] = wrong;
        const std::vector<DetectedTouch> touches = touches_in(frames, options);
        ASSERT_GE(touches.size(), 29u);
        const std::span others = std::span(touches).last(29);  // than the first press
        if (drift_s == 0.0) {
          expect_same(others, std::span(expected).last(29));
        }
        for (std::size_t i = 0; i < 29; ++i) {
          for (std::size_t k = 0; k < pattern.size(); ++k) {
            // The baseline follows 8 frames of at most the onset with a time constant of 1 s, and
            // not the noise of 0.15 that they hide: 8 * 0.01 * (2 + 0.15).
            EXPECT_NEAR(others[i].pressure[k], expected[1 + i].pressure[k], 0.18);
          }
        }
      }
    }
  }
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

}  // namespace palpate::unknown_reading_test
