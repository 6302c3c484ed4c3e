// What an update that throws leaves behind, what is left of an object that was moved from, and a
// filter whose pivot moves before the first touch. That no touch is taken in where one is refused
// is a law of filter_laws_test.cpp.

#include <functional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "beliefs.hpp"
#include "palpate/bounded_posterior.hpp"
#include "palpate/map_builder.hpp"
#include "support/certified.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"

namespace palpate::all_or_nothing_test {

using Calls = std::vector<std::function<void()>>;

void expect_refused(const Calls& calls, const char* says) {
  for (std::size_t i = 0; i < calls.size(); ++i) {
    SCOPED_TRACE(i);
    expect_named(input_error(calls[i]), {says});
  }
}

/// An update of more bins and elements than a CPU takes in one part, so that it reports progress.
TEST(BrokenOffUpdate, LeavesABeliefThatSaysSo) {
  Device device = lowered_device([](gpu::Limits& limits) { limits.cpu = true; });
  const Recording recording = random_recording(60, 100, 174);
  PoseHistogram histogram(
      device, two_objects(12.0, 171),
      {.lattice = {.x_mm = {-3, 3, 60}, .y_mm = {-3, 3, 60}, .theta_rad = {0, 3, 60}}});
  double most = 0.0;
  EXPECT_THROW(histogram.update(all_touches(recording),
                                [&](double fraction) {
                                  most = fraction;
                                  throw std::runtime_error("broken off");
                                }),
               std::runtime_error);
  EXPECT_GT(most, 0.0);
  EXPECT_LT(most, 0.9) << "not in the middle";
  expect_refused({[&] { histogram.estimate(); }, [&] { histogram.refine({}); },
                  [&] { histogram.marginals(0); }, [&] { histogram.log_likelihood(0); },
                  [&] { histogram.update(recording.touch(0)); }},
                 "reset()");
  EXPECT_GT(histogram.device_bytes(), 0U);
  histogram.reset();
  EXPECT_EQ(histogram.estimate().mode.log_likelihood, 0.0);
}

// Asked on purpose, each of them. NOLINTBEGIN(bugprone-use-after-move)
TEST(MovedFrom, FiltersMapBuildersAndDevicesSaySo) {
  const Recording recording = random_recording(2, 36, 178);
  const Touch touch = recording.touch(0);
  const std::vector<Hypothesis> objects = three_objects();

  PoseHistogram histogram(shared_device(), objects, {.lattice = small_lattice()});
  histogram.update(touch);
  const auto told = all_answers(histogram);
  PoseHistogram second(std::move(histogram));
  expect_refused(
      {[&] { histogram.reset(); }, [&] { histogram.update(touch); }, [&] { histogram.estimate(); },
       [&] { histogram.refine({}); }, [&] { histogram.marginals(0); },
       [&] { histogram.log_likelihood(0); }, [&] { histogram.lattice(); },
       [&] { histogram.paths(); }, [&] { histogram.device_bytes(); }},
      "histogram: was moved from");
  histogram = std::move(second);
  EXPECT_EQ(all_answers(histogram), told);

  ParticleFilter filter(shared_device(), objects, {.particles = 10});
  const ParticleFilter other(std::move(filter));
  expect_refused({[&] { filter.reset(); }, [&] { filter.update(touch); },
                  [&] { filter.estimate(); }, [&] { filter.effective_sample_size(); },
                  [&] { filter.particles(); }, [&] { filter.device_bytes(); }},
                 "particle filter: was moved from");
  EXPECT_EQ(other.particles().size(), 10U);

  MapBuilder builder(shared_device(), {});
  const MapBuilder another(std::move(builder));
  expect_refused({[&] { builder.add(all_touches(recording)); }, [&] { builder.build("made up"); },
                  [&] { builder.clear(); }},
                 "map builder: was moved from");

  Device gone = Device::open();
  const Device elsewhere(std::move(gone));
  expect_refused({[&] { MapBuilder(gone, {}); }, [&] { PoseHistogram(gone, objects, {}); },
                  [&] { ParticleFilter(gone, objects, {}); }},
                 "device: was moved from");
}
// NOLINTEND(bugprone-use-after-move)

PoseLattice lattice_about(const glm::dvec2& pivot_mm) {
  PoseLattice lattice = small_lattice();
  lattice.pivot_mm = pivot_mm;
  return lattice;
}

PoseHistogram make(PoseHistogram*, const glm::dvec2& pivot_mm) {
  return {shared_device(), three_objects(), {.lattice = lattice_about(pivot_mm)}};
}
ParticleFilter make(ParticleFilter*, const glm::dvec2& pivot_mm) {
  return {shared_device(), three_objects(), {.particles = 500, .region = lattice_about(pivot_mm)}};
}
BoundedPosterior make(BoundedPosterior*, const glm::dvec2& pivot_mm) {
  return {three_objects(), {.lattice = lattice_about(pivot_mm), .none_weight = 0.5}};
}
auto all_answers(const BoundedPosterior& posterior) { return palpate::all_answers(posterior, 3); }

template <class Filter>
class MovedPivot : public testing::Test {};
using Filters = testing::Types<PoseHistogram, ParticleFilter, BoundedPosterior>;
TYPED_TEST_SUITE(MovedPivot, Filters);

TYPED_TEST(MovedPivot, MakesAFilterWhatItIsWithThePivotFromTheStart) {
  constexpr TypeParam* kind = nullptr;
  const glm::dvec2 pivot_mm{400.0, 200.0};
  const Recording recording = moved(random_recording(3, 36, 183), {pivot_mm, 0.0});
  const std::vector<Touch> touches = all_touches(recording);
  TypeParam filter = make(kind, {0.0, 0.0});
  filter.update(touches);  // about another pivot, which nothing may be left of
  const auto before = all_answers(filter);
  expect_named(input_error([&] { filter.move_pivot(pivot_mm); }), {"reset()"});
  EXPECT_EQ(all_answers(filter), before) << "stays where there are touches about it";
  filter.reset();
  for (const double far : {nan, 2.0 * farthest_mm}) {
    expect_named(input_error([&] { filter.move_pivot({far, 0.0}); }), {"pivot_mm"});
  }
  filter.update(touches);
  EXPECT_EQ(all_answers(filter), before) << "over a reset and where it is refused";
  filter.reset();
  filter.estimate();
  filter.move_pivot(pivot_mm);
  TypeParam built = make(kind, pivot_mm);
  for (int round = 0; round < 2; ++round) {
    EXPECT_EQ(all_answers(filter), all_answers(built)) << "before a touch";
    filter.update(touches);
    built.update(touches);
    EXPECT_EQ(all_answers(filter), all_answers(built)) << "also over a reset: " << round;
    filter.reset();
    built.reset();
  }
}

}  // namespace palpate::all_or_nothing_test
