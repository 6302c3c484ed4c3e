#include "recognition/surprise.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "letters.hpp"
#include "model/displacement_points.hpp"
#include "model/interpolated_map.hpp"
#include "model/predicted_readings.hpp"
#include "model/reading_mixture.hpp"
#include "palpate/pose_error.hpp"
#include "recognition/recognition_record.hpp"
#include "shapes.hpp"
#include "unknown_of.hpp"

namespace palpate::surprise_test {

/// Mean and standard deviation of numbers.
struct Spread {
  double mean = 0.0;
  double sd = 0.0;
};

Spread spread_of(const std::vector<double>& numbers) {
  const auto n = static_cast<double>(numbers.size());
  Spread spread;
  for (const double x : numbers) {
    spread.mean += x / n;
  }
  for (const double x : numbers) {
    spread.sd += std::pow(x - spread.mean, 2.0) / n;
  }
  spread.sd = std::sqrt(spread.sd);
  return spread;
}

/// A belief, and touches that happen as it and the options say.
class ModelledTouches {
 public:
  explicit ModelledTouches(const HistogramOptions& options)
      : options_(options), task_(shapes(), options) {}

  PoseSample draw_sample() {
    const Pose near = random_displacement({.mm = 0.5, .rad = 0.2}, random_);
    return {random_.uniform() < 0.7 ? 0 : 1, Pose{{1.0, -2.0}, 0.4} * near};
  }

  /// The surprise of a touch that is displaced, of an object that has slipped, by these deviations.
  double surprise(const DisplacementSd& touch_sd, const DisplacementSd& slip_sd) {
    std::vector<PoseSample> samples(surprise_samples(36));
    for (PoseSample& sample : samples) {
      sample = draw_sample();
    }
    const auto [object, T_object_robot] = draw_sample();
    const Pose T_robot_sensor{{random_.uniform(-5.0, 5.0), random_.uniform(-5.0, 5.0)},
                              random_.uniform(0.0, 6.0)};
    const OccupancyGrid& map = task_.hypotheses[object].map;
    ContactModel contact = options_.contact;
    contact.prior = map.prior;
    const Pose slip = random_displacement(slip_sd, random_);
    const std::vector<glm::dvec2> elements_mm = digitacts_array();
    ReadingMixture one(1, 36, 2);
    const std::vector<double> logs =
        reading_log_likelihoods(elements_mm,
                                slipped(T_object_robot, slip, body_of(map).centroid_mm) *
                                    T_robot_sensor * random_displacement(touch_sd, random_),
                                InterpolatedMap(map, map.prior), contact, object);
    one.set(0, std::span(logs));
    // No Contact at -20 kPa also where no element is in contact.
    std::vector<double> pressure;
    for (const Reading reading : PredictedTouches(one).draw(0, random_).readings) {
      pressure.push_back(reading == Reading::in_contact ? 10.0 : -20.0);
    }
    return SurpriseJudge(task_)
        .surprise_of(TouchEvidence({.T_robot_sensor = T_robot_sensor,
                                    .elements_mm = elements_mm,
                                    .pressure = pressure},
                                   task_.contact()),
                     samples)
        .value();
  }

  Spread spread(const DisplacementSd& touch_sd, const DisplacementSd& slip_sd) {
    std::vector<double> all;
    for (int i = 0; i < 400; ++i) {
      all.push_back(surprise(touch_sd, slip_sd));
    }
    return spread_of(all);
  }

 private:
  HistogramOptions options_;
  RecognitionTask task_;
  Random random_{1, Stream::pose_noise};
};

// Four standard errors of 400 touches, whose prediction from 64 samples is out by 0.125 itself, in
// part the same way for all. The variance is out by 2 / sqrt(400), for a kurtosis of 5.
constexpr double mean_tolerance = 0.25;
constexpr double sd_tolerance = 0.25;

TEST(Surprise, OfTouchesAsPredictedHasMeanZeroAndVarianceOne) {
  constexpr DisplacementSd none;
  constexpr DisplacementSd some{.mm = 1.0, .rad = 0.1};
  for (const auto& [touch_sd, slip_sd] :
       {std::pair(none, none), std::pair(some, none), std::pair(none, some)}) {
    const Spread spread = ModelledTouches({.lattice = {}, .touch_sd = touch_sd, .slip_sd = slip_sd})
                              .spread(touch_sd, slip_sd);
    EXPECT_NEAR(spread.mean, 0.0, mean_tolerance) << touch_sd.mm << ' ' << slip_sd.mm;
    EXPECT_NEAR(spread.sd, 1.0, sd_tolerance) << touch_sd.mm << ' ' << slip_sd.mm;
  }
}

TEST(Surprise, GrowsWithWhatTheBeliefDoesNotKnow) {
  constexpr DisplacementSd none;
  for (const auto& [touch_sd, slip_sd] : {std::pair(DisplacementSd{.mm = 2.0, .rad = 0.1}, none),
                                          std::pair(none, DisplacementSd{.mm = 2.0, .rad = 0.1})}) {
    EXPECT_GT(ModelledTouches({.lattice = {}}).spread(touch_sd, slip_sd).mean, 1.0)
        << touch_sd.mm << ' ' << slip_sd.mm;
  }
}

// The frame of a map is anywhere; where no cell is occupied, the object turns about the grid's
// middle when it slips.
TEST(Surprise, DoesNotDependOnTheFrameOfAMapWithoutCells) {
  const auto surprise = [](const glm::dvec2& shift_mm) {
    std::vector<Hypothesis> maps = shapes();
    for (Hypothesis& hypothesis : maps) {
      hypothesis.map.origin_mm += shift_mm;
      for (float& cell : hypothesis.map.log_odds) {
        cell = cell > 0.0F ? -0.1F : -3.0F;
      }
    }
    const RecognitionTask task(std::move(maps),
                               HistogramOptions{.lattice = {}, .slip_sd = {.mm = 0.0, .rad = 0.5}});
    const std::vector<PoseSample> samples(64, {0, Pose{shift_mm, 0.0}});
    const std::vector<glm::dvec2> elements_mm = digitacts_array();
    std::vector<double> pressure(36, -20.0);
    std::fill_n(pressure.begin(), 6, 10.0);
    return SurpriseJudge(task)
        .surprise_of(TouchEvidence({.T_robot_sensor = {{3.0, 1.0}, 0.0},
                                    .elements_mm = elements_mm,
                                    .pressure = pressure},
                                   task.contact()),
                     samples)
        .value();
  };
  // The places of elements are rounded in float64, log odds between cells in float32.
  EXPECT_NEAR(surprise({64.0, -32.0}), surprise({0.0, 0.0}), 1e-3);
}

TEST(Surprise, TakesFewerSamplesForLargeArrays) {
  EXPECT_EQ(surprise_samples(1), 64u);
  EXPECT_EQ(surprise_samples(36), 64u);
  EXPECT_LT(surprise_samples(600), 64u);
  EXPECT_EQ(surprise_samples(100'000), 32u);
}

TEST(Surprise, IsNotKnownOfATouchThatSaysNothing) {
  const RecognitionTask task(shapes(), HistogramOptions{});
  const std::vector<glm::dvec2> elements_mm = digitacts_array();
  const std::vector<double> pressure(36, 2.0);  // at the threshold
  const Touch touch{.elements_mm = elements_mm, .pressure = pressure};
  const std::vector<PoseSample> samples(8);
  EXPECT_FALSE(SurpriseJudge(task).surprise_of(TouchEvidence(touch, task.contact()), samples));
}

TEST(Surprise, OfLettersTellsMisplacedTouchesFromExactOnes) {
  Device device = Device::open();
  const RecognitionTask task(learned_letters(device), HistogramOptions{});
  Recogniser recogniser(device, task);
  const auto spread = [&](const DisplacementSd& misplaced) {
    std::vector<double> all;
    Random random(2, Stream::pose_noise);
    for (const char* letter : {"A", "E", "I", "O", "U"}) {
      for (const std::uint64_t seed : {1U, 2U}) {
        Recording recording = letter_touches(letter, 8, seed);
        for (Pose& pose : recording.T_robot_sensor) {
          pose = pose * inverse(random_displacement(misplaced, random));
        }
        for (const RecognitionStep& step :
             recognise(recogniser, task, unknown_of(recording), true).trace) {
          if (step.surprise) {
            all.push_back(*step.surprise);
          }
        }
      }
    }
    EXPECT_EQ(all.size(), 70u) << "of every touch but the first";
    return spread_of(all);
  };
  // Touches of the simulator keep closer to the maps than gamma and the maps' odds allow for: 540
  // of them had a mean of -0.9 and a deviation of 0.5.
  const Spread exact = spread({});
  EXPECT_NEAR(exact.mean, -0.9, 0.3) << "four standard errors of 70, and the bins' width";
  EXPECT_LT(exact.sd, 1.0);
  // 540 misplaced by 2 mm and 0.1 rad had 2.8 and 4.5, with a standard error of 0.5 for 70.
  EXPECT_GT(spread({.mm = 2.0, .rad = 0.1}).mean, 1.3);
}

TEST(Surprise, IsMeasuredWithoutAnEffectOnTheResult) {
  Device device = Device::open();
  for (const FilterOptions& filter : every_filter()) {
    const RecognitionTask task(shapes(), filter);
    Recogniser recogniser(device, task);
    const Recording recording = touched_letter(5);
    const Unknown unknown = unknown_of(recording);
    const RecognitionStep last = recognise(recogniser, task, unknown, false).last();
    const RecognitionRecord traced = recognise(recogniser, task, unknown, true);
    recogniser.reset();
    recogniser.update(unknown.touches);
    const RecognitionStep at_once = judge(recogniser.estimate(), unknown.truth, task);
    for (const RecognitionStep& other : {traced.last(), at_once}) {
      EXPECT_EQ(last.identity, other.identity);
      EXPECT_EQ(last.mode.bin, other.mode.bin);
      EXPECT_EQ(last.mode.log_likelihood, other.mode.log_likelihood);
    }
    // Bounds draw from what a search found, if there is one: equally likely samples, but others.
    const bool draws_alike = !std::holds_alternative<BoundedOptions>(filter);
    EXPECT_EQ(last.surprise.has_value(), traced.last().surprise.has_value());
    EXPECT_NEAR(last.surprise.value_or(0.0), traced.last().surprise.value_or(0.0),
                draws_alike ? 0.0 : 0.5)
        << "four times the chance of 64 samples";
    EXPECT_FALSE(traced.trace.front().surprise) << "only the prior comes before";
    if (std::holds_alternative<ParticleOptions>(filter)) {
      EXPECT_FALSE(last.surprise);
      continue;
    }
    for (std::size_t i = 1; i < traced.trace.size(); ++i) {
      // A touch of pressures of 0 alone says nothing.
      const bool says = *std::ranges::max_element(unknown.touches[i].pressure) > 0.0;
      EXPECT_EQ(traced.trace[i].surprise.has_value(), says) << i;
    }
  }
}

TEST(Surprise, NeedsNoSearchOfVeryManyBins) {
  BoundedOptions options = std::get<BoundedOptions>(every_filter()[2]);
  options.lattice.x_mm.count = 2000;
  options.lattice.y_mm.count = 2000;
  options.budget_s = 1e-3;  // whatever it proves
  const RecognitionTask task(shapes(), options);
  Recogniser recogniser(task);
  const Recording recording = touched_letter(5);
  std::vector<Touch> touches = unknown_of(recording).touches;
  while (*std::ranges::max_element(touches.back().pressure) == 0.0) {
    touches.pop_back();  // says nothing
  }
  ASSERT_GE(touches.size(), 4U) << "after which narrower beliefs are searched, in fewer bins";
  const RecognitionStep step = take_step(recogniser, task, touches, {});
  // Fewer bins tell the same, but for the chance of 64 samples and the bins' width.
  const RecognitionTask few(shapes(), every_filter()[2]);
  Recogniser coarse(few);
  EXPECT_NEAR(step.surprise.value(), take_step(coarse, few, touches, {}).surprise.value(), 0.5);
}

TEST(Surprise, OfTheFirstTouchInContactIsNotKnownEitherAboutAnAutomaticPivot) {
  Device device = Device::open();
  RecognitionTask task(shapes(), every_filter().front());
  task.auto_pivot = true;
  Recogniser recogniser(device, task);
  Recording recording = touched_letter(6);
  std::fill_n(recording.pressure.begin(), 36, 0.0);  // the first touch waits for the pivot
  const RecognitionRecord record = recognise(recogniser, task, unknown_of(recording), true);
  EXPECT_FALSE(record.trace[0].surprise);
  EXPECT_FALSE(record.trace[1].surprise);
  EXPECT_TRUE(record.trace[2].surprise);
}

}  // namespace palpate::surprise_test
