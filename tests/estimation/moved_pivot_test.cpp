// A filter whose pivot moves before the first touch.

#include <gtest/gtest.h>

#include "beliefs.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"

namespace palpate::moved_pivot_test {

PoseLattice lattice_about(const glm::dvec2& pivot_mm) {
  PoseLattice lattice = small_lattice();
  lattice.pivot_mm = pivot_mm;
  return lattice;
}

PoseHistogram make(PoseHistogram*, Device& device, const glm::dvec2& pivot_mm) {
  return {device, three_objects(), {.lattice = lattice_about(pivot_mm)}};
}
ParticleFilter make(ParticleFilter*, Device& device, const glm::dvec2& pivot_mm) {
  return {device, three_objects(), {.particles = 500, .region = lattice_about(pivot_mm)}};
}

template <class Filter>
class MovedPivot : public testing::Test {};
using Filters = testing::Types<PoseHistogram, ParticleFilter>;
TYPED_TEST_SUITE(MovedPivot, Filters);

TYPED_TEST(MovedPivot, MakesAFilterWhatItIsWithThePivotFromTheStart) {
  constexpr TypeParam* kind = nullptr;
  const glm::dvec2 pivot_mm{400.0, 200.0};
  const Recording recording = moved(random_recording(3, 36, 183), {pivot_mm, 0.0});
  const std::vector<Touch> touches = all_touches(recording);
  Device device = Device::open();
  TypeParam filter = make(kind, device, {0.0, 0.0});
  filter.update(touches);  // about another pivot, which nothing may be left of
  const auto before = told_by(filter);
  expect_named(input_error([&] { filter.move_pivot(pivot_mm); }), {"reset()"});
  EXPECT_EQ(told_by(filter), before) << "stays where there are touches about it";
  filter.reset();
  for (const double far : {nan, 2.0 * farthest_mm}) {
    expect_named(input_error([&] { filter.move_pivot({far, 0.0}); }), {"pivot_mm"});
  }
  filter.update(touches);
  EXPECT_EQ(told_by(filter), before) << "over a reset and where it is refused";
  filter.reset();
  filter.move_pivot(pivot_mm);
  TypeParam built = make(kind, device, pivot_mm);
  for (int round = 0; round < 2; ++round) {
    filter.update(touches);
    built.update(touches);
    EXPECT_EQ(told_by(filter), told_by(built)) << "also over a reset: " << round;
    filter.reset();
    built.reset();
  }
}

TEST(MovedLattice, IsThatOfAHistogramAndOfItsMarginals) {
  const glm::dvec2 pivot_mm{400.0, 200.0};
  Device device = Device::open();
  PoseHistogram histogram(device, three_objects(), {.lattice = small_lattice()});
  histogram.move_pivot(pivot_mm);
  EXPECT_EQ(histogram.lattice().pivot_mm, pivot_mm);
  EXPECT_EQ(histogram.marginals(1).grid.pivot_mm, pivot_mm);
}

}  // namespace palpate::moved_pivot_test
