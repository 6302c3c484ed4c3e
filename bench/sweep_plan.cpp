#include "sweep_plan.hpp"

#include <algorithm>
#include <cmath>

#include "letters.hpp"

namespace palpate::bench {

namespace {

constexpr std::array<BinCounts, 3> table_1 = {{{5, 5, 4}, {10, 10, 10}, {25, 25, 16}}};

/// A lattice of some number of bins in the proportions of the goal's.
BinCounts scaled(double count) {
  const double factor = std::cbrt(count / static_cast<double>(product(goal_bins)));
  BinCounts counts{};
  std::transform(goal_bins.begin(), goal_bins.end(), counts.begin(),
                 [&](int n) { return std::max(1, static_cast<int>(std::lround(factor * n))); });
  return counts;
}

std::vector<BinCounts> scaled(std::initializer_list<double> counts) {
  std::vector<BinCounts> lattices;
  for (const double count : counts) {
    lattices.push_back(scaled(count));
  }
  return lattices;
}

std::vector<BinCounts> with_table_1(std::vector<BinCounts> lattices) {
  lattices.insert(lattices.end(), table_1.begin(), table_1.end());
  return lattices;
}

std::vector<CellPlan> quick_cells() {
  return {{.cell_mm = 1.0, .lattices = scaled({1e3, 1e4, 1e5})},
          {.cell_mm = goal_cell_mm,
           .lattices = with_table_1(scaled({1e2, 1e3, 1e4, 1e5})),
           .particles = {1'000, 10'000},
           .compared = {{25, 25, 4}, {100, 100, 2}},
           .bounded = scaled({1e2, 1e3, 1e4, 1e5})}};
}

std::vector<CellPlan> full_cells() {
  const std::vector<BinCounts> decades = scaled({1e2, 1e3, 1e4, 1e5, 1e6, 1e7});
  return {{.cell_mm = 1.0, .lattices = decades},
          {.cell_mm = goal_cell_mm,
           .lattices = with_table_1(scaled({1e2, 1e3, 1e4, 3e4, 1e5, 3e5, 1e6, 3e6, 1e7})),
           .particles = {100, 1'000, 10'000, 100'000, 1'000'000},
           .compared = {{25, 25, 16}, {50, 50, 40}, {100, 100, 10}, {200, 200, 4}},
           .bounded = scaled({1e3, 3e3, 1e4, 2e4, 3e4, 1e5, 1e6, 1e7})},
          {.cell_mm = 0.25, .lattices = decades}};
}

}  // namespace

std::int64_t product(const BinCounts& bins) { return std::int64_t{bins[0]} * bins[1] * bins[2]; }

PoseLattice lattice_with(const BinCounts& bins) { return lattice_of(bins[0], bins[1], bins[2]); }

bool is_balanced(const BinCounts& bins) {
  return std::find(table_1.begin(), table_1.end(), bins) == table_1.end();
}

int SweepPlan::full_each(double cell_mm, const BinCounts& bins) const {
  const std::int64_t count = product(bins);
  const bool goal = bins == goal_bins && cell_mm == goal_cell_mm;
  if (count <= most_full || goal) {
    return trials_each;
  }
  return std::min(trials_each, count <= most_twice ? 2 : 1);
}

int SweepPlan::bounded_each(const BinCounts& bins) const {
  return std::min(trials_each, quick || product(bins) > most_twice ? 1 : 4);
}

int SweepPlan::particle_trials_each(int particles) const {
  return particles > 300'000 ? 1 : trials_each;
}

SweepPlan plan_of(const SweepOptions& options) {
  const int trials = options.quick ? 4 : 10;
  SweepPlan plan{.trials_each = options.trials.value_or(trials),
                 .most_full = options.quick ? 50'000 : 320'000,
                 .most_twice = options.quick ? 50'000 : 1'200'000,
                 .cells = options.quick ? quick_cells() : full_cells(),
                 .limits = {goal_bins},
                 .quick = options.quick};
  plan.limit_trials_each = options.quick ? std::min(plan.trials_each, 2) : plan.trials_each;
  if (!options.quick) {
    plan.limits.insert(plan.limits.end(), {scaled(3e5), scaled(3e6)});
  }
  // Counts are those nearest to what was asked for.
  const std::int64_t most =
      options.max_bins.value_or(options.quick ? 100'000 : 10'000'000) * 11 / 10;
  for (CellPlan& cells : plan.cells) {
    for (std::vector<BinCounts>* lattices : {&cells.lattices, &cells.bounded}) {
      std::erase_if(*lattices, [&](const BinCounts& bins) { return product(bins) > most; });
    }
    std::stable_sort(cells.lattices.begin(), cells.lattices.end(),
                     [](const auto& a, const auto& b) { return product(a) < product(b); });
  }
  return plan;
}

}  // namespace palpate::bench
