#include <gtest/gtest.h>

#include "palpate/touch.hpp"

namespace palpate::array_test {

TEST(DigitactsArray, HasTheGeometryOfTwoPadsSideBySide) {
  const std::vector<glm::dvec2> elements = digitacts_array();
  ASSERT_EQ(elements.size(), 36U);
  const double half_pitch_join = 1.1;  // 2.2 mm across the join of the pads, 1.9 mm within a pad
  EXPECT_EQ(elements[0], glm::dvec2(-half_pitch_join - 2 * 1.9, -2.5 * 1.9));
  EXPECT_EQ(elements[1], glm::dvec2(-3.0, -4.75));
  EXPECT_EQ(elements[5], glm::dvec2(4.9, -4.75));
  EXPECT_EQ(elements[6], glm::dvec2(-4.9, -1.5 * 1.9));
  EXPECT_EQ(elements[35], glm::dvec2(4.9, 4.75));
  // 11.6 x 11.3 mm in all, from outer edge to outer edge.
  EXPECT_NEAR(elements[35].x - elements[0].x + digitacts_element_mm, 11.6, 1e-12);
  EXPECT_NEAR(elements[35].y - elements[0].y + digitacts_element_mm, 11.3, 1e-12);
}

TEST(ArrayReach, IsTheDistanceOfTheFarthestElementFromTheCentre) {
  const std::vector<glm::dvec2> elements{{97.0, 4.0}, {103.0, -4.0}, {100.0, 3.0}};
  EXPECT_EQ(array_centre_mm(elements), glm::dvec2(100.0, 0.0));
  EXPECT_EQ(array_reach_mm(elements), 5.0);
  EXPECT_EQ(array_centre_mm(digitacts_array()), glm::dvec2(0.0, 0.0));
  EXPECT_EQ(array_centre_mm({}), glm::dvec2(0.0, 0.0));
  EXPECT_EQ(array_reach_mm({}), 0.0);
}

/// Three touches of two elements, with pressures 0, 1, 2, ...
Recording small_recording() {
  Recording r;
  r.T_robot_sensor = {{}, {{1.0, 2.0}, 3.0}, {}};
  r.pressure = {0.0, 1.0, 2.0, 3.0, 4.0, 5.0};
  r.elements_mm = {{-1.0, 0.0}, {1.0, 0.0}};
  return r;
}

TEST(Recording, ViewsOneTouchOfAnArrayThatStays) {
  const Recording r = small_recording();
  const Touch touch = r.touch(1);
  EXPECT_EQ(r.size(), 3U);
  EXPECT_EQ(r.elements(), 2U);
  EXPECT_EQ(touch.T_robot_sensor.theta_rad, 3.0);
  EXPECT_EQ(touch.pressure[0], 2.0);
  EXPECT_EQ(touch.pressure[1], 3.0);
  EXPECT_EQ(touch.elements_mm[1], glm::dvec2(1.0, 0.0));
  EXPECT_TRUE(touch.valid.empty());
}

TEST(Recording, ViewsTheRowOfAnArrayAndOfDeadElementsThatChange) {
  Recording r = small_recording();
  r.elements_mm = {{0, 0}, {0, 1}, {1, 0}, {1, 1}, {2, 0}, {2, 1}};
  r.valid = {1, 1, 1, 0, 0, 1};
  EXPECT_EQ(r.touch(2).elements_mm[1], glm::dvec2(2.0, 1.0));
  EXPECT_EQ(r.touch(1).valid[1], 0);
  EXPECT_EQ(r.touch(2).valid[0], 0);
  r.valid = {0, 1};
  EXPECT_EQ(r.touch(2).valid[0], 0) << "one row holds for all touches";
}

TEST(Recording, ViewsARangeOfTouches) {
  const Recording r = small_recording();
  const std::vector<Touch> touches = r.touches(1, 3);
  ASSERT_EQ(touches.size(), 2U);
  EXPECT_EQ(touches[0].pressure[0], 2.0);
  EXPECT_EQ(touches[1].pressure[0], 4.0);
  EXPECT_TRUE(r.touches(2, 2).empty());
  EXPECT_EQ(Recording{}.elements(), 0U);
}

}  // namespace palpate::array_test
