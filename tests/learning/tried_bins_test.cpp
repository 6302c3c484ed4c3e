#include "learning/cross_validation.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "simulated_presses.hpp"
#include "support/errors.hpp"

namespace palpate::tried_bins_test {

constexpr double spacing_mm = 1.9;
constexpr ContactClassifier classifier{.threshold = 2.0, .ratio = 0.3};

class TriedBins : public testing::Test {
 protected:
  TriedBins() { letters_.add("A", 20, 71); }

  PoseLattice affordable(const PoseLattice& lattice, double minutes, std::size_t maps = 2) const {
    return affordable_lattice(lattice,
                              {.presses = letters_.presses,
                               .readings = {.classifier = classifier, .spacing_mm = spacing_mm},
                               .maps = {}},
                              maps, minutes);
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
  for (const auto& [axis, of] : {std::pair(&lattice.x_mm, 0), {&lattice.y_mm, 1}}) {
    EXPECT_NEAR(axis->step(), spacing_mm / 2.0, 1e-9);
    for (const Press& press : letters_.presses) {
      const double centre_mm = press.T_object_robot->translation_mm[of];
      EXPECT_GE(centre_mm - axis->lower, axis->step() - 1e-9);
      EXPECT_GE(axis->upper - centre_mm, axis->step() - 1e-9);
    }
  }
  EXPECT_EQ(lattice.theta_rad.count, 72);
  EXPECT_NO_THROW(require_within(letters_.presses, lattice));
  EXPECT_THROW(require_within(letters_.presses, square(1.0, 2, 4)), Error);
}

TEST_F(TriedBins, AreWiderTheLessTimeThereIsDownToAnElement) {
  const PoseLattice enough = affordable(square(10.0, 25, 16), 1.0);
  EXPECT_EQ(enough.x_mm.count, 25);
  EXPECT_EQ(enough.y_mm.count, 25);
  EXPECT_EQ(enough.theta_rad.count, 16);
  const PoseLattice wanted = square(10.0, 200, 360);
  const PoseLattice wide = affordable(wanted, 0.3);
  const PoseLattice wider = affordable(wanted, 0.1);
  EXPECT_LT(wide.bins(), wanted.bins());
  EXPECT_EQ(wide.x_mm.upper, 10.0) << "the region stays";
  // All axes by the same factor: a third of the bins in a third of the time, but for whole numbers.
  EXPECT_NEAR(static_cast<double>(wider.bins()) / static_cast<double>(wide.bins()), 1.0 / 3.0,
              0.03);
  const PoseLattice widest = affordable(wanted, 1e-9);
  EXPECT_EQ(widest.x_mm.count, 11) << "20 mm in steps of at most 1.9";
  EXPECT_EQ(widest.theta_rad.count, 36);
}

TEST_F(TriedBins, AreRefusedWhereEvenWideOnesAreTooMany) {
  expect_named(input_error([&] { affordable(square(1e5, 2'000'000'000, 2'000'000'000), 1.0); }),
               {"20 touches"});
  EXPECT_NO_THROW(affordable(square(1e5, 10, 10), 1.0)) << "few bins, however wide";
  // At least 36 bins of 16 + 36 to 72 readings of 20 touches, four times for each map: 1e11
  // additions a minute.
  const double minutes_per_map = 36.0 * 4.0 * 20.0 * (16.0 + 36.0) / 1e11;
  const auto on_maps = [&](double minutes) {
    affordable(square(0.5, 1, 360), 1.0, static_cast<std::size_t>(minutes / minutes_per_map));
  };
  EXPECT_THROW(on_maps(40.0), Error);
  EXPECT_NO_THROW(on_maps(5.0));
}

/// Where an element lies in the object frame.
glm::dvec2 place_of(const Press& press, std::size_t touch, std::size_t element) {
  const Touch& of = press.touches[touch];
  return *press.T_object_robot * (of.T_robot_sensor * of.elements_mm[element]);
}

void expect_same_places(const Press& press, const Press& moved) {
  ASSERT_EQ(press.touches.size(), moved.touches.size());
  for (std::size_t touch = 0; touch < press.touches.size(); ++touch) {
    for (const std::size_t element : {0U, 7U, 35U}) {
      const glm::dvec2 apart = place_of(press, touch, element) - place_of(moved, touch, element);
      EXPECT_NEAR(std::hypot(apart.x, apart.y), 0.0, 1e-10);
      EXPECT_EQ(press.touches[touch].pressure[element], moved.touches[touch].pressure[element]);
    }
  }
}

class DrawnPoses : public testing::Test {
 protected:
  DrawnPoses() { letters_.add("A", 3, 51); }

  LetterPresses letters_;
  RecognitionBins bins_{.lattice = {.x_mm = {-9.0, 11.0, 10},
                                    .y_mm = {2.0, 6.0, 8},
                                    .theta_rad = {1.0, 2.0, 4},
                                    .pivot_mm = {30.0, -40.0}},
                        .auto_pivot = false};
  Random random_{52, Stream::unknowns};
};

TEST_F(DrawnPoses, ReachAllOfTheRegionWithEveryElementInItsPlace) {
  const Press& press = letters_.presses[0];
  std::vector<int> seen(static_cast<std::size_t>(bins_.lattice.bins()));
  for (int i = 0; i < 6400; ++i) {
    const Press unknown = as_unknown(press, bins_, random_);
    expect_same_places(press, unknown);
    const glm::dvec2 pivot = *unknown.T_object_robot * bins_.lattice.pivot_mm;
    ASSERT_TRUE(pivot.x >= -9.0 - 1e-9 && pivot.x <= 11.0 + 1e-9) << pivot.x;
    ASSERT_TRUE(pivot.y >= 2.0 - 1e-9 && pivot.y <= 6.0 + 1e-9) << pivot.y;
    ++seen[static_cast<std::size_t>(bins_.lattice.bin_of(*unknown.T_object_robot))];
  }
  // 20 a bin in the mean: none has a chance of 2e-9 a bin to stay empty.
  EXPECT_GT(*std::ranges::min_element(seen), 0);
  bins_.lattice.theta_rad = {0.5, 0.5, 1};
  EXPECT_EQ(as_unknown(press, bins_, random_).T_object_robot->theta_rad, 0.5) << "a fixed angle";
}

TEST_F(DrawnPoses, AtAnAutomaticPivotKeepThePlaceWithinHalfABin) {
  const Press& press = letters_.presses[1];
  bins_.lattice.pivot_mm = {};
  bins_.auto_pivot = true;
  double farthest_mm = 0.0;
  for (int i = 0; i < 300; ++i) {
    const Press unknown = as_unknown(press, bins_, random_);
    expect_same_places(press, unknown);
    const glm::dvec2 apart =
        unknown.T_object_robot->translation_mm - press.T_object_robot->translation_mm;
    EXPECT_LE(std::abs(apart.x), 1.0);
    EXPECT_LE(std::abs(apart.y), 0.25);
    farthest_mm = std::max(farthest_mm, std::abs(apart.x));
    EXPECT_TRUE(unknown.T_object_robot->theta_rad >= 1.0 &&
                unknown.T_object_robot->theta_rad <= 2.0);
  }
  EXPECT_GT(farthest_mm, 0.9);
}

TEST_F(DrawnPoses, OfSeveralPressesTogetherKeepAllPlaces) {
  std::vector<const Press*> own;
  for (const Press& press : letters_.presses) {
    own.push_back(&press);
  }
  const Press moved = as_unknown(together(own), bins_, random_);
  ASSERT_EQ(moved.touches.size(), 3U);
  for (std::size_t i = 0; i < own.size(); ++i) {
    Press alone = moved;
    alone.touches = {moved.touches[i]};
    expect_same_places(*own[i], alone);
  }
}

}  // namespace palpate::tried_bins_test
