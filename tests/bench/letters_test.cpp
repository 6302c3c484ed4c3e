#include "letters.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <string>

#include <gtest/gtest.h>

namespace palpate::bench::letters_test {

double pressed(const Recording& recording) {
  return std::accumulate(recording.pressure.begin(), recording.pressure.end(), 0.0);
}

TEST(GlyphScene, HasObjectsOfDifferentNamesAndSizesAnywhereInTheRegion) {
  constexpr std::size_t of_a_size = most_glyphs / 3;
  constexpr double extent_mm = 100.0;
  std::set<std::string> names;
  std::vector<double> by_size(3);
  double farthest_mm = 0.0;
  for (const Recording& unknown : glyph_unknowns(most_glyphs, most_glyphs, 3, extent_mm, 7)) {
    EXPECT_EQ(unknown.size(), 3U);
    by_size[names.size() / of_a_size] += pressed(unknown);
    names.insert(unknown.truth->object);
    const Pose& pose = unknown.truth->T_object_robot;
    for (const double at_mm : {pose.translation_mm.x, pose.translation_mm.y}) {
      EXPECT_LE(std::abs(at_mm), extent_mm);
      farthest_mm = std::max(farthest_mm, std::abs(at_mm));
    }
    for (const Pose& T_robot_sensor : unknown.T_robot_sensor) {
      // random_poses() are about the object: 1.5 times 6.8 mm along each axis.
      const Pose T_object_sensor = pose * T_robot_sensor;
      EXPECT_LE(std::abs(T_object_sensor.translation_mm.x), 10.3);
      EXPECT_LE(std::abs(T_object_sensor.translation_mm.y), 10.3);
    }
  }
  EXPECT_GT(farthest_mm, 0.8 * extent_mm);
  ASSERT_EQ(names.size(), static_cast<std::size_t>(most_glyphs));
  EXPECT_TRUE(names.contains("A"));
  // Their areas are 0.64 and 1.44 times as large; parts of a large glyph lie beyond the touches.
  EXPECT_LT(by_size[1], 0.8 * by_size[0]) << "of 0.8 times the size";
  EXPECT_GT(by_size[2], 1.1 * by_size[0]) << "of 1.2 times the size";

  const std::vector<Recording> objects = glyph_recordings(of_a_size + 1);
  for (const Recording& object : objects) {
    EXPECT_EQ(object.size(), 192U);
    EXPECT_EQ(names.erase(object.object), 1U) << object.object;
  }
  EXPECT_LT(pressed(objects.back()), 0.8 * pressed(objects.front()))
      << "an A of 0.8 times the size";
}

}  // namespace palpate::bench::letters_test
