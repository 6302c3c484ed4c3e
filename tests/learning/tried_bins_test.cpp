#include "learning/tried_bins.hpp"

#include <string>

#include <gtest/gtest.h>

#include "palpate/error.hpp"
#include "simulated_presses.hpp"
#include "support/synthetic.hpp"

namespace palpate::tried_bins_test {

constexpr double spacing_mm = 1.9;
constexpr ContactClassifier classifier{.threshold = 2.0, .ratio = 0.3};

class TriedBins : public ::testing::Test {
 protected:
  TriedBins() { letters_.add("A", 20, 71); }

  PoseLattice affordable(const PoseLattice& lattice, double minutes) const {
    return affordable_lattice(lattice, letters_.presses, classifier,
                              {.maps = 2, .spacing_mm = spacing_mm, .minutes = minutes});
  }

  LetterPresses letters_;
};

PoseLattice square(double half_mm, int bins, int theta_bins) {
  return {.x_mm = {-half_mm, half_mm, bins},
          .y_mm = {-half_mm, half_mm, bins},
          .theta_rad = {0.0, two_pi, theta_bins}};
}

TEST_F(TriedBins, AreHalfAnElementWideAroundAllPlaces) {
  const PoseLattice lattice = fine_lattice(letters_.presses, spacing_mm);
  EXPECT_NEAR(lattice.x_mm.step(), spacing_mm / 2.0, 1e-9);
  EXPECT_NEAR(lattice.y_mm.step(), spacing_mm / 2.0, 1e-9);
  EXPECT_EQ(lattice.theta_rad.count, 72);
  for (const Press& press : letters_.presses) {
    const glm::dvec2 centre_mm = press.T_object_robot->translation_mm;
    EXPECT_GE(centre_mm.x - lattice.x_mm.lower, lattice.x_mm.step() - 1e-9);
    EXPECT_GE(lattice.x_mm.upper - centre_mm.x, lattice.x_mm.step() - 1e-9);
    EXPECT_GE(centre_mm.y - lattice.y_mm.lower, lattice.y_mm.step() - 1e-9);
    EXPECT_GE(lattice.y_mm.upper - centre_mm.y, lattice.y_mm.step() - 1e-9);
  }
  EXPECT_NO_THROW(require_within(letters_.presses, lattice));
  EXPECT_THROW(require_within(letters_.presses, square(1.0, 2, 4)), Error);
}

TEST_F(TriedBins, StayAsTheyAreWhereTimeSuffices) {
  const PoseLattice lattice = affordable(square(10.0, 25, 16), 1.0);
  EXPECT_EQ(lattice.x_mm.count, 25);
  EXPECT_EQ(lattice.y_mm.count, 25);
  EXPECT_EQ(lattice.theta_rad.count, 16);
}

TEST_F(TriedBins, AreWiderTheLessTimeThereIsDownToAnElement) {
  const PoseLattice wanted = square(10.0, 200, 360);
  const PoseLattice wide = affordable(wanted, 0.3);
  const PoseLattice wider = affordable(wanted, 0.1);
  EXPECT_LT(wide.bins(), wanted.bins());
  EXPECT_LT(wider.bins(), wide.bins());
  EXPECT_EQ(wide.x_mm.upper, 10.0) << "the region stays";
  // All axes by the same factor: a third of the bins in a third of the time, but for whole numbers.
  EXPECT_NEAR(static_cast<double>(wider.bins()) / static_cast<double>(wide.bins()), 1.0 / 3.0,
              0.03);
  const PoseLattice widest = affordable(wanted, 1e-9);
  EXPECT_EQ(widest.x_mm.count, 11) << "20 mm in steps of at most 1.9";
  EXPECT_EQ(widest.theta_rad.count, 36);
}

TEST_F(TriedBins, AreRefusedWhereEvenWideOnesAreTooMany) {
  const auto refusal = [&](const PoseLattice& lattice) {
    try {
      affordable(lattice, 1.0);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refusal(square(1e5, 2'000'000'000, 2'000'000'000)).find("20 touches"),
            std::string::npos);
  EXPECT_EQ(refusal(square(1e5, 10, 10)), "") << "few bins, however wide";
  const auto takes_too_long = [&](const PoseLattice& lattice, std::size_t maps) {
    try {
      affordable_lattice(lattice, letters_.presses, classifier,
                         {.maps = maps, .spacing_mm = spacing_mm, .minutes = 1.0});
    } catch (const Error&) {
      return true;
    }
    return false;
  };
  // At least 36 bins of 16 + 36 to 72 readings of 20 touches, four times for each map: 1e11
  // additions a minute.
  const double minutes_per_map = 36.0 * 4.0 * 20.0 * (16.0 + 36.0) / 1e11;
  EXPECT_TRUE(takes_too_long(square(0.5, 1, 360), static_cast<std::size_t>(40 / minutes_per_map)));
  EXPECT_FALSE(takes_too_long(square(0.5, 1, 360), static_cast<std::size_t>(5 / minutes_per_map)));
}

}  // namespace palpate::tried_bins_test
