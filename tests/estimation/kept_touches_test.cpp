#include "estimation/known_elements.hpp"

#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/error.hpp"
#include "support/synthetic.hpp"

namespace palpate::kept_touches_test {

void expect_equal(std::span<const TouchEvidence> kept, const std::vector<Touch>& touches) {
  ASSERT_EQ(kept.size(), touches.size());
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const TouchEvidence expected(touches[i], {});
    EXPECT_EQ(kept[i].readings, expected.readings);
    EXPECT_EQ(kept[i].elements_mm, expected.elements_mm);
    EXPECT_EQ(kept[i].T_robot_sensor.translation_mm, expected.T_robot_sensor.translation_mm);
    EXPECT_EQ(kept[i].T_robot_sensor.theta_rad, expected.T_robot_sensor.theta_rad);
  }
}

TEST(KeptTouches, GivesThemBackInTheirOrder) {
  const Recording recording = random_recording(100, 8, 720);
  const std::vector<Touch> touches = all_touches(recording);
  KeptTouches kept;
  EXPECT_EQ(kept.size(), 0U);
  kept.add(std::span<const Touch>(), {});
  EXPECT_EQ(kept.size(), 0U);
  kept.add(std::span(touches).first(1), {});
  kept.add(evidence_of(std::span(touches).subspan(1), {}));
  expect_equal(kept.all(), touches);
  kept.clear();
  EXPECT_EQ(kept.size(), 0U);
  EXPECT_TRUE(kept.all().empty());
  kept.add(std::span(touches).last(2), {});
  expect_equal(kept.all(), {touches[98], touches[99]});
}

TEST(KeptTouches, KeepsArraysOfSeveralSizes) {
  const Recording small = random_recording(2, 1, 721);
  const Recording large = random_recording(2, 400'000, 722);  // beyond the room
  KeptTouches kept;
  const std::vector<Touch> touches{large.touch(0), small.touch(0), large.touch(1), small.touch(1)};
  kept.add(std::span<const Touch>(touches), {});
  expect_equal(kept.all(), touches);
}

TEST(KeptTouches, KeepsNoneWhereOneIsNotSound) {
  Recording recording = random_recording(4, 8, 723);
  KeptTouches kept;
  const Touch sound = recording.touch(0);
  kept.add(std::span(&sound, 1), {});
  recording.T_robot_sensor[3].translation_mm.x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(kept.add(all_touches(recording), {}), Error);
  expect_equal(kept.all(), {sound});
}

}  // namespace palpate::kept_touches_test
