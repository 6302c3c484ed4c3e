#include <vector>

#include <gtest/gtest.h>

#include "palpate/pose_histogram.hpp"
#include "synthetic.hpp"

namespace palpate::still_array_test {

/// Presses of one array that stays where it is: readings differ, poses and elements do not.
Recording presses(std::size_t count, std::size_t elements) {
  Recording recording = random_recording(count, elements, 51);
  recording.elements_mm.resize(elements);
  recording.T_robot_sensor.assign(count, {{0.7, -0.4}, 0.3});
  // Mostly No Contact, as a large array reads; the first element stays as it is.
  for (std::size_t i = 0; i < recording.pressure.size(); ++i) {
    if (i % elements != 0 && i % 5 != 0) {
      recording.pressure[i] = 0.0;
    }
  }
  return recording;
}

HistogramOptions options_of(bool still, double step_mm, double gamma) {
  HistogramOptions options;
  options.lattice = {.x_mm = {-3.0, -3.0 + 11 * step_mm, 11},
                     .y_mm = {-2.0, -2.0 + 9 * step_mm, 9},
                     .theta_rad = {0.0, 3.0, 4}};
  options.contact.gamma = gamma;
  options.still_array = still;
  return options;
}

const std::vector<Hypothesis>& objects() {
  static const std::vector<Hypothesis> two{{random_map(31, 27, 0.5, 12.0, 52), 1.0},
                                           {random_map(23, 29, 0.5, 12.0, 53), 1.0}};
  return two;
}

TEST(StillArray, GivesTheReferencesLikelihoodOnEveryPath) {
  constexpr std::size_t elements = 300;
  const Recording recording = presses(3, elements);
  const std::vector<Touch> touches = all_touches(recording);
  Device device = Device::open();
  for (const double step_mm : {0.1, 0.25, 0.8}) {
    for (const double gamma : {0.1, 1e-6}) {
      const HistogramOptions options = options_of(true, step_mm, gamma);
      PoseHistogram histogram(device, objects(), options);
      histogram.update(touches);
      // Some 1e-7 nats for each logarithm of eight factors, of which there are some 200: 5e-5 to
      // 8.4e-5 nats are seen.
      EXPECT_LT(likelihood_error(histogram, reference_posterior(objects(), options, touches)), 4e-4)
          << "step " << step_mm << " mm, gamma " << gamma;
    }
  }
}

TEST(StillArray, GivesTheSameBitsForAPressWhateverCameBefore) {
  const Recording recording = presses(4, 60);
  const std::vector<Touch> touches = all_touches(recording);
  Device device = Device::open();
  PoseHistogram all(device, objects(), options_of(true, 0.1, 0.1));
  for (const Touch& touch : touches) {
    all.reset();
    all.update(touch);
    PoseHistogram one(device, objects(), options_of(true, 0.1, 0.1));
    one.update(touch);
    for (const int object : {0, 1}) {
      EXPECT_EQ(all.log_likelihood(object), one.log_likelihood(object));
    }
  }
}

TEST(StillArray, TellsItsProgressAfterEveryTouch) {
  const Recording recording = presses(4, 60);
  Device device = Device::open();
  PoseHistogram histogram(device, objects(), options_of(true, 0.1, 0.1));
  std::vector<double> told;
  histogram.update(all_touches(recording), [&](double fraction) { told.push_back(fraction); });
  // An array that may move has so few elements evaluated at once.
  EXPECT_EQ(told, (std::vector<double>{0.25, 0.5, 0.75, 1.0}));
}

TEST(StillArray, WhoseElementsMoveIsEvaluatedAnew) {
  constexpr std::size_t elements = 60;
  Recording recording = presses(4, elements);
  std::vector<glm::dvec2> places;
  for (std::size_t touch = 0; touch < 4; ++touch) {
    places.insert(places.end(), recording.elements_mm.begin(), recording.elements_mm.end());
  }
  recording.elements_mm = places;
  // A single element of the second touch moves, and all of the third and fourth.
  recording.elements_mm[elements + 7].y += 1.5;
  for (std::size_t i = 2 * elements; i < 4 * elements; ++i) {
    recording.elements_mm[i].x -= 1.25;
  }
  const std::vector<Touch> touches = all_touches(recording);
  const HistogramOptions options = options_of(true, 0.1, 0.1);
  Device device = Device::open();
  PoseHistogram histogram(device, objects(), options);
  histogram.update(touches);
  // A fifth of the elements of the test above, and four touches for three.
  EXPECT_LT(likelihood_error(histogram, reference_posterior(objects(), options, touches)), 1e-4);
}

TEST(StillArray, ThatMovesAfterAllIsEvaluatedAnew) {
  Recording recording = presses(4, 60);
  recording.T_robot_sensor[2].translation_mm.x += 1.5;
  recording.T_robot_sensor[3].theta_rad += 0.5;
  const std::vector<Touch> touches = all_touches(recording);
  const HistogramOptions options = options_of(true, 0.1, 0.1);
  Device device = Device::open();
  PoseHistogram histogram(device, objects(), options);
  histogram.update(touches);
  EXPECT_LT(likelihood_error(histogram, reference_posterior(objects(), options, touches)),
            4e-4 * 4);
}

}  // namespace palpate::still_array_test
