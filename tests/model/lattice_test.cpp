#include "palpate/lattice.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "reference/reference.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate::lattice_test {

// Float64 rounding of coordinates below 1e4 mm.
constexpr double rounding = 1e-11;

TEST(PoseLattice, OrderIsThetaThenYThenXWithXFastest) {
  const PoseLattice lattice{.x_mm = {0.0, 3.0, 3}, .y_mm = {0.0, 2.0, 2}, .theta_rad = {0, 4, 4}};
  EXPECT_EQ(lattice.plane(), 6);
  EXPECT_EQ(lattice.bins(), 24);
  std::int64_t bin = 0;
  for (int t = 0; t < 4; ++t) {
    for (int j = 0; j < 2; ++j) {
      for (int i = 0; i < 3; ++i, ++bin) {
        const Pose pose = lattice.T_object_robot(bin);
        EXPECT_EQ(pose.translation_mm, glm::dvec2(i + 0.5, j + 0.5));
        EXPECT_EQ(pose.theta_rad, t + 0.5);
      }
    }
  }
}

TEST(PoseLattice, PivotHasTheLatticesCoordinatesInTheObjectFrame) {
  const PoseLattice lattice{.x_mm = {-5.0, 5.0, 4},
                            .y_mm = {-3.0, 9.0, 3},
                            .theta_rad = {0.0, 6.0, 5},
                            .pivot_mm = {700.0, -400.0}};
  for (std::int64_t bin = 0; bin < lattice.bins(); ++bin) {
    const Pose pose = lattice.T_object_robot(bin);
    const glm::dvec2 at = pose * lattice.pivot_mm;
    EXPECT_NEAR(at.x, lattice.x_mm.centre(static_cast<int>(bin % 4)), rounding);
    EXPECT_NEAR(at.y, lattice.y_mm.centre(static_cast<int>(bin / 4 % 3)), rounding);
    const Pose expected = reference::bin_pose(lattice, bin);
    EXPECT_NEAR(pose.translation_mm.x, expected.translation_mm.x, rounding);
    EXPECT_NEAR(pose.translation_mm.y, expected.translation_mm.y, rounding);
    EXPECT_NEAR(pose.theta_rad, expected.theta_rad, rounding);
  }
}

TEST(PoseLattice, BinsOfAllDimensionsMayExceed32Bits) {
  const PoseLattice lattice{
      .x_mm = {0.0, 1.0, 100000}, .y_mm = {0.0, 1.0, 100000}, .theta_rad = {0.0, 1.0, 10}};
  EXPECT_EQ(lattice.bins(), 100000000000);
  EXPECT_NEAR(lattice.T_object_robot(lattice.bins() - 1).theta_rad, 0.95, rounding);
}

TEST(PoseLattice, ADimensionOfZeroExtentCostsOneBin) {
  PoseLattice lattice{.x_mm = {3.0, 3.0, 25}, .y_mm = {-1.0, 1.0, 25}, .theta_rad = {0.5, 0.5, 16}};
  lattice.collapse_fixed();
  EXPECT_EQ(lattice.x_mm.count, 1);
  EXPECT_EQ(lattice.y_mm.count, 25);
  EXPECT_EQ(lattice.theta_rad.count, 1);
  EXPECT_EQ(lattice.T_object_robot(0).translation_mm.x, 3.0);
  EXPECT_EQ(lattice.T_object_robot(0).theta_rad, 0.5);
}

void expect_refused(const PoseLattice& lattice, const char* field) {
  expect_named(input_error([&] { lattice.validate(); }), {field});
}

TEST(PoseLattice, RefusesWhatIsNoLattice) {
  PoseLattice().validate();
  PoseLattice{.x_mm = {-1e9, 1e9, 5}, .theta_rad = {1e9 - 1.0, 1e9, 5}, .pivot_mm = {1e9, -1e9}}
      .validate();
  expect_refused({.x_mm = {-1.0, 1.0, 0}}, "x_mm");
  expect_refused({.y_mm = {-1.0, 1.0, -3}}, "y_mm");
  expect_refused({.theta_rad = {1.0, 0.0, 4}}, "theta_rad");
  // Float64 keeps no digits beyond 1e9.
  for (const double far : {1.1e9, 1e300, infinity, nan}) {
    expect_refused({.x_mm = {-far, 1.0, 4}}, "x_mm");
    expect_refused({.y_mm = {0.0, far, 4}}, "y_mm");
    expect_refused({.theta_rad = {0.0, far, 4}}, "theta_rad");
    expect_refused({.pivot_mm = {far, 0.0}}, "pivot_mm");
    expect_refused({.pivot_mm = {0.0, -far}}, "pivot_mm");
  }
}

TEST(PoseLattice, RefusesAnglesThatWouldCountTwice) {
  for (const double lower : {0.0, -1.0, 1e4, -1e9}) {
    const auto with_angles = [lower](double width) {
      return PoseLattice{.theta_rad = {lower, lower + width, 4}};
    };
    with_angles(two_pi).validate();
    EXPECT_TRUE(with_angles(two_pi).full_circle()) << lower;
    expect_refused(with_angles(two_pi + 1e-6 + 1e-15 * std::abs(lower)), "theta_rad");
    expect_refused(with_angles(2.0 * two_pi), "at most 2 pi");
    with_angles(6.0).validate();
    EXPECT_FALSE(with_angles(6.0).full_circle()) << lower;
  }
}

TEST(PoseLattice, BinOfAPoseIsTheBinThatHoldsIt) {
  const PoseLattice full{.x_mm = {-5.0, 5.0, 4},
                         .y_mm = {-3.0, 9.0, 3},
                         .theta_rad = {-1.0, -1.0 + two_pi, 5},
                         .pivot_mm = {700.0, -400.0}};
  PoseLattice part = full;
  part.theta_rad = {6.0, 8.0, 5};
  PoseLattice fixed = full;
  fixed.x_mm = {1.0, 1.0, 1};
  for (const PoseLattice& lattice : {full, part, fixed}) {
    const double step_rad = lattice.theta_rad.step();
    for (std::int64_t bin = 0; bin < lattice.bins(); ++bin) {
      const Pose centre = lattice.T_object_robot(bin);
      const glm::dvec2 at = centre * lattice.pivot_mm;
      for (const double share : {-0.49, 0.0, 0.49}) {
        Pose pose = lattice.T_object_robot(at.x + share * lattice.x_mm.step(),
                                           at.y - share * lattice.y_mm.step(),
                                           centre.theta_rad + share * step_rad);
        for (const double turns : {0.0, -1.0, 2.0}) {
          pose.theta_rad += turns * two_pi;
          EXPECT_EQ(lattice.bin_of(pose), bin) << share << " of a step, " << turns << " turns on";
        }
      }
    }
  }
}

TEST(PoseLattice, BinOfAPoseOutsideIsTheNearest) {
  const PoseLattice lattice{.x_mm = {-5.0, 5.0, 4}, .y_mm = {-3.0, 9.0, 3}, .theta_rad = {0, 2, 5}};
  const auto bin_of = [&](double x, double y, double theta) {
    return lattice.bin_of(lattice.T_object_robot(x, y, theta));
  };
  EXPECT_EQ(bin_of(-1e12, 0.0, 1.0), 2 * 12 + 0 * 4 + 0);
  EXPECT_EQ(bin_of(5.0, 1e12, 1.0), 2 * 12 + 2 * 4 + 3);
  EXPECT_EQ(bin_of(0.1, 0.0, 2.5), 4 * 12 + 0 * 4 + 2);
  EXPECT_EQ(bin_of(0.1, 0.0, -0.5), 0 * 12 + 0 * 4 + 2);
  EXPECT_THROW(bin_of(infinity, 0.0, 0.0), Error);
  EXPECT_THROW(bin_of(0.0, 0.0, nan), Error);
}

}  // namespace palpate::lattice_test
