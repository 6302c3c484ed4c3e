#include "recognition/recogniser.hpp"

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "palpate/error.hpp"
#include "shapes.hpp"
#include "support/synthetic.hpp"

namespace palpate::recogniser_test {

void expect_same(const Estimate& actual, const Estimate& expected) {
  EXPECT_EQ(actual.identity, expected.identity);
  EXPECT_EQ(actual.mode.object, expected.mode.object);
  EXPECT_EQ(actual.mode.T_object_robot.translation_mm, expected.mode.T_object_robot.translation_mm);
  EXPECT_EQ(actual.mode.T_object_robot.theta_rad, expected.mode.T_object_robot.theta_rad);
}

double sum_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

TEST(Recogniser, OfAHistogramTellsWhatTheHistogramTells) {
  Device device = Device::open();
  const auto options = std::get<HistogramOptions>(every_filter()[0]);
  const RecognitionTask task(shapes(), options);
  const Recording recording = touched_letter(1);
  Recogniser recogniser(device, task);
  recogniser.update(all_touches(recording));
  PoseHistogram histogram(device, task.hypotheses, options);
  histogram.update(all_touches(recording));

  const Estimate estimate = histogram.estimate();
  expect_same(recogniser.estimate(), estimate);
  EXPECT_EQ(recogniser.refine(estimate.mode)->T_object_robot.theta_rad,
            histogram.refine(estimate.mode).T_object_robot.theta_rad);
  EXPECT_EQ(recogniser.marginals(0).xy, histogram.marginals(0).xy);
  EXPECT_EQ(recogniser.histogram()->log_likelihood(0), histogram.log_likelihood(0));
  EXPECT_FALSE(recogniser.effective_sample_size());
}

TEST(Recogniser, OfParticlesTellsWhatTheParticlesTell) {
  Device device = Device::open();
  const auto options = std::get<ParticleOptions>(every_filter()[1]);
  const RecognitionTask task(shapes(), options);
  const Recording recording = touched_letter(1);
  Recogniser recogniser(device, task);
  std::vector<double> fractions;
  recogniser.update(all_touches(recording),
                    [&](double fraction) { fractions.push_back(fraction); });
  ParticleFilter particles(device, task.hypotheses, options);
  particles.update(all_touches(recording));

  const Estimate estimate = particles.estimate();
  expect_same(recogniser.estimate(), estimate);
  EXPECT_EQ(recogniser.effective_sample_size(), particles.effective_sample_size());
  EXPECT_FALSE(recogniser.refine(estimate.mode));
  EXPECT_EQ(recogniser.histogram(), nullptr);
  EXPECT_EQ(fractions.size(), 6U);
  EXPECT_EQ(fractions.back(), 1.0);
  for (const int object : {0, 1}) {
    const auto [grid, xy, theta] = recogniser.marginals(object);
    EXPECT_EQ(grid.bins(), 400 * 16);
    EXPECT_EQ(xy.size(), 400U);
    EXPECT_EQ(theta.size(), 16U);
    // Every particle lies in a bin; the sums differ in their order.
    EXPECT_NEAR(sum_of(xy), estimate.identity[object], 1e-9);
    EXPECT_NEAR(sum_of(theta), estimate.identity[object], 1e-9);
  }
}

TEST(Recogniser, OfBoundsTellsWhatTheBoundedPosteriorTells) {
  Device device = Device::open();
  const auto options = std::get<BoundedOptions>(every_filter()[2]);
  const RecognitionTask task(shapes(), options);
  const Recording recording = touched_letter(1);
  Recogniser recogniser(device, task);
  recogniser.update(all_touches(recording));
  BoundedPosterior bounded(task.hypotheses, options);
  bounded.update(all_touches(recording));

  const Estimate estimate = bounded.estimate();
  expect_same(recogniser.estimate(), estimate);
  EXPECT_EQ(recogniser.refine(estimate.mode)->covariance, bounded.refine(estimate.mode).covariance);
  EXPECT_EQ(recogniser.marginals(0).xy, bounded.marginals(0).xy);
  EXPECT_EQ(recogniser.sample(3, 1)[2].T_object_robot.translation_mm,
            bounded.sample(3, 1)[2].T_object_robot.translation_mm);
  EXPECT_FALSE(recogniser.effective_sample_size());
  EXPECT_EQ(recogniser.histogram(), nullptr);
  EXPECT_NE(recogniser.words().front().find(bounded.path()), std::string::npos);
  EXPECT_EQ(recogniser.device_bytes(), 0u);
}

TEST(Recogniser, BoundsAndHistogramAgree) {
  Device device = Device::open();
  for (const std::uint64_t seed : {1, 5}) {
    const Recording recording = touched_letter(seed);
    Recogniser dense(device, RecognitionTask(shapes(), every_filter()[0]));
    Recogniser bounded(device, RecognitionTask(shapes(), every_filter()[2]));
    dense.update(all_touches(recording));
    bounded.update(all_touches(recording));
    const Estimate expected = dense.estimate();
    const Estimate estimate = bounded.estimate();
    EXPECT_EQ(estimate.mode.object, expected.mode.object);
    EXPECT_EQ(estimate.mode.bin, expected.mode.bin);
    for (std::size_t i = 0; i < 2; ++i) {
      // The tolerance is 1e-6; the histogram rounds in float32, by some 1e-5 nats.
      EXPECT_NEAR(estimate.identity[i], expected.identity[i], 3e-5);
    }
    const Pose pose = bounded.refine(estimate.mode)->T_object_robot;
    const Pose dense_pose = dense.refine(expected.mode)->T_object_robot;
    // Between bins of 0.5 mm and 22.5 degrees, from logs that differ by some 1e-5 nats.
    EXPECT_LT(glm::distance(pose.translation_mm, dense_pose.translation_mm), 1e-3);
    EXPECT_NEAR(pose.theta_rad, dense_pose.theta_rad, 1e-3);
    const Marginals marginals = bounded.marginals(0);
    const Marginals dense_marginals = dense.marginals(0);
    for (std::size_t i = 0; i < marginals.xy.size(); ++i) {
      EXPECT_NEAR(marginals.xy[i], dense_marginals.xy[i], 3e-5);
    }
  }
}

TEST(Recogniser, FindsParticlesAndHistogramInTheSamePlace) {
  Device device = Device::open();
  const Recording recording = touched_letter(5);
  std::vector<Marginals> marginals;
  for (const std::size_t filter : {0, 1}) {
    Recogniser recogniser(device, RecognitionTask(shapes(), every_filter()[filter]));
    recogniser.update(all_touches(recording));
    marginals.push_back(recogniser.marginals(0));
  }
  const auto most = [](const std::vector<double>& sums) {
    return std::max_element(sums.begin(), sums.end()) - sums.begin();
  };
  // Noise of 1 mm and 0.1 rad at every touch spreads particles over two bins of 0.5 mm; theta's
  // bins of 22.5 degrees are four times as wide.
  const std::ptrdiff_t a = most(marginals[0].xy);
  const std::ptrdiff_t b = most(marginals[1].xy);
  EXPECT_LE(std::abs(a % 20 - b % 20), 4);
  EXPECT_LE(std::abs(a / 20 - b / 20), 4);
  const std::ptrdiff_t turn = most(marginals[0].theta) - most(marginals[1].theta);
  EXPECT_LE(std::abs((turn + 24) % 16 - 8), 1);
}

TEST(Recogniser, TakesInAllTouchesOfACallOrNone) {
  Device device = Device::open();
  const Recording recording = touched_letter(3);
  std::vector<Touch> touches = all_touches(recording);
  for (const FilterOptions& filter : every_filter()) {
    Recogniser recogniser(device, RecognitionTask(shapes(), filter));
    recogniser.update(std::span(touches).first(1));
    const Estimate before = recogniser.estimate();
    std::vector<Touch> unsound = touches;
    unsound.back().pressure = unsound.back().pressure.first(1);
    EXPECT_THROW(recogniser.update(unsound), Error);
    expect_same(recogniser.estimate(), before);
  }
}

TEST(Recogniser, ForgetsTheUnknownBefore) {
  Device device = Device::open();
  for (const FilterOptions& filter : every_filter()) {
    const RecognitionTask task(shapes(), filter);
    Recogniser recogniser(device, task);
    const Recording recording = touched_disc(2);
    recogniser.update(all_touches(recording));
    const Estimate first = recogniser.estimate();
    recogniser.update(all_touches(touched_letter(3)));
    recogniser.reset();
    recogniser.update(all_touches(recording));
    expect_same(recogniser.estimate(), first);
  }
}

/// Tasks whose pivot is the array's centre at the first touch in contact.
std::vector<RecognitionTask> automatic_tasks() {
  std::vector<RecognitionTask> tasks;
  for (const FilterOptions& filter : every_filter()) {
    tasks.emplace_back(shapes(), filter).auto_pivot = true;
  }
  return tasks;
}

/// The task about this pivot.
RecognitionTask about(const RecognitionTask& task, const glm::dvec2& pivot_mm) {
  PoseLattice lattice = task.lattice();
  lattice.pivot_mm = pivot_mm;
  return {task.hypotheses, with_lattice(task.filter, lattice)};
}

TEST(AutomaticPivot, IsTheArraysCentreAtTheFirstTouchOfEachUnknown) {
  Device device = Device::open();
  for (const RecognitionTask& task : automatic_tasks()) {
    Recogniser automatic(device, task);
    const Estimate untouched = automatic.estimate();
    expect_same(untouched, Recogniser(device, about(task, {0.0, 0.0})).estimate());
    for (const std::uint64_t seed : {1, 4}) {
      const Recording recording = moved(touched_letter(seed), {{400.0, 200.0}, 0.7});
      const glm::dvec2 origin_mm = recording.T_robot_sensor.front().translation_mm;
      Recogniser fixed(device, about(task, origin_mm));
      fixed.update(all_touches(recording));
      automatic.reset();
      expect_same(automatic.estimate(), untouched);
      automatic.update(all_touches(recording));
      EXPECT_EQ(automatic.lattice().pivot_mm, origin_mm);
      EXPECT_EQ(automatic.marginals(0).grid.pivot_mm, origin_mm);
      expect_same(automatic.estimate(), fixed.estimate());
      EXPECT_EQ(automatic.marginals(0).xy, fixed.marginals(0).xy);
    }
  }
}

TEST(AutomaticPivot, IsNotPlacedByATouchThatIsRefused) {
  Device device = Device::open();
  const Recording recording = moved(touched_letter(2), {{400.0, 200.0}, 0.7});
  const std::vector<Touch> touches = all_touches(recording);
  for (const RecognitionTask& task : automatic_tasks()) {
    Recogniser recogniser(device, task);
    Touch unsound = touches[3];
    unsound.pressure = unsound.pressure.first(1);
    EXPECT_THROW(recogniser.update(std::span(&unsound, 1)), Error);
    Touch beyond = touches[3];
    beyond.T_robot_sensor.translation_mm.x = 2.0 * farthest_mm;
    EXPECT_THROW(recogniser.update(std::span(&beyond, 1)), Error);
    recogniser.update(touches);
    EXPECT_EQ(recogniser.lattice().pivot_mm, touches[0].T_robot_sensor.translation_mm);
  }
}

/// A touch whose elements are all out of contact but one, which is Unknown.
struct TouchBeside {
  TouchBeside(const Touch& like, const glm::dvec2& place_mm) : touch(like) {
    pressure.assign(like.pressure.size(), 0.0);
    pressure[7] = 1.0;
    touch.T_robot_sensor.translation_mm = place_mm;
    touch.pressure = pressure;
  }
  TouchBeside(const TouchBeside&) = delete;
  TouchBeside& operator=(const TouchBeside&) = delete;

  Touch touch;
  std::vector<double> pressure;
};

TEST(AutomaticPivot, PassesOverTouchesWithoutContactButTakesThemIn) {
  Device device = Device::open();
  const Recording recording = moved(touched_letter(1), {{400.0, 200.0}, 0.7});
  const glm::dvec2 first_mm = recording.T_robot_sensor.front().translation_mm;
  for (const RecognitionTask& task : automatic_tasks()) {
    Recogniser fixed(device, about(task, first_mm));
    Recogniser together(device, task);
    Recogniser one_by_one(device, task);
    for (const double away_mm : {6.0, 60.0, 400.0}) {
      SCOPED_TRACE(away_mm);
      const TouchBeside beside(recording.touch(0), first_mm + glm::dvec2(0.0, away_mm));
      std::vector<Touch> touches = all_touches(recording);
      touches.insert(touches.begin(), 2, beside.touch);
      fixed.reset();
      fixed.update(touches);
      together.reset();
      const Estimate untouched = together.estimate();
      together.update(touches);
      expect_same(together.estimate(), fixed.estimate());
      EXPECT_EQ(together.lattice().pivot_mm, first_mm);

      one_by_one.reset();
      for (std::size_t i = 0; i < touches.size(); ++i) {
        // The recogniser keeps copies: the caller's memory may go.
        std::vector<double> pressure(touches[i].pressure.begin(), touches[i].pressure.end());
        Touch copy = touches[i];
        copy.pressure = pressure;
        one_by_one.update(std::span(&copy, 1));
        std::fill(pressure.begin(), pressure.end(), 50.0);
        if (i < 2) {
          expect_same(one_by_one.estimate(), untouched);
        }
      }
      EXPECT_EQ(one_by_one.lattice().pivot_mm, first_mm);
      EXPECT_EQ(one_by_one.estimate().mode.bin, together.estimate().mode.bin);
      // Evaluated ahead, a touch is added in one step: float32 rounds it by some 1e-5 nats.
      EXPECT_NEAR(one_by_one.estimate().identity[0], together.estimate().identity[0], 1e-4);
    }
  }
}

TEST(AutomaticPivot, ForgetsTouchesThatWaitForItOnlyByAReset) {
  Device device = Device::open();
  const Recording recording = touched_letter(2);
  const std::vector<Touch> touches = all_touches(recording);
  // Over the object, so that the touch without contact changes the belief.
  const TouchBeside beside(touches[0], touches[0].T_robot_sensor.translation_mm);
  for (const RecognitionTask& task : automatic_tasks()) {
    Recogniser plain(device, task);
    plain.update(touches);
    Recogniser recogniser(device, task);
    Touch unsound = touches[3];
    unsound.pressure = unsound.pressure.first(1);
    EXPECT_THROW(recogniser.update(std::vector{beside.touch, unsound}), Error);
    recogniser.update(touches);
    expect_same(recogniser.estimate(), plain.estimate());

    recogniser.reset();
    recogniser.update(std::span(&beside.touch, 1));
    EXPECT_THROW(recogniser.update(std::vector{touches[0], unsound}), Error);
    recogniser.update(touches);
    // Bounds may drop all but one object, whatever the touches.
    const Estimate waited = recogniser.estimate();
    const Estimate unwaited = plain.estimate();
    EXPECT_TRUE(waited.identity != unwaited.identity ||
                waited.mode.log_likelihood != unwaited.mode.log_likelihood);

    recogniser.reset();
    recogniser.update(std::span(&beside.touch, 1));
    recogniser.reset();
    recogniser.update(touches);
    expect_same(recogniser.estimate(), plain.estimate());
  }
}

TEST(AutomaticPivot, DependsOnTheElementsAndNotOnTheSensorFramesOrigin) {
  Device device = Device::open();
  const Recording recording = moved(touched_letter(1), {{400.0, 200.0}, 0.7});
  // These are the touches of a frame 100 mm beside the elements, such as the robot's flange.
  const Pose T_flange_sensor{{100.0, 30.0}, 0.5};
  Recording of_flange = recording;
  for (Pose& pose : of_flange.T_robot_sensor) {
    pose = pose * inverse(T_flange_sensor);
  }
  for (glm::dvec2& element_mm : of_flange.elements_mm) {
    element_mm = T_flange_sensor * element_mm;
  }
  for (const RecognitionTask& task : automatic_tasks()) {
    Recogniser plain(device, task);
    plain.update(all_touches(recording));
    Recogniser flange(device, task);
    flange.update(all_touches(of_flange));
    // Places differ by rounding, some 1e-13 mm, but for the box of a turned array.
    EXPECT_LT(glm::distance(flange.lattice().pivot_mm, plain.lattice().pivot_mm), 1e-9);
    EXPECT_EQ(flange.estimate().mode.bin, plain.estimate().mode.bin);
    EXPECT_NEAR(flange.estimate().identity[0], plain.estimate().identity[0], 1e-6);
  }
}

TEST(AutomaticPivot, WaitsForAResetAfterAnUpdateWasBrokenOff) {
  Device device = Device::open();
  const Recording recording = touched_letter(2);
  for (FilterOptions filter : every_filter()) {
    if (auto* histogram = std::get_if<HistogramOptions>(&filter)) {
      histogram->none_weight = 1.0;  // takes touch by touch, and says how far it is
    }
    RecognitionTask task(shapes(), filter);
    task.auto_pivot = true;
    Recogniser recogniser(device, task);
    const auto update = [&] {
      const Touch first = recording.touch(0);
      recogniser.update(std::span(&first, 1),
                        [](double) { throw std::runtime_error("broken off"); });
    };
    EXPECT_THROW(update(), std::runtime_error);
    if (!traits_of(task.filter).certificate) {  // bounds take in no touch of a broken update
      EXPECT_THROW(recogniser.update(all_touches(recording)), Error);
    }
    recogniser.reset();
    recogniser.update(all_touches(recording));
  }
}

}  // namespace palpate::recogniser_test
