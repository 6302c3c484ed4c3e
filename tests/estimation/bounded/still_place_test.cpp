// An array that stays at its place: sums of penalties that only the elements in contact change.

#include "estimation/bounded/search/largest_tiles.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "bins_by_definition.hpp"
#include "bounded/certified.hpp"
#include "synthetic.hpp"

namespace palpate::resting_array_test {

using Seen = StillPlace::Seen;

constexpr int side = 20;  ///< elements along each side of the array

/// An array of 20 x 20 elements 1.1 mm apart about a place, all in No Contact.
ArrayReadings array_at(const glm::dvec2& middle_mm) {
  ArrayReadings array{.from_pivot_mm = grid_array(side, side, 1.1),
                      .readings{std::size_t{side} * side, Reading::no_contact}};
  for (glm::dvec2& at_mm : array.from_pivot_mm) {
    at_mm += middle_mm;
  }
  return array;
}

/// A press: some elements at any level of contact, some Unknown.
ArrayReadings pressed(ArrayReadings array, std::size_t levels, std::uint64_t seed) {
  Uniform random(seed);
  const double share = random(0.05, 0.3);
  for (Reading& reading : array.readings) {
    if (random(0.0, 1.0) < share) {
      const auto level = static_cast<std::size_t>(random(0.0, static_cast<double>(levels)));
      reading = level == 0 ? Reading::unknown : static_cast<Reading>(level);
    }
  }
  return array;
}

TEST(StillPlace, IsKeptFromTheSecondTouchOn) {
  StillPlace array;
  const ArrayReadings here = array_at({1.0, 2.0});
  const ArrayReadings there = array_at({1.0, 2.5});
  EXPECT_EQ(array.look(here), Seen::moving);
  EXPECT_EQ(array.look(here), Seen::stopped);
  EXPECT_EQ(array.look(here), Seen::stopped) << "nothing was kept";
  array.keep();
  EXPECT_EQ(array.look(here), Seen::still);
  EXPECT_EQ(array.look(there), Seen::moving);
  EXPECT_EQ(array.look(here), Seen::still) << "its sums are kept";
  EXPECT_EQ(array.look(there), Seen::moving);
  EXPECT_EQ(array.look(there), Seen::stopped);
  array.keep();
  EXPECT_EQ(array.look(here), Seen::moving);
  EXPECT_EQ(array.look({}), Seen::moving);
  EXPECT_EQ(array.look({}), Seen::moving);
}

TEST(StillPlace, MustBeMostlyInNoContact) {
  StillPlace array;
  ArrayReadings press = array_at({});
  array.look(press);
  std::fill_n(press.readings.begin(), side * side / 2, Reading::unknown);
  EXPECT_EQ(array.look(press), Seen::moving);
  press.readings[0] = Reading::no_contact;
  EXPECT_EQ(array.look(press), Seen::stopped);
}

TEST(StillPlace, MustNotSaturateSums) {
  StillPlace array;
  ArrayReadings large;
  large.from_pivot_mm.resize(40'000);
  large.readings.resize(40'000, Reading::no_contact);
  EXPECT_EQ(array.look(large), Seen::moving);
  EXPECT_EQ(array.look(large), Seen::moving);
}

/// The largest tiles over two maps, by a table of four levels or by Eq. 7.
class Sums {
 public:
  Sums(const PoseLattice& lattice, bool with_table)
      : hypotheses_{{random_map(31, 27, 0.5, 4.0, 601), 1.0},
                    {random_map(25, 40, 0.6, 4.0, 602), 1.0}} {
    options_.lattice = lattice;
    options_.contact.prior = 0.2;
    if (with_table) {
      options_.contact.table = crooked_table();
    }
    space_.emplace(hypotheses_, options_);
    tiles_.emplace(*space_);
  }

  LargestTiles* operator->() { return &*tiles_; }
  void add(const ArrayReadings& touch) { tiles_->add(std::span(&touch, 1)); }
  /// Whole sums, [hypothesis][theta, batch y, batch x, tile].
  std::vector<std::vector<std::int64_t>> all() const {
    std::vector<std::vector<std::int64_t>> all;
    for (std::size_t i = 0; i < hypotheses_.size(); ++i) {
      const TileLevel& level = space_->bounds[i].levels().front();
      const std::int32_t* const first = tiles_->sums(i, 0);
      all.emplace_back(first, first + space_->turns.size() * level.batches_x() * level.batches_y() *
                                          batch_tiles);
      for (std::int64_t& sum : all.back()) {
        sum += tiles_->unseen(i);
      }
    }
    return all;
  }

 private:
  std::vector<Hypothesis> hypotheses_;
  BoundedOptions options_;
  std::optional<SearchSpace> space_;
  std::optional<LargestTiles> tiles_;
};

void expect_fresh_sums(const PoseLattice& lattice, bool with_table) {
  const std::size_t levels = with_table ? crooked_table().levels() : 2;
  Sums kept(lattice, with_table);
  const std::vector<ArrayReadings> places{array_at({1.0, -2.0}), array_at({7.3, 0.4})};
  // Frames at the first place, some at the second in between: an array that moved, or a pivot.
  const std::vector<std::size_t> place_of{0, 0, 0, 0, 1, 0, 1, 1, 1, 0, 0, 0};
  int still = 0;
  for (std::size_t frame = 0; frame < place_of.size(); ++frame) {
    SCOPED_TRACE(testing::Message() << "frame " << frame);
    const ArrayReadings touch = pressed(places[place_of[frame]], levels, 610 + frame);
    Sums fresh(lattice, with_table);
    kept->reset();
    kept.add(touch);
    fresh.add(touch);
    ASSERT_EQ(kept.all(), fresh.all());
    still += kept->bytes() > fresh->bytes() ? 1 : 0;
  }
  EXPECT_EQ(still, 11) << "frames with sums of a still array";
}

PoseLattice sparse_lattice() {
  return {.x_mm = {-20.0, 20.0, 18}, .y_mm = {-17.0, 18.0, 14}, .theta_rad = {0.0, two_pi, 5}};
}

PoseLattice fine_lattice() {
  return {.x_mm = {-20.0, 20.0, 160}, .y_mm = {-3.0, 30.0, 131}, .theta_rad = {0.0, two_pi, 3}};
}

TEST(LargestTiles, AddAStillArrayBitForBit) {
  for (const bool with_table : {false, true}) {
    SCOPED_TRACE(with_table ? "table" : "Eq. 7");
    expect_fresh_sums(sparse_lattice(), with_table);
    expect_fresh_sums(fine_lattice(), with_table);
  }
}

TEST(LargestTiles, AddTouchesOfAStillArrayTogether) {
  for (const PoseLattice& lattice : {sparse_lattice(), fine_lattice()}) {
    Sums kept(lattice, true);
    const ArrayReadings place = array_at({-3.0, 1.5});
    kept.add(place);
    kept.add(place);
    kept->reset();
    Sums fresh(lattice, true);
    for (std::uint64_t frame = 0; frame < 3; ++frame) {
      const ArrayReadings touch = pressed(place, 4, 630 + frame);
      kept.add(touch);
      // An array of another order is another array.
      ArrayReadings reversed = touch;
      std::reverse(reversed.from_pivot_mm.begin(), reversed.from_pivot_mm.end());
      std::reverse(reversed.readings.begin(), reversed.readings.end());
      fresh.add(frame % 2 == 0 ? touch : reversed);
    }
    EXPECT_EQ(kept.all(), fresh.all());
  }
}

TEST(BoundedPosterior, IsCertifiedForEveryFrameOfAStillArray) {
  std::vector<Hypothesis> objects;
  for (std::uint64_t i = 0; i < 3; ++i) {
    objects.push_back({random_map(31, 27, 0.5, 2.0, 640 + i), 1.0});
    objects.back().map.label = i == 0 ? "A" : "B";
  }
  const ArrayReadings place = array_at({});
  BoundedOptions options{.lattice = sparse_lattice()};
  options.contact.prior = 0.2;
  options.evidence_nats = 0.05;
  BoundedPosterior posterior(objects, options);
  Uniform random(650);
  for (int frame = 0; frame < 6; ++frame) {
    SCOPED_TRACE(testing::Message() << "frame " << frame);
    std::vector<double> pressure(place.readings.size());
    for (double& kpa : pressure) {
      kpa = random(0.0, 1.0) < 0.2 ? random(0.5, 9.0) : 0.1;
    }
    const Touch touch{.T_robot_sensor = {{0.3, 0.2}, 0.1},
                      .elements_mm = place.from_pivot_mm,
                      .pressure = pressure};
    posterior.reset();
    posterior.update(touch);
    const Certified seen = expect_certified(
        posterior, objects, options, reference_posterior(objects, options, std::span(&touch, 1)));
    EXPECT_LE(seen.widest_nats, *options.evidence_nats);
  }
}

}  // namespace palpate::resting_array_test
