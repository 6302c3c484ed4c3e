#include "estimation/known_elements.hpp"

#include <cmath>
#include <cstdint>
#include <set>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "estimation/kernel_inputs.hpp"
#include "palpate/error.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate::known_elements_test {

TEST(Gathered, CutsKnownElementsIntoRunsRelativeToThePivot) {
  constexpr std::size_t longest_run = 5;
  const Recording recording = random_recording(7, 36, 31);
  const glm::dvec2 pivot_mm{30.0, -20.0};
  const KnownElements known =
      gathered(evidence_of(all_touches(recording), {}), pivot_mm, longest_run);
  using Element = std::tuple<double, double, Reading>;
  std::multiset<Element> expected;
  for (const Touch& touch : all_touches(recording)) {
    for (const ElementReading& element : known_readings(touch, {})) {
      const glm::dvec2 from_pivot_mm = element.position_mm - pivot_mm;
      expected.emplace(from_pivot_mm.x, from_pivot_mm.y, element.reading);
    }
  }
  std::multiset<Element> gathered;
  std::size_t end = 0;
  for (const ReadingRun& run : known.runs) {
    EXPECT_EQ(run.begin, end) << "a gap";
    EXPECT_GT(run.end, run.begin);
    EXPECT_LE(run.end - run.begin, longest_run);
    end = run.end;
    for (std::size_t k = run.begin; k < run.end; ++k) {
      const glm::dvec2 from_pivot_mm = known.from_pivot_mm[k];
      gathered.emplace(from_pivot_mm.x, from_pivot_mm.y, run.reading);
    }
  }
  EXPECT_EQ(end, known.from_pivot_mm.size());
  EXPECT_EQ(gathered, expected);
}

TEST(Split, AddsUpToTheCoordinate) {
  for (const double at : {0.0, 0.25, -0.25, -1.0, 1234.5678, -98765.4321, 1e-20, -1e-20, 3e8}) {
    const shaders::Split parts = split(at);
    EXPECT_GE(parts.fraction, 0.0F);
    EXPECT_LE(parts.fraction, 1.0F);
    EXPECT_NEAR(parts.cell + static_cast<double>(parts.fraction), at, 6e-8)
        << "half the last digit of a float32 below 1";
  }
}

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

TEST(RotatedElements, AreAllElementsForEveryThetaInCells) {
  const std::vector<glm::dvec2> from_pivot_mm{{3.0, 4.0}, {-700.0, 250.0}};
  const Axis theta_rad{-1.0, 5.0, 3};
  constexpr double cell_mm = 0.5;
  const std::vector<shaders::RotatedElement> table =
      rotated_elements(from_pivot_mm, theta_rad, cell_mm);
  ASSERT_EQ(table.size(), 6U);
  for (int t = 0; t < 3; ++t) {
    for (std::size_t k = 0; k < 2; ++k) {
      const glm::dvec2 expected =
          reference::transform({{0.0, 0.0}, theta_rad.centre(t)}, from_pivot_mm[k]) / cell_mm;
      const auto& [x, y] = table[static_cast<std::size_t>(t) * 2 + k];
      EXPECT_NEAR(x.cell + static_cast<double>(x.fraction), expected.x, 6e-8) << "float32 below 1";
      EXPECT_NEAR(y.cell + static_cast<double>(y.fraction), expected.y, 6e-8) << "float32 below 1";
    }
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
