#include "palpate/learned_sensor.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "palpate/error.hpp"

namespace palpate::learned_sensor_test {

OccupancyGrid map_of(const std::string& label) {
  return {.label = label,
          .cell_mm = 2.0,
          .origin_mm = {-2.0, 4.0},
          .nx = 3,
          .ny = 2,
          .log_odds = {1.0F, 2.0F, 3.0F, 4.0F, 5.0F, 6.0F},
          .observations = {1.0F, 0.0F, 3.0F, 4.0F, 5.0F, 6.0F},
          .mean_level = {10.0F, 0.0F, 30.0F, 40.0F, 50.0F, 60.0F}};
}

LearnedSensor sensor_of_two_levels() {
  LearnedSensor sensor{.classifier = {.threshold = 5.0, .ratio = 0.2}, .gamma = 0.3};
  sensor.table = LearnedTable{};
  sensor.table->shared.assign(2 * ReadingLayer::nodes, -1.0);
  return sensor;
}

TEST(Apply, WithoutATableSetsWhatEquation7Needs) {
  LearnedSensor sensor = sensor_of_two_levels();
  std::vector<Hypothesis> hypotheses{{map_of("A")}};
  ContactModel contact{.prior = 0.4};
  apply(sensor, hypotheses, contact);
  sensor.table.reset();
  contact.prior = 0.4;
  apply(sensor, hypotheses, contact);
  EXPECT_EQ(contact.classifier.threshold, 5.0);
  EXPECT_EQ(contact.classifier.ratio, 0.2);
  EXPECT_EQ(contact.gamma, 0.3);
  EXPECT_EQ(contact.prior, 0.4);
  EXPECT_FALSE(contact.table) << "nor the table of a sensor before";
  EXPECT_FALSE(hypotheses[0].layer);
}

TEST(Apply, GivesLayersAndOneSetWhereNoObjectHasItsOwn) {
  LearnedSensor sensor = sensor_of_two_levels();
  sensor.table->objects["other"].assign(2 * ReadingLayer::nodes, -2.0);
  std::vector<Hypothesis> hypotheses{{map_of("A")}, {map_of("B")}};
  ContactModel contact{.prior = 0.4};
  apply(sensor, hypotheses, contact);
  ASSERT_TRUE(contact.table);
  EXPECT_EQ(contact.table->sets(), 1u);
  EXPECT_EQ(contact.table->first_log_odds, ReadingLayer::first_node);
  EXPECT_FALSE(contact.prior) << "that of the layers";
  const OccupancyGrid expected = reading_layer(hypotheses[1].map, sensor.table->layer);
  ASSERT_TRUE(hypotheses[1].layer);
  EXPECT_EQ(hypotheses[1].layer->log_odds, expected.log_odds);
  EXPECT_EQ(hypotheses[1].compared().prior, expected.prior);
}

TEST(Apply, GivesEachObjectItsOwnNumbersOrTheShared) {
  LearnedSensor sensor = sensor_of_two_levels();
  sensor.table->objects["B"].assign(2 * ReadingLayer::nodes, -2.0);
  std::vector<Hypothesis> hypotheses{{map_of("A")}, {map_of("B")}, {map_of("B")}};
  ContactModel contact;
  apply(sensor, hypotheses, contact);
  EXPECT_EQ(contact.table->sets(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(contact.log_likelihood(Reading::in_contact, {0.3}, i), i == 0 ? -1.0 : -2.0);
  }
}

TEST(Apply, ChangesNothingWhereAMapLacksItsLayer) {
  LearnedSensor sensor = sensor_of_two_levels();
  sensor.table->layer.of = MapLayer::mean_level;
  std::vector<Hypothesis> hypotheses{{map_of("A")}, {map_of("B")}};
  hypotheses[1].map.mean_level.clear();
  ContactModel contact{.prior = 0.4};
  EXPECT_THROW(apply(sensor, hypotheses, contact), Error);
  EXPECT_FALSE(hypotheses[0].layer || contact.table);
  EXPECT_EQ(contact.prior, 0.4);
  sensor.temperature = 0.0;
  EXPECT_THROW(apply(sensor, hypotheses, contact), Error);
}

TEST(LearnedSensor, RefusesALogProbabilityAbove0) {
  for (const bool own : {false, true}) {
    LearnedSensor sensor = sensor_of_two_levels();
    std::vector<double>& numbers = own ? sensor.table->objects["A"] : sensor.table->shared;
    numbers.assign(2 * ReadingLayer::nodes, -1.0);
    numbers[ReadingLayer::nodes + 3] = 0.0;
    sensor.validate();
    numbers[ReadingLayer::nodes + 3] = 5.0;
    EXPECT_THAT([&] { sensor.validate(); },
                testing::ThrowsMessage<Error>(testing::HasSubstr(
                    "table: number [1, 3] = 5: give the log of a probability, 0 or less")));
  }
}

TEST(MirrorImage, TurnsEveryLayerOfTheMapAround) {
  const OccupancyGrid map = map_of("A");
  const OccupancyGrid image = mirror_image(map);
  EXPECT_EQ(image.origin_mm, glm::dvec2(-2.0, 4.0)) << "cells at x = -2, 0 and 2";
  EXPECT_EQ(image.log_odds, (std::vector{3.0F, 2.0F, 1.0F, 6.0F, 5.0F, 4.0F}));
  EXPECT_EQ(image.observations, (std::vector{3.0F, 0.0F, 1.0F, 6.0F, 5.0F, 4.0F}));
  EXPECT_EQ(image.mean_level, (std::vector{30.0F, 0.0F, 10.0F, 60.0F, 50.0F, 40.0F}));
  OccupancyGrid aside = map;
  aside.origin_mm.x = 10.0;
  aside.observations.clear();
  EXPECT_EQ(mirror_image(aside).origin_mm.x, -14.0) << "the cell at 14";
  EXPECT_TRUE(mirror_image(aside).observations.empty());
  EXPECT_EQ(mirror_image(mirror_image(aside)).log_odds, aside.log_odds);
  EXPECT_EQ(mirror_image(mirror_image(aside)).origin_mm, aside.origin_mm);
}

TEST(AddMirrorImages, HalvesTheWeightOfWhatMayLieOnEitherSide) {
  std::vector<Hypothesis> hypotheses{{map_of("A"), 3.0}, {map_of("B"), 5.0}};
  hypotheses[0].map.mirror = true;
  add_mirror_images(hypotheses);
  ASSERT_EQ(hypotheses.size(), 3u);
  EXPECT_EQ(hypotheses[0].weight, 1.5);
  EXPECT_EQ(hypotheses[1].weight, 1.5);
  EXPECT_EQ(hypotheses[2].weight, 5.0);
  EXPECT_FALSE(hypotheses[0].mirrored || hypotheses[2].mirrored);
  EXPECT_TRUE(hypotheses[1].mirrored && hypotheses[1].map.mirror);
  EXPECT_EQ(hypotheses[1].map.label, "A");
  EXPECT_EQ(hypotheses[1].map.log_odds, mirror_image(hypotheses[0].map).log_odds);
}

TEST(PressFeatures, AreLogarithmsOfAreaForceAndPeak) {
  const std::vector<glm::dvec2> elements_mm(5);
  const std::vector<double> pressure{10.0, 0.5, 4.0, -1.0, 99.0};
  const std::vector<std::uint8_t> valid{1, 1, 1, 1, 0};
  const Touch touch{
      .T_robot_sensor = {}, .elements_mm = elements_mm, .pressure = pressure, .valid = valid};
  // Two elements in contact, 14.5 kPa in all, 10 kPa at most; the threshold is 2 kPa.
  const auto [area, force, peak] = press_features(touch, {}).values;
  EXPECT_DOUBLE_EQ(area, std::log(3.0));
  EXPECT_DOUBLE_EQ(force, std::log(8.25));
  EXPECT_DOUBLE_EQ(peak, std::log(6.0));
}

}  // namespace palpate::learned_sensor_test
