// "None of these" from a sample of the bins, against its definition over all of them.

#include "sampled_touch_mean.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "bins_by_definition.hpp"
#include "hypotheses.hpp"
#include "synthetic.hpp"

namespace palpate {
namespace {

/// Rounding of float64 sums over some thousand bins of some hundred nats.
constexpr double rounding = 1e-9;

std::vector<Hypothesis> two_objects() {
  return {{random_map(31, 27, 0.5, 4.0, 701), 2.0}, {random_map(23, 29, 0.5, 4.0, 702), 1.0}};
}

/// An array of 8 elements, a third of them Unknown, on touches that meet the objects.
Recording small_array(std::size_t touches, std::uint64_t seed) {
  return random_recording(touches, 8, seed);
}

class SampledNone {
 public:
  SampledNone(std::vector<Hypothesis> hypotheses, const PoseLattice& in)
      : objects(std::move(hypotheses)),
        lattice(in),
        contact(resolve({}, objects)),
        likelihood(objects, contact, lattice),
        bounds(bounds_of(objects, contact, lattice)),
        means(objects, lattice, log_weights(objects), likelihood, bounds) {}

  std::vector<TouchMean> evaluate(std::span<const Touch> touches) const {
    std::vector<ArrayReadings> arrays;
    for (const Touch& touch : touches) {
      arrays.push_back(array_readings(touch, contact, lattice.pivot_mm));
    }
    return means.evaluate(arrays);
  }
  void update(const Touch& touch) { means.add(evaluate(std::span(&touch, 1))); }

  /// Its definition, by all bins.
  double expected(std::span<const Touch> touches) const {
    std::vector<std::vector<std::vector<double>>> logs;
    for (const Touch& touch : touches) {
      logs.emplace_back();
      for (std::size_t object = 0; object < objects.size(); ++object) {
        logs.back().push_back(reference::log_likelihoods(std::span(&touch, 1), lattice,
                                                         objects[object].map, contact, object));
      }
    }
    return reference::none_log_evidence(touches, lattice, objects, logs);
  }

  std::vector<Hypothesis> objects;
  PoseLattice lattice;
  ContactModel contact;
  BinLikelihood likelihood;
  std::vector<TileBounds> bounds;
  SampledTouchMeans means;

 private:
  static std::vector<TileBounds> bounds_of(std::span<const Hypothesis> objects,
                                           const ContactModel& contact,
                                           const PoseLattice& lattice) {
    std::vector<TileBounds> bounds;
    for (std::size_t i = 0; i < objects.size(); ++i) {
      bounds.emplace_back(objects[i].map, contact, i, lattice,
                          tile_sizes(lattice, 0.5, objects.size()));
    }
    return bounds;
  }
};

PoseLattice small_lattice() {
  return {.x_mm = {-15.0, 16.0, 21},
          .y_mm = {-14.0, 15.0, 19},
          .theta_rad = {0, two_pi, 8},
          .pivot_mm = {3.0, -2.0}};
}

/// Of so many bins that a touch's mean takes a sample.
PoseLattice large_lattice() {
  PoseLattice lattice = small_lattice();
  lattice.x_mm.count = 120;
  lattice.y_mm.count = 110;
  lattice.theta_rad.count = 30;
  return lattice;
}

TEST(SampledTouchMean, TakesAllBinsWhereTheyAreFew) {
  SampledNone none(two_objects(), small_lattice());
  EXPECT_EQ(none.means.log_evidence(), 0.0);
  const Recording recording = small_array(5, 703);
  const std::vector<Touch> touches = all_touches(recording);
  for (std::size_t n = 1; n <= touches.size(); ++n) {
    none.update(touches[n - 1]);
    EXPECT_NEAR(none.means.log_evidence(), none.expected(std::span(touches).first(n)), rounding);
    EXPECT_EQ(none.means.standard_error(), 0.0);
  }
  const double share = std::exp(none.evaluate(std::span(touches).first(1)).front().log_share);
  EXPECT_GT(share, 0.1) << "the array meets no object";
  EXPECT_LT(share, 0.9) << "all bins count anyway";
  none.means.reset();
  EXPECT_EQ(none.means.log_evidence(), 0.0);
  EXPECT_EQ(none.means.standard_error(), 0.0);
}

TEST(SampledTouchMean, ErrsAsMuchAsItSays) {
  SampledNone none(two_objects(), large_lattice());
  const Recording recording = small_array(2, 704);
  double squares = 0.0;
  double sum = 0.0;
  double most = 0.0;
  constexpr int draws = 50;
  for (const Touch& touch : all_touches(recording)) {
    const double expected = none.expected(std::span(&touch, 1));
    none.means.reset();
    for (int i = 0; i < draws; ++i) {
      // The same touch once more draws other bins.
      const TouchMean mean = none.evaluate(std::span(&touch, 1)).front();
      EXPECT_GT(mean.squared_error, 0.0);
      EXPECT_LT(mean.squared_error, 4e-4);
      const double z = (mean.log_share + mean.log_mean - expected) / std::sqrt(mean.squared_error);
      squares += z * z;
      sum += z;
      most = std::max(most, std::abs(z));
      none.update(touch);
    }
    const double all = draws * (expected - none.evaluate(std::span(&touch, 1))[0].log_share) +
                       none.evaluate(std::span(&touch, 1))[0].log_share;
    EXPECT_LT(std::abs(none.means.log_evidence() - all), 4.0 * none.means.standard_error())
        << "errors of one touch do not repeat";
  }
  constexpr double n = 2 * draws;
  // Of 100 normal z-scores: deviation 0.07 of the root mean square, 0.1 of the mean.
  EXPECT_NEAR(std::sqrt(squares / n), 1.0, 0.25);
  EXPECT_NEAR(sum / n, 0.0, 0.35);
  EXPECT_LT(most, 4.5);
}

TEST(SampledTouchMean, HearsALightObjectThatAloneExplainsTheTouch) {
  // Only the light object is full; a press of 12 elements is worth 0.08^-12 of likelihood there.
  std::vector<Hypothesis> objects = two_objects();
  for (float& l : objects[0].map.log_odds) {
    l = -8.0F;
  }
  objects[0].map.log_odds[0] = 0.1F;  // so that its box holds the whole map
  objects[0].map.log_odds.back() = 0.1F;
  for (float& l : objects[1].map.log_odds) {
    l = 8.0F;
  }
  objects[1].weight = 1e-6;
  SampledNone none(objects, large_lattice());
  Recording recording = random_recording(1, 12, 705);
  for (std::size_t i = 0; i < 12; ++i) {
    recording.elements_mm[i] *= 0.2;
    recording.pressure[i] = 10.0;
  }
  const std::vector<Touch> touches = all_touches(recording);
  none.update(touches[0]);
  const double error = none.means.standard_error();
  EXPECT_GT(error, 0.0);
  EXPECT_LT(error, 0.02) << "drawn by weight, two bins would speak for the light object";
  EXPECT_NEAR(none.means.log_evidence(), none.expected(touches), 4.0 * error);
}

TEST(SampledTouchMean, CountsAllBinsWhereTheArrayMeetsNoObject) {
  for (const PoseLattice& lattice : {small_lattice(), large_lattice()}) {
    SampledNone none(two_objects(), lattice);
    Recording recording = small_array(2, 706);
    const Pose near = recording.T_robot_sensor[0];
    for (Pose& pose : recording.T_robot_sensor) {
      pose.translation_mm += glm::dvec2(200.0, 0.0);
    }
    none.update(recording.touch(0));
    // Every bin sees nothing but the prior, and s is 1.
    const double expected = none.expected(std::vector{recording.touch(0)});
    EXPECT_NEAR(none.means.log_evidence(), expected, rounding);
    EXPECT_LT(none.means.standard_error(), 1e-12);
    // The share counts once, at the first touch.
    recording.T_robot_sensor[1] = near;
    none.update(recording.touch(1));
    EXPECT_NEAR(none.means.log_evidence(), none.expected(all_touches(recording)),
                rounding + 4.5 * none.means.standard_error());
  }
}

TEST(SampledTouchMean, IsDeafToATouchWithoutAKnownElement) {
  SampledNone none(two_objects(), small_lattice());
  const Recording recording = small_array(2, 707);
  const std::vector<std::uint8_t> dead(8, 0);
  Touch silent = recording.touch(1);
  silent.valid = dead;
  none.update(silent);
  EXPECT_EQ(none.means.log_evidence(), 0.0);
  none.update(recording.touch(0));
  none.update(silent);
  SampledNone other(two_objects(), small_lattice());
  other.update(recording.touch(0));
  EXPECT_EQ(none.means.log_evidence(), other.means.log_evidence());
}

TEST(SampledTouchMean, OfOneBin) {
  for (const double x : {0.0, 30.0}) {
    const PoseLattice bin{.x_mm = {x, x, 1}, .y_mm = {0.5, 0.5, 1}, .theta_rad = {0.4, 0.4, 1}};
    SampledNone none(two_objects(), bin);
    const Recording recording = small_array(3, 708);
    for (const Touch& touch : all_touches(recording)) {
      none.update(touch);
    }
    EXPECT_NEAR(none.means.log_evidence(), none.expected(all_touches(recording)), rounding);
  }
}

TEST(SampledTouchMean, DoesNotDependOnTheOrderButForTheFirstShare) {
  const Recording recording = small_array(4, 709);
  std::vector<Touch> touches = all_touches(recording);
  touches.push_back(touches[1]);  // one comes twice
  SampledNone forth(two_objects(), large_lattice());
  for (const Touch& touch : touches) {
    forth.update(touch);
  }
  SampledNone back(two_objects(), large_lattice());
  std::vector<Touch> reversed(touches.rbegin(), touches.rend());
  std::swap(reversed.back(), reversed.front());  // the first stays the first
  back.means.add(back.evaluate(reversed));
  EXPECT_EQ(forth.means.log_evidence(), back.means.log_evidence());
  EXPECT_EQ(forth.means.standard_error(), back.means.standard_error());
  EXPECT_GT(forth.means.standard_error(), 0.0);
  const auto share = [&](const Touch& touch) {
    return forth.evaluate(std::span(&touch, 1)).front().log_share;
  };
  back.means.reset();
  back.means.add(back.evaluate(std::vector<Touch>(touches.rbegin(), touches.rend())));
  EXPECT_NEAR(forth.means.log_evidence() - share(touches.front()),
              back.means.log_evidence() - share(touches.back()), rounding);
}

TEST(SampledTouchMean, HasTheSameBitsOnAnyNumberOfThreads) {
  // More threads than the machine may have cores.
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 4);
  const Recording recording = small_array(2, 710);
  std::vector<std::vector<double>> told;
  for (const int threads : {1, 2, 4}) {
    SampledNone none(two_objects(), large_lattice());
    tbb::task_arena(threads).execute(
        [&] { none.means.add(none.evaluate(all_touches(recording))); });
    told.push_back({none.means.log_evidence(), none.means.standard_error()});
  }
  EXPECT_EQ(told[0], told[1]);
  EXPECT_EQ(told[0], told[2]);
}

TEST(SampledTouchMean, OfAHundredMillionBins) {
  // Bins of 0.03 mm in cells of 0.5 mm: the mean is an integral, and a lattice of a thousandth as
  // many bins has nearly the same.
  PoseLattice fine = small_lattice();
  fine.x_mm.count = 1000;
  fine.y_mm.count = 1000;
  fine.theta_rad.count = 100;
  const Recording recording = small_array(3, 711);
  SampledNone none(two_objects(), fine);
  SampledNone coarse(two_objects(), large_lattice());
  for (const Touch& touch : all_touches(recording)) {
    none.update(touch);
    coarse.update(touch);
    EXPECT_LT(none.means.standard_error(), 0.04);
    EXPECT_NEAR(none.means.log_evidence(), coarse.means.log_evidence(),
                4.0 * std::hypot(none.means.standard_error(), coarse.means.standard_error()) +
                    0.02);  // 1 bin in 110 of the overlap's borders
  }
}

}  // namespace
}  // namespace palpate
