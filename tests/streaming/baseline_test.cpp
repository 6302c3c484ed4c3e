#include "palpate/baseline.hpp"

#include "press.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"

namespace palpate::baseline_test {

SensorDescription two_elements() {
  SensorDescription sensor;
  sensor.elements_mm = {{0.0, 0.0}, {1.0, 0.0}};
  return sensor;
}

TEST(Baseline, IsTheMedianOfEveryElement) {
  std::vector<Frame> frames = PressStream{.noise = 0.7}.frames(1.0, [](double) {
    return std::vector<double>{50.0, -3.0};
  });
  frames[40].values = {1e6, nan};  // a spike, and a reading that is none
  const std::vector<double> baseline = baseline_of(frames, two_elements(), 2.0);
  // Five standard errors of the median, 1.25 * 0.7 / sqrt(100).
  EXPECT_NEAR(baseline[0], 50.0, 0.44);
  EXPECT_NEAR(baseline[1], -3.0, 0.44);
}

TEST(Baseline, RefusesATouchedArray) {
  auto frames = PressStream{}.frames(1.0, [](double t) {
    return std::vector<double>{3.0, 3.0 + 5.0 * press(t, 0.3, 10.0)};
  });
  expect_named(input_error([&] { baseline_of(frames, two_elements(), 2.0); }),
               {"touched", "element 1", "kPa"});
  // Unknown readings tell nothing either way.
  for (std::size_t i = 0; i < frames.size(); i += 2) {
    frames[i].values = {infinity, nan};
  }
  expect_named(input_error([&] { baseline_of(frames, two_elements(), 2.0); }),
               {"touched", "element 1"});
  // Without a pressure that is a touch there is none. Five standard errors of the median, 1.25 *
  // 0.3 / sqrt(50).
  EXPECT_NEAR(baseline_of(frames, two_elements(), {})[0], 3.0, 0.27);
  frames[7].values = {1.0};
  expect_named(input_error([&] { baseline_of(frames, two_elements(), 2.0); }),
               {"1 values", "2 elements"});
}

TEST(Baseline, DeadElementsMayReadAnything) {
  SensorDescription sensor = two_elements();
  sensor.valid = {0, 1};
  const auto frames = PressStream{}.frames(1.0, [](double t) {
    return std::vector<double>{t > 0.5 ? nan : 1e9, 4.0};
  });
  const std::vector<double> baseline = baseline_of(frames, sensor, 2.0);
  EXPECT_EQ(baseline[0], 0.0);
  EXPECT_NEAR(baseline[1], 4.0, 0.3);
}

TEST(Baseline, RefusesNothingToGoBy) {
  expect_named(input_error([] { baseline_of({}, two_elements(), 2.0); }), {"no frame"});
  const std::vector<Frame> frames(5, Frame{.values = {nan, 1.0}});
  expect_named(input_error([&] { baseline_of(frames, two_elements(), 2.0); }), {"element 0"});
}

}  // namespace palpate::baseline_test
