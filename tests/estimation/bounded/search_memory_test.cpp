// How much memory a search by bounds takes, and lattices that no memory holds.

#include "estimation/bounded/search_memory.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "bounded_set_up.hpp"
#include "palpate/error.hpp"

namespace palpate::search_memory_test {

using testing::AllOf;
using testing::HasSubstr;

constexpr double mib = 1 << 20;

BoundedOptions options_of(const PoseLattice& lattice) {
  BoundedOptions options{.lattice = lattice};
  options.contact.prior = 0.2;
  return options;
}

PoseLattice square(double half_mm, int count, int thetas) {
  return {
      {-half_mm, half_mm, count}, {-half_mm, half_mm, count}, {0.0, 6.283185307179586, thetas}, {}};
}

std::string refusal_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::input);
    return error.what();
  }
  return "";
}

TEST(SearchMemory, IsWhatTheSearchHolds) {
  const std::vector<Hypothesis> maps = two_shapes();
  for (const PoseLattice& lattice :
       {square(10.0, 12, 16), square(50.0, 60, 36), square(10.0, 200, 250), square(300.0, 3000, 90),
        square(3000.0, 3000, 360),
        PoseLattice{{0.0, 0.0, 1}, {-50.0, 9.0, 7}, {0.5, 0.5, 1}, {}}}) {
    const BoundedOptions options = options_of(lattice);
    const SearchMemory memory = search_memory(maps, options);
    const auto held = static_cast<double>(BoundedPosterior(maps, options).host_bytes());
    // Before a search: the sums of the largest tiles, 4 bytes of 28 a tile, and the tables.
    EXPECT_LE(held, memory.tables + memory.tiles);
    EXPECT_GE(1.01 * held + 0.1 * mib, memory.tables + memory.tiles / 7.0);
  }
}

TEST(SearchMemory, GrowsWithWhatIsAskedFor) {
  const std::vector<Hypothesis> maps = two_shapes();
  const SearchMemory few = search_memory(maps, options_of(square(10.0, 200, 100)));
  const SearchMemory thetas = search_memory(maps, options_of(square(10.0, 200, 200)));
  EXPECT_EQ(thetas.thetas, 2.0 * few.thetas);
  EXPECT_GT(thetas.tiles, 1.5 * few.tiles);
  EXPECT_EQ(thetas.tables, few.tables);
  const SearchMemory bins = search_memory(maps, options_of(square(10.0, 20'000, 100)));
  EXPECT_GT(bins.leaves, 2.0 * few.leaves);
  EXPECT_EQ(bins.tiles, few.tiles) << "memory follows the region, not the bins";
  BoundedOptions with_none = options_of(square(10.0, 200, 100));
  with_none.none_weight = 1.0;
  EXPECT_GT(search_memory(maps, with_none).thetas, few.thetas);
}

TEST(SearchMemory, IsRefusedAboveTheLimit) {
  const std::vector<Hypothesis> maps = two_shapes();
  const BoundedOptions options = options_of(square(10.0, 200, 250));
  const double total = search_memory(maps, options).total();
  EXPECT_EQ(why_no_room(maps, options, static_cast<std::uint64_t>(total) + 1), "");
  EXPECT_THAT(why_no_room(maps, options, 1'000'000),
              AllOf(HasSubstr("lattice: bounds of 2 objects x 200 x 200 x 250 bins"),
                    HasSubstr("MiB"), HasSubstr("use fewer")));
}

TEST(SearchMemory, TheMachineHasSome) {
  EXPECT_GE(memory_for_search(), std::uint64_t{64} << 20);
  EXPECT_LT(memory_for_search(), std::uint64_t{1} << 50);
}

TEST(SearchMemory, AbsurdLatticesAreRefusedBeforeAnyIsTaken) {
  constexpr int many = 2'000'000'000;
  const PoseLattice fine{{-10.0, 10.0, many}, {-10.0, 10.0, many}, {0.0, 0.0, 1}, {}};
  const PoseLattice line{{-1e9, 1e9, many}, {0.0, 0.0, 1}, {0.0, 1.0, many}, {}};
  const auto refusal = [&](const PoseLattice& lattice, std::size_t copies) {
    std::vector<Hypothesis> maps;
    for (std::size_t i = 0; i < copies; ++i) {
      maps.push_back(two_shapes()[0]);
    }
    return refusal_of([&] { BoundedPosterior(maps, {.lattice = lattice}); });
  };
  EXPECT_THAT(refusal(fine, 1), AllOf(HasSubstr("lattice"), HasSubstr("bins along x and y")));
  EXPECT_THAT(refusal(square(10.0, many, many), 1), HasSubstr("use fewer bins"));
  EXPECT_THAT(refusal(square(10.0, 4, many), 1), HasSubstr("fewer thetas"));
  EXPECT_THAT(refusal(square(1e9, 1000, 1000), 1), HasSubstr("narrow the region"));
  EXPECT_THAT(refusal(square(1e9, many, 1), 1), HasSubstr("lattice"));
  // A large machine's memory holds this one.
  EXPECT_THAT(why_no_room(two_shapes(), options_of(line), std::uint64_t{8} << 30),
              HasSubstr("lattice"));
  EXPECT_EQ(refusal(square(10.0, 100, 100), 2), "");
}

}  // namespace palpate::search_memory_test
