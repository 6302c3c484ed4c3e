#include "estimation/contact_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "support/synthetic.hpp"

namespace palpate::contact_evidence_test {

constexpr std::size_t segment_elements = 5;

TEST(GatherEvidence, KeepsEveryKnownElementOnceRelativeToThePivot) {
  const Recording recording = random_recording(7, 36, 31);
  const std::vector<Touch> touches = all_touches(recording);
  const glm::dvec2 pivot_mm{30.0, -20.0};
  const ContactEvidence evidence = gather_evidence(touches, {}, pivot_mm, segment_elements);

  std::size_t known = 0;
  for (const Touch& touch : touches) {
    for (const ElementReading& element : known_readings(touch, {})) {
      std::size_t found = 0;
      for (const shaders::Segment& segment : evidence.segments) {
        for (std::size_t k = segment.begin; k < segment.end; ++k) {
          if (evidence.from_pivot_mm[k] == element.position_mm - pivot_mm &&
              segment.reading == static_cast<shaders::uint>(element.reading)) {
            ++found;
          }
        }
      }
      EXPECT_EQ(found, 1U);
      ++known;
    }
  }
  EXPECT_EQ(evidence.from_pivot_mm.size(), known);
}

TEST(GatherEvidence, SegmentsFollowEachOtherAndAreNeitherEmptyNorTooLong) {
  const Recording recording = random_recording(7, 36, 32);
  const ContactEvidence evidence =
      gather_evidence(all_touches(recording), {}, {}, segment_elements);
  std::size_t end = 0;
  for (const shaders::Segment& segment : evidence.segments) {
    EXPECT_EQ(segment.begin, end);
    EXPECT_GT(segment.end, segment.begin);
    EXPECT_LE(segment.end - segment.begin, segment_elements);
    end = segment.end;
  }
  EXPECT_EQ(end, evidence.from_pivot_mm.size());
}

TEST(GatherEvidence, OfUnknownElementsIsEmpty) {
  Recording recording = random_recording(2, 36, 33);
  recording.pressure.assign(recording.pressure.size(), 0.0);
  const ContactEvidence evidence =
      gather_evidence(all_touches(recording), {}, {}, segment_elements);
  EXPECT_TRUE(evidence.from_pivot_mm.empty());
  EXPECT_TRUE(evidence.segments.empty());
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
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<double> places{
      0.0,   1e6,   5e8, 536870911.5, 536870912.0, 6e8,
      8.1e8, 1.1e9, 3e9, 1e15,        1e300,       std::numeric_limits<double>::infinity()};
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
