#include "estimation/known_elements.hpp"

#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "estimation/kernel_inputs.hpp"
#include "palpate/error.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate::known_elements_test {

TEST(Split, FarOutsideNeverMeetsAPlaceOfTheLattice) {
  // No map that a device holds is as wide.
  constexpr std::int64_t widest = (1 << 28) - 4;
  const std::vector<double> places{0.0,   1e6,   5e8, 536870911.5, 536870912.0, 6e8,
                                   8.1e8, 1.1e9, 3e9, 1e15,        1e300,       infinity};
  for (const double element : places) {
    for (const double axis : places) {
      for (const double sign : {1.0, -1.0}) {
        const std::int64_t sum =
            std::int64_t{split(element).cell} + split_axis(sign * axis).cell + 2;
        EXPECT_LT(std::abs(sum), std::int64_t{1} << 31) << element << " and " << sign * axis;
        if (std::max(element, axis) >= 0x1p29) {
          EXPECT_GE(std::abs(sum), widest) << element << " and " << sign * axis;
        } else {
          EXPECT_NEAR(static_cast<double>(sum), element + sign * axis, 3.0);
        }
      }
    }
    EXPECT_GE(std::abs(std::int64_t{split(nan).cell} + split_axis(element).cell), widest);
  }
}

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

}  // namespace palpate::known_elements_test
