#include "palpate/touch_detector.hpp"

#include <cmath>
#include <numbers>
#include <utility>

#include "palpate/sensor.hpp"
#include "press.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"

namespace palpate::touch_detector_test {

const std::vector<double> pattern = {12.0, 6.0, 0.0, 3.0};
const Pressures presses = presses_of(pattern);

// Five standard errors of the interquartile mean, 0.3 / sqrt(0.84 n), of 30 frames or more.
constexpr double mean_tolerance = 0.3;

void expect_pattern(const std::vector<DetectedTouch>& touches, std::size_t count,
                    double tolerance = mean_tolerance) {
  ASSERT_EQ(touches.size(), count);
  for (std::size_t i = 0; i < count; ++i) {
    SCOPED_TRACE(i);
    // The press is fully there from 0.4 to 0.8 s; smoothing and ramps of 15 % take part of it.
    EXPECT_NEAR(touches[i].begin_s - stream_begin_s, static_cast<double>(i) + 0.42, 0.06);
    EXPECT_NEAR(touches[i].end_s - stream_begin_s, static_cast<double>(i) + 0.78, 0.06);
    EXPECT_EQ(touches[i].valid, std::vector<std::uint8_t>(4, 1));
    EXPECT_FALSE(touches[i].T_robot_sensor) << "the frames have none";
    for (std::size_t k = 0; k < pattern.size(); ++k) {
      EXPECT_NEAR(touches[i].pressure[k], pattern[k], tolerance) << k;
    }
  }
}

TEST(TouchDetector, FindsEveryPressOnceAmongBadLostAndUnknownReadings) {
  const std::vector<Frame> clean = PressStream{}.frames(8.0, presses);
  expect_pattern(touches_in(clean), 8);
  expect_pattern(touches_in(PressStream{.rate_hz = 1000.0}.frames(3.0, presses)), 3);
  std::vector<Frame> bad = clean;
  for (std::size_t i = 10; i < bad.size(); i += 13) {
    bad[i].values.assign(4, i % 2 == 0 ? 500.0 : -500.0);
  }
  expect_pattern(touches_in(bad), 8);
  std::vector<Frame> lost = clean;
  std::mt19937_64 random(3);
  std::erase_if(lost, [&](const Frame&) { return random() % 10 < 3; });
  expect_pattern(touches_in(lost), 8);
  for (const double none : {nan, infinity, -infinity, 1e300}) {
    SCOPED_TRACE(none);
    std::vector<Frame> unknown = clean;
    for (std::size_t i = 0; i < unknown.size(); ++i) {
      unknown[i].values[i % 4] = none;  // in every frame one
    }
    // Five standard errors of the mean of three quarters of the frames
    expect_pattern(touches_in(unknown), 8, 0.33);
  }
}

TEST(TouchDetector, FindsNothingInNoiseAndInATap) {
  // 100 elements at the simulator's noise: hundreds of readings above the onset.
  const auto untouched = [](double) { return std::vector<double>(100, 0.0); };
  EXPECT_TRUE(touches_in(PressStream{.noise = 0.7}.frames(20.0, untouched)).empty());
  const auto tap = [](double t) { return std::vector<double>{20.0 * press(t, 0.5, 0.02)}; };
  EXPECT_TRUE(touches_in(PressStream{}.frames(2.0, tap)).empty());
}

TEST(TouchDetector, NoiseOfItsFirstFramesIsNoTouch) {
  TouchDetector detector({}, std::vector<double>(4, 0.0), {});
  for (int i = 0; i < 100; ++i) {
    const Frame frame{.host_time_s = stream_begin_s + 0.01 * i,
                      .values = std::vector<double>(4, i < 2 ? 3.0 : 0.0)};
    EXPECT_FALSE(detector.add(frame));
    EXPECT_FALSE(detector.touching()) << i;
  }
}

TEST(TouchDetector, ScalesWithTheUnit) {
  const std::vector<Frame> kpa = PressStream{}.frames(3.0, presses);
  std::vector<Frame> raw = kpa;
  constexpr double counts_per_kpa = 64.0;  // a power of two: the same digits
  for (Frame& frame : raw) {
    std::ranges::for_each(frame.values, [](double& value) { value *= counts_per_kpa; });
  }
  expect_same(touches_in(raw, {.onset = 2.0 * counts_per_kpa, .release = counts_per_kpa}),
              touches_in(kpa), counts_per_kpa);
}

TEST(TouchDetector, LightTouchOfOneElementIsOne) {
  const auto light = [](double t) { return std::vector<double>{3.0 * press(t, 0.5, 0.5), 0.0}; };
  const auto touches = touches_in(PressStream{.noise = 0.5}.frames(2.0, light));
  ASSERT_EQ(touches.size(), 1u);
  EXPECT_NEAR(touches[0].pressure[0], 3.0, 0.5);  // five standard errors of 30 frames
}

TEST(TouchDetector, APressThatOutlastsTheDriftIsRestAndEnds) {
  const auto held = [](double t) { return std::vector<double>{8.0 * press(t, 1.0, 60.0), 0.0}; };
  TouchDetector detector({.drift_s = 5.0}, {}, {});
  std::vector<DetectedTouch> touches;
  std::optional<std::vector<double>> at_onset;
  for (const Frame& frame : PressStream{}.frames(70.0, held)) {
    if (auto touch = detector.add(frame)) {
      touches.push_back(*touch);
      EXPECT_NEAR(frame.host_time_s - stream_begin_s, 6.0, 0.2);
      EXPECT_NEAR(detector.baseline()[0], 8.0, 0.5);
    } else if (detector.touching() && frame.host_time_s - stream_begin_s < 5.5) {
      at_onset = at_onset.value_or(detector.baseline());
      EXPECT_EQ(detector.baseline(), *at_onset) << "it stays during a touch";
    }
  }
  ASSERT_EQ(touches.size(), 1u);
  EXPECT_NEAR(touches[0].pressure[0], 8.0, 0.3);
  EXPECT_NEAR(detector.baseline()[0], 0.0, 0.3) << "it is followed down after the release";
}

// The frames that are kept tell the middle of what changes slowly.
TEST(TouchDetector, EndlessTouchKeepsABoundedPartAndIsTheMeanOverAllOfIt) {
  const auto rising = [](double t) {
    return std::vector<double>{press(t, 1.0, 1e6) * (8.0 + 0.001 * t), press(t, 1.0, 1e6) * 3.0};
  };
  TouchDetector detector({.drift_s = 0.0}, {}, {});
  for (const Frame& frame : PressStream{.noise = 0.0}.frames(600.0, rising)) {
    EXPECT_FALSE(detector.add(frame));
  }
  const auto touch = detector.finish();
  ASSERT_TRUE(touch);
  EXPECT_FALSE(detector.touching());
  EXPECT_LE(touch->frames, 512u);
  EXPECT_GE(touch->frames, 200u);
  EXPECT_NEAR(touch->begin_s - stream_begin_s, 1.1, 0.1);
  // The last frames may be left out, at most two of those kept: one of 128 is.
  EXPECT_NEAR(touch->end_s - stream_begin_s, 600.0, 4.0);
  // The phase may begin 0.1 s late and ends up to 4 s early, of which the middle moves by a half.
  EXPECT_NEAR(touch->pressure[0], 8.3, 0.003);
  EXPECT_NEAR(touch->pressure[1], 3.0, 0.001);
}

TEST(TouchDetector, SilenceAndAClockThatGoesBackEndATouch) {
  const auto held = [](double t) { return std::vector<double>{8.0 * press(t, 0.5, 1e6)}; };
  for (const double jump_s : {3.0, 3600.0, -3.0}) {
    std::vector<Frame> frames = PressStream{}.frames(4.0, held);
    for (std::size_t i = 200; i < frames.size(); ++i) {
      frames[i].host_time_s += jump_s;
    }
    const auto touches = touches_in(frames);
    ASSERT_EQ(touches.size(), 2u) << jump_s;
    EXPECT_LT(touches[0].end_s, frames[200].host_time_s + (jump_s < 0.0 ? 10.0 : 0.0));
    EXPECT_GE(touches[1].begin_s, frames[200].host_time_s);
  }
  // Of what is not touched meanwhile, a single frame does not tell the rest.
  std::vector<double> part(100, 0.0);
  part[0] = 9.0;
  std::vector<Frame> late = PressStream{.noise = 0.7}.frames(8.0, presses_of(part));
  for (std::size_t i = 400; i < late.size(); ++i) {
    late[i].host_time_s += 60.0;
  }
  EXPECT_EQ(touches_in(late).size(), 8u);
}

TEST(TouchDetector, DeadElementsTakeNoPart) {
  std::vector<Frame> frames = PressStream{}.frames(2.0, presses);
  for (Frame& frame : frames) {
    frame.values[2] = frame.host_time_s > stream_begin_s + 1.0 ? nan : 9999.0;
  }
  const auto touches = touches_in(frames, {}, {0.0, 0.0, 5e3, 0.0}, {1, 1, 0, 1});
  ASSERT_EQ(touches.size(), 2u);
  EXPECT_EQ(touches[0].pressure[2], 0.0);
  EXPECT_EQ(touches[0].valid, (std::vector<std::uint8_t>{1, 1, 0, 1}));
}

TEST(TouchDetector, PoseIsTheMeanOfThoseKnownAcrossTheTurn) {
  std::vector<Frame> frames = PressStream{}.frames(1.0, presses);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const double sign = i % 2 == 0 ? 1.0 : -1.0;
    const Pose known{{5.0 + 0.1 * sign, -2.0}, sign * (std::numbers::pi - 0.01)};
    // Half of the frames have no pose, or one that no robot has.
    const auto none = i % 8 < 4 ? std::nullopt : std::optional(Pose{{nan, 1.7e308}, 0.0});
    frames[i].T_robot_sensor = i % 4 < 2 ? known : none;
  }
  const auto touches = touches_in(frames);
  ASSERT_EQ(touches.size(), 1u);
  const Pose pose = touches[0].T_robot_sensor.value();
  // At worst one frame more of one sign than of the other.
  EXPECT_NEAR(pose.translation_mm.x, 5.0, 0.011);
  EXPECT_NEAR(pose.translation_mm.y, -2.0, 1e-9);
  EXPECT_NEAR(std::abs(wrap_angle(pose.theta_rad, 2 * std::numbers::pi)), std::numbers::pi, 0.002);
}

TEST(TouchDetector, LoadThatChangesByMoreThanSteadyEndsThePhase) {
  const auto eased = [](double t) {
    return std::vector<double>{(t < 1.5 ? 20.0 : 15.0) * press(t, 0.5, 1.5)};
  };
  const std::vector<Frame> frames = PressStream{}.frames(3.0, eased);
  ASSERT_EQ(touches_in(frames).size(), 1u);
  EXPECT_NEAR(touches_in(frames)[0].pressure[0], 20.0, mean_tolerance);
  EXPECT_LT(touches_in(frames, {.steady = 0.3})[0].pressure[0], 19.0);
}

TEST(TouchDetector, OfASlideTheLongestRestCounts) {
  const auto held = [](double t) { return std::vector<double>{8.0 * press(t, 0.5, 3.0)}; };
  std::vector<Frame> frames = PressStream{}.frames(5.0, held);
  for (Frame& frame : frames) {
    const double t = frame.host_time_s - stream_begin_s;
    // At rest at 0 for 0.5 s, then a slide of 20 mm in 0.5 s, then at rest for 2 s.
    frame.T_robot_sensor = Pose{{20.0 * std::clamp((t - 1.1) / 0.5, 0.0, 1.0), 0.0}, 0.0};
  }
  const auto touches = touches_in(frames);
  ASSERT_EQ(touches.size(), 1u);
  EXPECT_NEAR(touches[0].T_robot_sensor->translation_mm.x, 20.0, 0.1);  // a fifth of steady_mm
  EXPECT_NEAR(touches[0].end_s - touches[0].begin_s, 2.0, 0.15);
}

TEST(TouchDetector, RefusesWhatCannotBe) {
  using Options = TouchDetectorOptions;
  const auto refused = [](const Options& options) {
    return input_error([&] { TouchDetector(options, {}, {}); });
  };
  const std::pair<const char*, double Options::*> fields[] = {
      {"onset", &Options::onset},
      {"release", &Options::release},
      {"steady", &Options::steady},
      {"min_steady_s", &Options::min_steady_s},
      {"steady_mm", &Options::steady_mm},
      {"steady_rad", &Options::steady_rad},
      {"smooth_s", &Options::smooth_s},
      {"drift_s", &Options::drift_s},
      {"largest_gap_s", &Options::largest_gap_s}};
  for (const auto& [name, field] : fields) {
    for (const double wrong : {nan, -1.0, infinity}) {
      Options options;
      options.*field = wrong;
      expect_named(refused(options), {name});
    }
  }
  expect_named(refused({.onset = 1.0, .release = 2.0}), {"release = 2"});
  expect_named(input_error([] { TouchDetector({}, {1.0, 2.0}, {1}); }), {"2 baseline", "1 valid"});
  for (const double wrong : {nan, 1e300}) {
    expect_named(input_error([&] { TouchDetector({}, {wrong}, {}); }), {"baseline"});
    EXPECT_NO_THROW(TouchDetector({}, {wrong, 1.0}, {0, 1})) << "a dead element may have none";
  }
  TouchDetector detector({}, {0.0, 0.0}, {});
  expect_named(input_error([&] { detector.add({.values = {1.0}}); }), {"1 values", "2"});
}

TEST(TouchDetector, ThatWasMovedFromSaysSo) {
  TouchDetector first({}, {0.0, 0.0}, {});
  const TouchDetector second(std::move(first));
  EXPECT_EQ(second.baseline().size(), 2U);
  EXPECT_THROW(first.add({}), Error);  // NOLINT(bugprone-use-after-move): on purpose
}

const SensorDescription two_elements{.name = "", .elements_mm = {{0.0, 0.0}, {1.0, 0.0}}};

TEST(Baseline, IsTheMedianOfEveryElementThatIsNotDead) {
  SensorDescription sensor = two_elements;
  sensor.elements_mm.emplace_back(2.0, 0.0);
  sensor.valid = {1, 1, 0};
  std::vector<Frame> frames = PressStream{.noise = 0.7}.frames(1.0, [](double t) {
    return std::vector<double>{50.0, -3.0, t > 0.5 ? nan : 1e9};
  });
  frames[40].values = {1e6, nan, 0.0};  // a spike, and a reading that is none
  const std::vector<double> baseline = baseline_of(frames, sensor, 2.0);
  // Five standard errors of the median, 1.25 * 0.7 / sqrt(100).
  EXPECT_NEAR(baseline[0], 50.0, 0.44);
  EXPECT_NEAR(baseline[1], -3.0, 0.44);
  EXPECT_EQ(baseline[2], 0.0);
}

TEST(Baseline, RefusesATouchedArrayAndNothingToGoBy) {
  auto frames = PressStream{}.frames(1.0, [](double t) {
    return std::vector<double>{3.0, 3.0 + 5.0 * press(t, 0.3, 10.0)};
  });
  expect_named(input_error([&] { baseline_of(frames, two_elements, 2.0); }),
               {"touched", "element 1", "kPa"});
  // Unknown readings tell nothing either way.
  for (std::size_t i = 0; i < frames.size(); i += 2) {
    frames[i].values = {infinity, nan};
  }
  expect_named(input_error([&] { baseline_of(frames, two_elements, 2.0); }),
               {"touched", "element 1"});
  // Without a pressure that is a touch there is none. Five standard errors of the median, 1.25 *
  // 0.3 / sqrt(50).
  EXPECT_NEAR(baseline_of(frames, two_elements, {})[0], 3.0, 0.27);
  frames[7].values = {1.0};
  expect_named(input_error([&] { baseline_of(frames, two_elements, 2.0); }),
               {"1 values", "2 elements"});
  expect_named(input_error([] { baseline_of({}, two_elements, 2.0); }), {"no frame"});
  frames.assign(5, {.values = {nan, 1.0}});
  expect_named(input_error([&] { baseline_of(frames, two_elements, 2.0); }), {"element 0"});
}

}  // namespace palpate::touch_detector_test
