// Recognition with a learned sensor, objects on their other side included.

#include <gtest/gtest.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <cmath>

#include "palpate/learned_sensor.hpp"
#include "recognition/filter_choice.hpp"
#include "recognition/recogniser.hpp"
#include "recognition/recognition_record.hpp"
#include "shapes.hpp"
#include "support/synthetic.hpp"
#include "support/touched_shape.hpp"
#include "support/unknown_of.hpp"

namespace palpate::learned_recognition_test {

/// A table that holds Eq. 7 at its nodes.
LearnedSensor equation_7() {
  const ContactModel model{.gamma = 0.1, .prior = 0.2};
  LearnedSensor sensor{.table = LearnedTable{}};
  for (const Reading reading : {Reading::no_contact, Reading::in_contact}) {
    for (int i = 0; i < ReadingLayer::nodes; ++i) {
      const double l = ReadingLayer::first_node + 0.5 * i;
      sensor.table->shared.push_back(model.log_likelihood(reading, {l}));
    }
  }
  return sensor;
}

/// 61 x 61 cells of 1 mm, all of them sensed.
OccupancyGrid sensed_map(const std::string& label, const std::function<double()>& log_odds) {
  OccupancyGrid map{
      .label = label, .cell_mm = 1.0, .origin_mm = {-30.0, -30.0}, .nx = 61, .ny = 61};
  for (int k = 0; k < map.nx * map.ny; ++k) {
    map.log_odds.push_back(static_cast<float>(log_odds()));
    map.observations.push_back(1.0F);
  }
  return map;
}

/// Four touches of 36 elements, all of them at whole millimetres.
Recording touches_at_whole_mm() {
  Recording recording = random_recording(4, 36, 91);
  for (std::size_t e = 0; e < 36; ++e) {
    recording.elements_mm[e] = {static_cast<double>(e % 6) - 2.0, static_cast<double>(e / 6) - 3.0};
  }
  for (Pose& pose : recording.T_robot_sensor) {
    pose = {glm::round(pose.translation_mm), 0.0};
  }
  return recording;
}

/// Log of the first hypothesis's evidence over the second's.
double log_odds_of(Device& device, const RecognitionTask& task, std::span<const Touch> touches) {
  Recogniser recogniser(device, task);
  recogniser.update(touches);
  const Estimate estimate = recogniser.estimate();
  return estimate.log_evidence[0] - estimate.log_evidence[1];
}

void expect_equation_7(const std::vector<Hypothesis>& maps, std::span<const Touch> touches,
                       const FilterOptions& filter) {
  Device device = Device::open();
  std::vector<Hypothesis> learned = maps;
  FilterOptions of_table = filter;
  std::visit([&](auto& options) { apply(equation_7(), learned, options.contact); }, of_table);
  const double plain = log_odds_of(device, RecognitionTask(maps, filter), touches);
  const double tabled = log_odds_of(device, RecognitionTask(learned, of_table), touches);
  EXPECT_GT(std::abs(plain), 0.1) << "the touches tell nothing";
  // It is the difference of two objects, each within 1e-4 nats per touch.
  EXPECT_NEAR(tabled, plain, 2e-4 * static_cast<double>(touches.size()));
}

TEST(LearnedTable, OfEquation7GivesItsAnswerByBins) {
  // Elements meet cells at their centres, and cells lie at the table's nodes.
  Uniform random(92);
  const auto at_a_node = [&] { return 0.5 * std::floor(random(-16.0, 17.0)); };
  const std::vector<Hypothesis> maps{{sensed_map("A", at_a_node)},
                                     {sensed_map("B", at_a_node), 2.0}};
  const PoseLattice lattice{
      .x_mm = {-3.5, 3.5, 7}, .y_mm = {-3.5, 3.5, 7}, .theta_rad = {0.0, 0.0, 1}};
  const Recording recording = touches_at_whole_mm();
  expect_equation_7(maps, all_touches(recording), HistogramOptions{.lattice = lattice});
  expect_equation_7(maps, all_touches(recording),
                    BoundedOptions{.lattice = lattice, .evidence_nats = 1e-6});
}

TEST(LearnedTable, OfEquation7GivesItsAnswerByParticles) {
  // Particles lie between the cells: all of a map are alike.
  const std::vector<Hypothesis> maps{{sensed_map("A", [] { return 1.5; })},
                                     {sensed_map("B", [] { return -0.5; })}};
  const Recording recording = touches_at_whole_mm();
  const Touch touch = recording.touch(0);
  const PoseLattice region{.x_mm = {-3.0, 3.0, 1}, .y_mm = {-3.0, 3.0, 1}};
  expect_equation_7(maps, std::span(&touch, 1),
                    ParticleOptions{.particles = 2000, .region = region});
}

TEST(LearnedTable, SetsObjectsApartThatAreTouchedAlike) {
  // Both objects have one map; the numbers of B alone hold In Contact for likely anywhere.
  LearnedSensor sensor = equation_7();
  sensor.table->objects["B"] = sensor.table->shared;
  std::fill_n(sensor.table->objects["B"].begin() + ReadingLayer::nodes, ReadingLayer::nodes, 0.0);
  std::vector<Hypothesis> maps{{sensed_map("A", [] { return -2.0; })},
                               {sensed_map("B", [] { return -2.0; })}};
  const std::vector<glm::dvec2> elements_mm{{0.0, 0.0}, {1.0, 0.0}};
  const std::vector<double> pressure{9.0, 8.0};
  const Touch touch{.T_robot_sensor = {}, .elements_mm = elements_mm, .pressure = pressure};
  HistogramOptions options{.lattice = {.x_mm = {-1.0, 1.0, 2}, .y_mm = {-1.0, 1.0, 2}}};
  apply(sensor, maps, options.contact);
  Device device = Device::open();
  const double of_a =
      ContactModel{.gamma = 0.1, .prior = 0.2}.log_likelihood(Reading::in_contact, {-2.0});
  EXPECT_NEAR(log_odds_of(device, RecognitionTask(maps, options), std::span(&touch, 1)), 2.0 * of_a,
              2e-4);
}

bool on_mirrored_l(const glm::dvec2& p_mm) { return on_letter_l({-p_mm.x, p_mm.y}); }

TEST(Mirror, FindsTheObjectOnItsOtherSide) {
  Device device = Device::open();
  std::vector<Hypothesis> maps = shapes();
  maps[0].map.mirror = true;
  add_mirror_images(maps);
  const Pose T_object_robot{{1.0, -2.0}, 0.7};
  for (const bool mirrored : {false, true}) {
    Recording recording =
        touches_of(mirrored ? on_mirrored_l : on_letter_l, T_object_robot, 12, 31);
    recording.truth = {.object = "L", .T_object_robot = T_object_robot};
    for (const std::size_t filter : {0U, 2U}) {
      const RecognitionTask task(maps, every_filter()[filter]);
      EXPECT_EQ(task.labels, (std::vector<std::string>{"L", "disc"}));
      Recogniser recogniser(device, task);
      const RecognitionStep step = recognise(recogniser, task, unknown_of(recording), false).last();
      EXPECT_EQ(step.right, true);
      EXPECT_EQ(task.hypotheses[step.mode.object].mirrored, mirrored);
      EXPECT_EQ(step.error_mm.has_value(), !mirrored) << "the truth is of the object as learned";
      EXPECT_EQ(step.refined_error_mm.has_value(), !mirrored);
      EXPECT_EQ(step.true_T_robot_object().has_value(), !mirrored);
      EXPECT_EQ(step.fit.value().verdict, Verdict::fits);
      // Bins of 0.5 mm and 22.5 degrees; the image's frame is where the mirrored letter's was.
      EXPECT_LT(glm::distance(step.pose().translation_mm, T_object_robot.translation_mm), 1.0);
      EXPECT_NEAR(step.pose().theta_rad, T_object_robot.theta_rad, 0.2);
    }
  }
}

TEST(Temperature, LeavesPosesAndTellsTheSameByBoundsAsByTheHistogram) {
  Device device = Device::open();
  const Recording recording = touched_letter(4);
  std::vector<RecognitionStep> steps;
  for (const std::size_t filter : {0U, 2U}) {
    const LearnedSensor sensor{.temperature = 8.0};
    RecognitionTask task(shapes(), with_evidence(every_filter()[filter], sensor));
    task.sensor.temperature = sensor.temperature;
    Recogniser recogniser(device, task);
    steps.push_back(recognise(recogniser, task, unknown_of(recording), false).last());
    task.sensor.temperature = 1.0;
    const RecognitionStep plain = recognise(recogniser, task, unknown_of(recording), false).last();
    EXPECT_EQ(steps.back().mode.bin, plain.mode.bin);
    EXPECT_EQ(steps.back().refined->covariance, plain.refined->covariance);
    EXPECT_LT(steps.back().confidence(), plain.confidence());
  }
  ASSERT_EQ(steps[1].identity_bounds.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto [low, high] = steps[1].identity_bounds[i];
    // The histogram rounds in float32, by some 1e-5 nats.
    EXPECT_GE(steps[0].identity[i], low - 1e-5);
    EXPECT_LE(steps[0].identity[i], high + 1e-5);
    // Each of two log evidences is known within a 20th of the temperature.
    EXPECT_LT(high - low, 0.05);
  }
}

TEST(LearnedSensor, TellsTheSameByBoundsAsByTheHistogram) {
  Device device = Device::open();
  LearnedSensor sensor = equation_7();
  sensor.table->layer.near_mm = 1.0;
  sensor.table->layer.far_mm = 3.0;
  // The disc's own numbers leave more to chance.
  for (const double l : sensor.table->shared) {
    sensor.table->objects["disc"].push_back(0.8 * l);
  }
  LearnedFeatures features{.weight = 0.3, .any = {.mean = {2.0, 4.0, 1.5}, .sd = {1.0, 1.0, 1.0}}};
  features.objects["disc"] = {.mean = {3.0, 5.0, 2.0}, .sd = {0.5, 0.5, 0.5}};
  sensor.temperature = 4.0;
  sensor.features = features;
  std::vector<Hypothesis> maps = shapes();
  maps[0].map.mirror = true;
  add_mirror_images(maps);
  for (const std::uint64_t seed : {5, 6, 7}) {
    const Recording recording = seed == 6 ? touched_disc(seed) : touched_letter(seed);
    std::vector<RecognitionRecord> records;
    for (const std::size_t filter : {0U, 2U}) {
      FilterOptions options = every_filter()[filter];
      std::vector<Hypothesis> learned = maps;
      std::visit([&](auto& of) { apply(sensor, learned, of.contact); }, options);
      RecognitionTask task(learned, with_evidence(options, sensor));
      task.sensor.temperature = sensor.temperature;
      task.sensor.features = sensor.features;
      Recogniser recogniser(device, task);
      records.push_back(recognise(recogniser, task, unknown_of(recording), true));
    }
    for (std::size_t k = 0; k < recording.size(); ++k) {
      const RecognitionStep& dense = records[0].trace[k];
      const RecognitionStep& bounded = records[1].trace[k];
      ASSERT_EQ(bounded.identity_bounds.size(), 2u);
      for (std::size_t i = 0; i < 2; ++i) {
        const auto [low, high] = bounded.identity_bounds[i];
        // Two log evidences of the histogram, each within 1e-4 nats per touch, over 4.
        const double rounding = 2e-4 * static_cast<double>(k + 1) / 4.0;
        EXPECT_GE(dense.identity[i], low - rounding) << "touch " << k;
        EXPECT_LE(dense.identity[i], high + rounding) << "touch " << k;
        EXPECT_LT(high - low, 0.05);
      }
    }
  }
}

}  // namespace palpate::learned_recognition_test
