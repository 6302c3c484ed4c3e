#include "palpate/touch.hpp"

#include <gtest/gtest.h>

namespace palpate::touch_test {

TEST(SamePlacement, IsOfPoseAndElementsAndNotOfReadings) {
  const std::vector<glm::dvec2> elements_mm{{0.0, 1.0}, {2.0, 3.0}};
  const std::vector<glm::dvec2> equal_mm = elements_mm;
  const std::vector<double> one{1.0, 2.0};
  const std::vector<double> other{3.0, 4.0};
  const Touch touch{
      .T_robot_sensor = {{5.0, 6.0}, 7.0}, .elements_mm = elements_mm, .pressure = one};
  Touch same = touch;
  same.elements_mm = equal_mm;
  same.pressure = other;
  EXPECT_TRUE(same_placement(touch, same));

  Touch turned = touch;
  turned.T_robot_sensor.theta_rad += 1e-12;
  EXPECT_FALSE(same_placement(touch, turned));
  for (const int axis : {0, 1}) {
    Touch moved = touch;
    moved.T_robot_sensor.translation_mm[axis] += 1e-12;
    EXPECT_FALSE(same_placement(touch, moved));
    std::vector<glm::dvec2> bent_mm = elements_mm;
    bent_mm[1][axis] += 1e-12;
    Touch bent = touch;
    bent.elements_mm = bent_mm;
    EXPECT_FALSE(same_placement(touch, bent));
  }
  Touch fewer = touch;
  fewer.elements_mm = std::span(elements_mm).first(1);
  EXPECT_FALSE(same_placement(touch, fewer));
}

}  // namespace palpate::touch_test
