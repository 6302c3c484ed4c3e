// Recognition with a learned sensor, objects on their other side included.

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "palpate/learned_sensor.hpp"
#include "recognition/filter_choice.hpp"
#include "shapes.hpp"
#include "support/touched_shape.hpp"

namespace palpate::learned_recognition_test {

/// The shapes, of which the letter may lie on its other side.
std::vector<Hypothesis> mirrored_shapes() {
  std::vector<Hypothesis> maps = shapes();
  maps[0].map.mirror = true;
  add_mirror_images(maps);
  return maps;
}

bool on_mirrored_l(const glm::dvec2& p_mm) { return on_letter_l({-p_mm.x, p_mm.y}); }

TEST(Mirror, FindsTheObjectOnItsOtherSide) {
  const Pose T_object_robot{{1.0, -2.0}, 0.7};
  for (const bool mirrored : {false, true}) {
    Recording recording =
        touches_of(mirrored ? on_mirrored_l : on_letter_l, T_object_robot, 12, 31);
    recording.truth = {.object = "L", .T_object_robot = T_object_robot};
    for (const std::size_t filter : {0U, 2U}) {
      const RecognitionTask task(mirrored_shapes(), every_filter()[filter]);
      EXPECT_EQ(task.labels, (std::vector<std::string>{"L", "disc"}));
      const RecognitionStep step = last_step(task, recording);
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

/// A table of Eq. 7 over a layer, but for the disc's own numbers, which leave more to chance, with
/// features of the disc and a temperature.
LearnedSensor learned_sensor() {
  const ContactModel equation_7{.gamma = 0.1, .prior = 0.2};
  LearnedSensor sensor{.table = LearnedTable{.layer = {.near_mm = 1.0, .far_mm = 3.0}},
                       .temperature = 4.0};
  for (const Reading reading : {Reading::no_contact, Reading::in_contact}) {
    for (int i = 0; i < ReadingLayer::nodes; ++i) {
      const double nats = equation_7.log_likelihood(reading, {ReadingLayer::first_node + 0.5 * i});
      sensor.table->shared.push_back(nats);
      sensor.table->objects["disc"].push_back(0.8 * nats);
    }
  }
  sensor.features = {.weight = 0.3,
                     .any = {.mean = {2.0, 4.0, 1.5}, .sd = {1.0, 1.0, 1.0}},
                     .objects = {{"disc", {.mean = {3.0, 5.0, 2.0}, .sd = {0.5, 0.5, 0.5}}}}};
  return sensor;
}

TEST(LearnedSensor, TellsTheSameByBoundsAsByTheHistogram) {
  const LearnedSensor sensor = learned_sensor();
  for (const Recording& recording : {touched_letter(5), touched_disc(6), touched_letter(7)}) {
    std::vector<RecognitionRecord> records;
    for (const std::size_t filter : {0U, 2U}) {
      FilterOptions options = every_filter()[filter];
      std::vector<Hypothesis> maps = mirrored_shapes();
      std::visit([&](auto& of) { apply(sensor, maps, of.contact); }, options);
      RecognitionTask task(maps, with_evidence(options, sensor));
      task.sensor.temperature = sensor.temperature;
      task.sensor.features = sensor.features;
      records.push_back(recognised(task, recording, true));
    }
    for (std::size_t k = 0; k < recording.size(); ++k) {
      const RecognitionStep& bounded = records[1].trace[k];
      ASSERT_EQ(bounded.identity_bounds.size(), 2u);
      for (std::size_t i = 0; i < 2; ++i) {
        const auto [low, high] = bounded.identity_bounds[i];
        // Two log evidences of the histogram, each within 1e-4 nats per touch, over 4.
        const double rounding = 2e-4 * static_cast<double>(k + 1) / 4.0;
        EXPECT_GE(records[0].trace[k].identity[i], low - rounding) << "touch " << k;
        EXPECT_LE(records[0].trace[k].identity[i], high + rounding) << "touch " << k;
        // Each of two log evidences is known within a 20th of the temperature.
        EXPECT_LT(high - low, 0.05);
      }
    }
  }
}

}  // namespace palpate::learned_recognition_test
