// Presses on arrays whose rest drifts: the rest is found from the whole stream (RestFinder), and as
// it comes (TouchDetector).
#include "streaming/rest_finder.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "press.hpp"
#include "streaming/rest_follower.hpp"

namespace palpate::rest_finder_test {

constexpr double onset = 2.0;
constexpr double release = 1.0;

/// 3 x 3 elements that are pressed at a place of its own in every period, above a rest that is
/// given as what is added to 3 kPa, times 0.5 to 1.5 by element.
struct DriftingStream {
  std::size_t presses = 60;
  double ramp_s = 0.1;
  double steady_s = 0.4;
  double gap_s = 0.4;
  double rate_hz = 100.0;
  double noise = 0.3;
  double hysteresis = 0.0;  ///< part of a press that stays after it, and decays over 2 s

  double period_s() const { return 2.0 * ramp_s + steady_s + gap_s; }
  double seconds() const { return 1.0 + static_cast<double>(presses) * period_s(); }

  double load(double time_s, std::size_t element) const {
    double load = 0.0;
    const double at = (time_s - 1.0) / period_s();
    for (double k = std::max(0.0, std::floor(at) - (hysteresis > 0.0 ? 6.0 : 0.0));
         k <= at && k < static_cast<double>(presses); ++k) {
      const double begin_s = 1.0 + k * period_s();
      const double end_s = begin_s + 2.0 * ramp_s + steady_s;
      const double most = 4.0 + 12.0 * std::abs(std::sin(1.7 * k + static_cast<double>(element)));
      const double part =
          std::clamp(std::min((time_s - begin_s) / ramp_s, (end_s - time_s) / ramp_s), 0.0, 1.0);
      load += most * part;
      load += time_s > end_s ? hysteresis * most * std::exp(-(time_s - end_s) / 2.0) : 0.0;
    }
    return load;
  }

  std::vector<Frame> frames(const std::function<double(double)>& drift) const {
    return PressStream{.rate_hz = rate_hz, .noise = noise}.frames(seconds(), [&](double t) {
      std::vector<double> values(9);
      for (std::size_t k = 0; k < 9; ++k) {
        values[k] = 3.0 + (0.5 + static_cast<double>(k) / 8.0) * drift(t) + load(t, k);
      }
      return values;
    });
  }
};

std::function<double(double)> per_minute(double kpa) {
  return [kpa](double t) { return kpa * t / 60.0; };
}

Rest rest_of(const std::vector<Frame>& frames, std::optional<double> window_s = {},
             const std::vector<std::uint8_t>& valid = {}) {
  RestFinder finder(valid, onset, release);
  for (const Frame& frame : frames) {
    finder.add(frame);
  }
  return finder.find(window_s);
}

std::vector<DetectedTouch> touches_above(const Rest& rest, std::vector<Frame> frames) {
  std::vector<double> at;
  for (Frame& frame : frames) {
    rest.at(frame.host_time_s - frames.front().host_time_s, at);
    std::ranges::transform(frame.values, at, frame.values.begin(), std::minus<>{});
  }
  return touches_in(frames, {.drift_s = 0.0});
}

double mean_pressure(const std::vector<DetectedTouch>& touches) {
  double sum = 0.0;
  for (const DetectedTouch& touch : touches) {
    sum += std::accumulate(touch.pressure.begin(), touch.pressure.end(), 0.0);
  }
  return sum / static_cast<double>(touches.size());
}

TEST(RestFinder, EveryPressIsFoundUnderDriftAndReadsAsWithoutIt) {
  const DriftingStream stream;
  const std::vector<Frame> without = stream.frames(per_minute(0.0));
  const auto still = touches_above(rest_of(without), without);
  ASSERT_EQ(still.size(), 60u);
  for (std::size_t i = 0; i < still.size(); ++i) {
    const double middle_s = 0.5 * (still[i].begin_s + still[i].end_s) - stream_begin_s;
    for (std::size_t k = 0; k < 9; ++k) {
      // Five times the noise of the rest, of a few tenths of a second at 0.3 kPa.
      EXPECT_NEAR(still[i].pressure[k], stream.load(middle_s, k), 0.5) << i << ", " << k;
    }
  }
  for (const double drift : {1.0, 6.0, 30.0, 180.0, -6.0, -30.0}) {
    const std::vector<Frame> frames = stream.frames(per_minute(drift));
    const Rest rest = rest_of(frames);
    EXPECT_FALSE(rest.changes_s) << drift;
    const auto touches = touches_above(rest, frames);
    EXPECT_NEAR(static_cast<double>(touches.size()), 60.0, 1.0) << drift;
    EXPECT_NEAR(mean_pressure(touches) / mean_pressure(still), 1.0, 0.02) << drift;
  }
}

TEST(RestFinder, HysteresisMakesNoTouchAndHidesNone) {
  const std::vector<Frame> frames = DriftingStream{.hysteresis = 0.1}.frames(per_minute(3.0));
  EXPECT_EQ(touches_above(rest_of(frames), frames).size(), 60u);
}

/// A press from `begin_s` to `end_s` with edges of `ramp_s`.
double ramped(double t, double begin_s, double end_s, double ramp_s) {
  return std::clamp(std::min(t - begin_s, end_s - t) / ramp_s, 0.0, 1.0);
}

std::vector<Frame> frames_of(double seconds, const std::function<double(double)>& reading,
                             const PressStream& stream = {.noise = 0.1}, std::size_t elements = 1) {
  return stream.frames(seconds,
                       [&](double t) { return std::vector<double>(elements, reading(t)); });
}

TEST(RestFinder, LongAndSlowPressesAreFoundBesideShortOnes) {
  for (const double short_kpa : {0.0, 8.0}) {
    const auto reading = [&](double t) {
      const double at = std::fmod(t, 15.0);
      return 3.0 * std::sin(t / 24.0) + 6.0 * ramped(at, 1.0, 13.0, 5.0) +
             short_kpa * ramped(at, 13.5, 14.5, 0.1);
    };
    for (const auto& frames : {frames_of(75.0, reading), frames_of(75.0, reading, {.noise = 0.4}),
                               frames_of(75.0, reading, {.rate_hz = 50.0, .noise = 0.3}, 64)}) {
      const auto touches = touches_above(rest_of(frames), frames);
      ASSERT_EQ(touches.size(), short_kpa > 0.0 ? 10u : 5u) << frames[0].values.size();
      EXPECT_NEAR(touches[2].pressure[0], 6.0, 0.8) << frames[0].values.size();
    }
  }
}

TEST(RestFinder, WhatTheStreamBeginsOrEndsWithIsNoTouch) {
  const std::function<double(double)> ends[] = {
      [](double t) { return t > 33.0 ? 6.0 : 0.0; },              // an element jumps
      [](double t) { return 8.0 * ramped(t, 33.0, 50.0, 0.1); },  // a press is under way
      [](double t) { return 8.0 * ramped(t, 31.0, 39.0, 2.5); },  // and lifts
      [](double t) { return 8.0 * ramped(t, 36.0, 37.8, 0.8); },
  };
  for (const auto& end : ends) {
    std::vector<Frame> frames = frames_of(37.5, [&](double t) {
      return t < 30.0 ? 8.0 * ramped(std::fmod(t, 10.0), 5.0, 8.0, 0.1) : end(t);
    });
    for (const std::optional<double> window_s : {std::optional<double>(), std::optional(20.0)}) {
      EXPECT_EQ(touches_above(rest_of(frames, window_s), frames).size(), 3u);
      EXPECT_GT(rest_of(frames, window_s).changes_s.value_or(0.0), 30.0);
    }
    for (std::size_t i = 0; 2 * i < frames.size(); ++i) {
      std::swap(frames[i].values, frames[frames.size() - 1 - i].values);
    }
    EXPECT_EQ(touches_above(rest_of(frames), frames).size(), 3u) << "turned round in time";
  }
}

TEST(RestFinder, APressLongerThanTheWindowIsSaid) {
  const DriftingStream held{.presses = 3, .steady_s = 6.0, .gap_s = 3.0};
  EXPECT_NEAR(rest_of(held.frames(per_minute(0.0)), 2.0).changes_s.value_or(0.0), 1.1, 0.3);
}

TEST(RestFinder, AnUntouchedArrayHasNoTouchWhateverItsRestDoes) {
  const auto sliding = [](double t) { return 30.0 * std::sin(t / 900.0); };
  std::vector<Frame> frames = PressStream{.rate_hz = 20.0, .noise = 0.3}.frames(
      3600.0, [&](double t) { return std::vector<double>(4, 50.0 + sliding(t)); });
  const Rest rest = rest_of(frames);
  EXPECT_TRUE(touches_above(rest, frames).empty());
  std::vector<double> at;
  for (const double t : {0.0, 10.0, 1800.0, 3599.0}) {
    rest.at(t, at);
    EXPECT_NEAR(at[0], 50.0 + sliding(t), 0.4) << t;
  }
  for (const auto& drift :
       {+[](double t) { return 3.0 * t; }, +[](double t) { return 3.0 * std::sin(t / 9.5); }}) {
    frames = frames_of(60.0, drift);
    EXPECT_TRUE(touches_above(rest_of(frames), frames).empty());
  }
  // Weak presses do not lift the rest.
  rest_of(frames_of(30.0, [](double t) {
    return 1.8 * ramped(std::fmod(t, 1.0), 0.3, 0.9, 0.05);
  })).at(15.1, at);
  EXPECT_NEAR(at[0], 0.0, 0.2);
}

TEST(RestFinder, TellsReadingsThatFallInPresses) {
  for (const bool alike : {false, true}) {
    for (const double drift : {-20.0, 0.0, 20.0}) {
      const DriftingStream stream{.presses = 12};
      std::vector<Frame> frames = stream.frames(per_minute(drift));
      if (alike) {
        frames = PressStream{}.frames(12.0, [&](double t) {
          return std::vector<double>{3.0 + drift * t / 60.0 +
                                     10.0 * press(std::fmod(t, 1.0), 0.3, 0.4)};
        });
      }
      EXPECT_FALSE(rest_of(frames).falls) << alike << ", " << drift;
      const std::vector<Frame> begun(frames.begin() + (alike ? 50 : 120), frames.end());
      EXPECT_FALSE(rest_of(begun).falls) << "it begins in a press";
      for (Frame& frame : frames) {
        std::ranges::transform(frame.values, frame.values.begin(), std::negate<>{});
      }
      EXPECT_TRUE(rest_of(frames).falls) << alike << ", " << drift;
    }
  }
}

TEST(RestFinder, WildUnknownAndDeadReadingsAreNoRest) {
  const DriftingStream stream{.presses = 8};
  std::vector<Frame> frames = stream.frames(per_minute(6.0));
  frames[60].values[0] = frames[61].values[0] = -1e38;
  for (std::size_t i = 250; i < 320; ++i) {
    frames[i].values[1] = std::nan("");
  }
  const Rest rest = rest_of(frames, {}, {1, 1, 0, 1, 1, 1, 1, 1, 1});
  std::vector<double> at;
  for (const double t : {0.6, 2.8}) {
    rest.at(t, at);
    EXPECT_NEAR(at[0], 3.0 + 0.5 * 6.0 * t / 60.0, 0.3);
    EXPECT_NEAR(at[1], 3.0 + 0.625 * 6.0 * t / 60.0, 0.3);
    EXPECT_EQ(at[2], 0.0);
  }
  rest_of({}).at(1.0, at);
  EXPECT_TRUE(at.empty());
}

/// How many touches a detector finds that knows the rest of the first frame only.
double live_touches(const DriftingStream& stream, double kpa_per_minute, double rest = 3.0) {
  const std::vector<Frame> frames = stream.frames(per_minute(kpa_per_minute));
  return static_cast<double>(touches_in(frames, {}, std::vector<double>(9, rest)).size());
}

TEST(TouchDetector, FindsThePressesOfADriftingArrayAsTheyCome) {
  for (const double drift : {0.0, 3.0, 6.0, -3.0, -30.0}) {
    EXPECT_NEAR(live_touches({}, drift), 60.0, 1.0) << drift;
  }
  // What stays after a press exceeds the release, until the rest is learned anew after 10 s.
  EXPECT_NEAR(live_touches({.hysteresis = 0.1}, 0.0), 50.0, 2.0);
  // So it is where the rest is 6 kPa above what was said, as after a blow to the mount.
  EXPECT_NEAR(live_touches({}, 0.0, -3.0), 50.0, 2.0);
  EXPECT_EQ(live_touches({.presses = 10, .ramp_s = 2.0, .steady_s = 0.5, .gap_s = 1.0}, 3.0), 10.0);
}

// Drift has lifted the rest to 5, and presses of 20 take three fifths of the time.
TEST(RestFollower, LearnsAnewWhatIsReadBetweenPresses) {
  RestFollower follower({0.0}, 10.0, 2.0);
  bool learned = false;
  for (int i = 0; i < 200 && !learned; ++i) {
    const double pressure = i % 10 < 6 ? 20.0 : 5.0;
    learned = follower.keep(std::vector{pressure}, 0.1);
  }
  ASSERT_TRUE(learned);
  EXPECT_FLOAT_EQ(static_cast<float>(follower.rest()[0]), 5.0F);
}

TEST(RestFollower, StaysWhereNothingDrifts) {
  RestFollower follower({1.0}, 0.0, 2.0);
  follower.follow(std::vector{0.5}, 1.0);
  EXPECT_FALSE(follower.keep(std::vector{0.5}, 20.0));
  EXPECT_EQ(follower.rest(), std::vector{1.0});
}

}  // namespace palpate::rest_finder_test
