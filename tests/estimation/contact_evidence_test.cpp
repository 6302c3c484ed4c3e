#include "estimation/contact_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate::contact_evidence_test {

TEST(GatherEvidence, CutsKnownElementsIntoSegmentsRelativeToThePivot) {
  constexpr std::size_t segment_elements = 5;
  const Recording recording = random_recording(7, 36, 31);
  const glm::dvec2 pivot_mm{30.0, -20.0};
  const ContactEvidence evidence =
      gather_evidence(all_touches(recording), {}, pivot_mm, segment_elements);
  using Element = std::tuple<double, double, shaders::uint>;
  std::multiset<Element> expected;
  for (const Touch& touch : all_touches(recording)) {
    for (const ElementReading& element : known_readings(touch, {})) {
      const glm::dvec2 from_pivot_mm = element.position_mm - pivot_mm;
      expected.emplace(from_pivot_mm.x, from_pivot_mm.y,
                       static_cast<shaders::uint>(element.reading));
    }
  }
  std::multiset<Element> gathered;
  std::size_t end = 0;
  for (const shaders::Segment& segment : evidence.segments) {
    EXPECT_EQ(segment.begin, end) << "a gap";
    EXPECT_GT(segment.end, segment.begin);
    EXPECT_LE(segment.end - segment.begin, segment_elements);
    end = segment.end;
    for (std::size_t k = segment.begin; k < segment.end; ++k) {
      const glm::dvec2 from_pivot_mm = evidence.from_pivot_mm[k];
      gathered.emplace(from_pivot_mm.x, from_pivot_mm.y, segment.reading);
    }
  }
  EXPECT_EQ(end, evidence.from_pivot_mm.size());
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

TEST(Split, FarOutsideStaysWithinHalfOfInt32) {
  for (const double at : {1e12, -1e12, 1e300, -1e300}) {
    EXPECT_LT(std::abs(static_cast<double>(split(at).cell)), 0x1p30);
    EXPECT_EQ(std::signbit(static_cast<double>(split(at).cell)), std::signbit(at));
  }
}

TEST(RotateEvidence, IsAllElementsForEveryThetaInCells) {
  const std::vector<glm::dvec2> from_pivot_mm{{3.0, 4.0}, {-700.0, 250.0}};
  const Axis theta_rad{-1.0, 5.0, 3};
  constexpr double cell_mm = 0.5;
  const std::vector<shaders::RotatedElement> table =
      rotate_evidence(from_pivot_mm, theta_rad, cell_mm);
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

}  // namespace palpate::contact_evidence_test
