// How much memory a search by bounds takes, and lattices that no memory holds.

#include "estimation/bounded/search_memory.hpp"

#include <vector>

#include <gtest/gtest.h>

#include "bound_cases.hpp"

namespace palpate::search_memory_test {

constexpr double mib = 1 << 20;

BoundedOptions options_of(const PoseLattice& lattice) {
  return {.lattice = lattice, .contact = {.prior = 0.2}};
}

PoseLattice square(double half_mm, int count, int thetas) {
  return {{-half_mm, half_mm, count}, {-half_mm, half_mm, count}, {0.0, two_pi, thetas}, {}};
}

TEST(SearchMemory, IsWhatTheSearchHolds) {
  for (const PoseLattice& lattice :
       {square(10.0, 12, 16), square(50.0, 60, 36), square(10.0, 200, 250), square(300.0, 3000, 90),
        square(3000.0, 3000, 360),
        PoseLattice{{0.0, 0.0, 1}, {-50.0, 9.0, 7}, {0.5, 0.5, 1}, {}}}) {
    const BoundedOptions options = options_of(lattice);
    const SearchMemory memory = search_memory(two_shapes(), options);
    const auto held = static_cast<double>(BoundedPosterior(two_shapes(), options).host_bytes());
    // Before a search: the sums of the largest tiles, 4 bytes of 28 a tile, and the tables.
    EXPECT_LE(held, memory.tables + memory.tiles);
    EXPECT_GE(1.01 * held + 0.1 * mib, memory.tables + memory.tiles / 7.0);
  }
}

TEST(SearchMemory, GrowsWithWhatIsAskedFor) {
  const auto memory_of = [](const BoundedOptions& options) {
    return search_memory(two_shapes(), options);
  };
  const SearchMemory few = memory_of(options_of(square(10.0, 200, 100)));
  const SearchMemory thetas = memory_of(options_of(square(10.0, 200, 200)));
  EXPECT_NEAR(thetas.tiles, 2.0 * few.tiles, 1e4) << "but for the tiles of an axis";
  EXPECT_EQ(thetas.tables, few.tables);
  const SearchMemory bins = memory_of(options_of(square(10.0, 20'000, 100)));
  EXPECT_GT(bins.bins, 2.0 * few.bins);
  EXPECT_EQ(bins.tiles, few.tiles) << "memory follows the region, not the bins";
  BoundedOptions with_none = options_of(square(10.0, 200, 100));
  with_none.none_weight = 1.0;
  EXPECT_GE(memory_of(with_none).tiles, few.tiles + 2 * 100 * 2 * sizeof(double));
}

TEST(SearchMemory, OfTheMachineIsSome) {
  EXPECT_GE(memory_for_search(), std::uint64_t{64} << 20);
  EXPECT_LT(memory_for_search(), std::uint64_t{1} << 50);
}

TEST(SearchMemory, IsRefusedAboveTheLimit) {
  const BoundedOptions options = options_of(square(10.0, 200, 250));
  const double total = search_memory(two_shapes(), options).total();
  EXPECT_EQ(why_no_room(two_shapes(), options, static_cast<std::uint64_t>(total) + 1), "");
  expect_named(why_no_room(two_shapes(), options, 1'000'000),
               {"lattice: bounds of 2 objects x 200 x 200 x 250 bins", "MiB", "use fewer"});

  // Absurd lattices are refused before any memory is taken.
  constexpr int many = 2'000'000'000;
  const auto refused = [](const PoseLattice& lattice, const char* named) {
    const std::vector<Hypothesis> one{two_shapes()[0]};
    expect_named(input_error([&] { BoundedPosterior(one, {.lattice = lattice}); }),
                 {"lattice", named});
  };
  refused({{-10.0, 10.0, many}, {-10.0, 10.0, many}, {0.0, 0.0, 1}, {}}, "bins along x and y");
  refused(square(10.0, many, many), "use fewer bins");
  refused(square(10.0, 4, many), "fewer thetas");
  refused(square(1e9, 1000, 1000), "narrow the region");
  refused(square(1e9, many, 1), "lattice");
  // A large machine's memory holds this one.
  const PoseLattice line{{-1e9, 1e9, many}, {0.0, 0.0, 1}, {0.0, 1.0, many}, {}};
  expect_named(why_no_room(two_shapes(), options_of(line), std::uint64_t{8} << 30), {"lattice"});
}

}  // namespace palpate::search_memory_test
