// Tiles in which every element sees the prior: none may be taken for one, and their bins have the
// likelihood of the prior.

#include "estimation/bounded/search/item_bounds.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "bound_cases.hpp"
#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "support/limits.hpp"
#include "support/trials.hpp"

namespace palpate::seen_tiles_test {

/// Log-likelihood of the elements where all see the prior.
double prior_log_likelihood(const BinCase& of, std::size_t object) {
  double sum = 0.0;
  for (const ReadingRun& run : of.elements.runs) {
    sum += static_cast<double>(run.end - run.begin) *
           of.contact.log_likelihood(run.reading, {log_odds_from_probability(*of.contact.prior)},
                                     object);
  }
  return sum;
}

/// Whether an element may see something else than the prior at a bin: the map fades to the prior
/// within a cell.
bool sees(const BinCase& of, const glm::dvec2& turn, const glm::dvec2& at_mm) {
  const OccupancyGrid& map = of.map;
  return std::any_of(
      of.elements.from_pivot_mm.begin(), of.elements.from_pivot_mm.end(), [&](const glm::dvec2& p) {
        const glm::dvec2 place =
            (glm::dvec2(turn.x * p.x - turn.y * p.y, turn.y * p.x + turn.x * p.y) + at_mm -
             map.origin_mm) /
            map.cell_mm;
        return place.x > -1.0 && place.x < map.nx && place.y > -1.0 && place.y < map.ny;
      });
}

/// A random case of which a larger part is off the map.
BinCase random_far_case(Uniform& random) {
  BinCase of = random_bound_case(random);
  for (Axis* axis : {&of.lattice.x_mm, &of.lattice.y_mm}) {
    const double shift = of.map.cell_mm * random(-60.0, 60.0);
    axis->lower += shift;
    axis->upper += shift;
  }
  return of;
}

BoundingBox reach_of(const KnownElements& elements, const glm::dvec2& turn) {
  return undisplaced_reaches(elements, std::span(&turn, 1)).front();
}

/// The tile of an axis that a bin lies in.
int tile_of(const TileAxis& axis, int bin) {
  return static_cast<int>(std::upper_bound(axis.first_bin.begin(), axis.first_bin.end() - 1, bin) -
                          axis.first_bin.begin() - 1);
}

TEST(SeenTiles, LeavesOutNoTileInWhichAnElementSeesTheMap) {
  Uniform random(501);
  std::int64_t seen_bins = 0;
  std::int64_t left_out = 0;
  for (int trial = 0; trial < trials(400) && !HasFailure(); ++trial) {
    SCOPED_TRACE(fmt::format("trial {}", trial));
    const BinCase of = random_far_case(random);
    for (const TileLevel& level :
         tile_levels(of.lattice, of.map.cell_mm, tile_sizes(of.lattice, of.map.cell_mm, 1))) {
      for (int theta = 0; theta < of.lattice.theta_rad.count; ++theta) {
        const glm::dvec2 turn = turn_of(of.lattice, theta);
        const TileRange seen = seen_tiles(reach_of(of.elements, turn), of.map, level);
        for (const auto& [first, end, tiles] :
             {std::tuple(seen.x_first, seen.x_end, level.x.tiles()),
              std::tuple(seen.y_first, seen.y_end, level.y.tiles())}) {
          ASSERT_TRUE(0 <= first && first <= end && end <= tiles) << first << ":" << end;
        }
        for (int k = 0; k < 40; ++k) {
          const auto x = static_cast<int>(random(0.0, of.lattice.x_mm.count));
          const auto y = static_cast<int>(random(0.0, of.lattice.y_mm.count));
          const bool held = seen.holds({.x = tile_of(level.x, x), .y = tile_of(level.y, y)});
          if (sees(of, turn, {of.lattice.x_mm.centre(x), of.lattice.y_mm.centre(y)})) {
            ASSERT_TRUE(held) << "bin " << x << ", " << y << " at theta " << theta;
            ++seen_bins;
          }
          left_out += held ? 0 : 1;
        }
      }
    }
  }
  // The law says something only where both occur.
  EXPECT_GT(seen_bins, 4'000);
  EXPECT_GT(left_out, 4'000);
}

TEST(SeenTiles, HoldsNothingWithoutElements) {
  const BinCase of = letter_case();
  const std::vector<TileLevel> levels = tile_levels(of.lattice, 0.5, {{.side = 2}});
  const TileRange seen = seen_tiles({}, of.map, levels.front());
  EXPECT_EQ(seen.x_first, seen.x_end);
  EXPECT_EQ(seen.y_first, seen.y_end);
}

/// Expects of a search that it visits each bin at most once, with its likelihood, and that the
/// others hold at most what it says was dropped.
/// @returns number of bins that were settled together, without being evaluated
std::int64_t expect_sound_search(const BinCase& of, double tolerance) {
  const std::vector<Hypothesis> hypotheses(2, {of.map, 1.0});
  const BoundedOptions options{
      .lattice = of.lattice, .contact = of.contact, .tolerance = tolerance};
  const BinLikelihood likelihood(hypotheses, of.contact, of.lattice);
  SearchSpace space(hypotheses, options);
  LargestTiles largest(space);
  largest.add(of.elements);
  // [object][bin], nan where a bin is not visited
  std::vector<std::vector<double>> visited(
      2, std::vector(static_cast<std::size_t>(of.lattice.bins()), nan));
  std::int64_t together = 0;
  bool once = true;
  const BinVisitor visit = [&](const BinBox& box, std::span<const double> values) {
    const bool alike = values.size() == 1;
    once = once && box.x_first + box.x_count <= of.lattice.x_mm.count &&
           box.y_first + box.y_count <= of.lattice.y_mm.count;
    for (std::int64_t i = 0; once && i < box.bins(); ++i) {
      double& value = visited[static_cast<std::size_t>(box.object)]
                             [static_cast<std::size_t>(box.bin(i, of.lattice))];
      once = std::isnan(value);
      value = values[alike ? 0 : static_cast<std::size_t>(i)];
    }
    if (alike && box.bins() > 1) {
      EXPECT_NEAR(values[0], prior_log_likelihood(of, static_cast<std::size_t>(box.object)),
                  likelihood.error(static_cast<std::size_t>(box.object), of.elements));
      together += box.bins();
    }
  };
  const SearchResult result = run_search(
      {space, options, likelihood, of.elements, {.tolerance = tolerance}, Deadline({}), visit},
      largest);
  EXPECT_TRUE(once) << "a bin was visited twice, or is none";
  for (std::size_t object = 0; object < 2; ++object) {
    const double rounding = 2.0 * likelihood.error(object, of.elements);
    LogSum dropped;
    for (int theta = 0; theta < of.lattice.theta_rad.count; ++theta) {
      const BinBox plane = whole_plane(of.lattice, theta, static_cast<int>(object));
      std::vector<double> exact(static_cast<std::size_t>(plane.bins()));
      likelihood.evaluate(std::span(&plane, 1), of.elements, exact);
      for (std::size_t i = 0; i < exact.size(); ++i) {
        const double value = visited[object][static_cast<std::size_t>(theta) * exact.size() + i];
        if (std::isnan(value)) {
          dropped.add(exact[i] + std::log(0.5));
        } else {
          EXPECT_NEAR(value, exact[i], rounding) << "bin " << i << " of theta " << theta;
        }
      }
    }
    EXPECT_LE(dropped.log(), result.mass[object].dropped + 1e-9) << "object " << object;
  }
  return together;
}

TEST(BoundSearch, SettlesEveryBinOnceAndBoundsTheOthers) {
  Uniform random(503);
  std::int64_t together = 0;
  for (int trial = 0; trial < trials(200) && !HasFailure(); ++trial) {
    SCOPED_TRACE(fmt::format("trial {}", trial));
    const BinCase of = trial % 2 == 0 ? random_far_case(random) : random_bound_case(random);
    together += expect_sound_search(of, trial % 3 == 0 ? 0.3 : 1e-9);
  }
  EXPECT_GT(together, 5'000);
}

}  // namespace palpate::seen_tiles_test
