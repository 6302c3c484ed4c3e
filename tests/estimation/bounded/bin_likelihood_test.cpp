#include "estimation/bounded/leaves/bin_likelihood.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include "bins_by_definition.hpp"
#include "model/interpolated_map.hpp"
#include "palpate/error.hpp"
#include "support/every_set_of_instructions.hpp"
#include "support/synthetic.hpp"

namespace palpate::bin_likelihood_test {

BinLikelihood likelihood_of(const BinCase& of) {
  const Hypothesis hypothesis{of.map, 1.0};
  return {std::span(&hypothesis, 1), of.contact, of.lattice};
}

std::vector<double> evaluated(const BinLikelihood& likelihood, const BinCase& of,
                              const std::vector<BinBox>& boxes) {
  std::size_t bins = 0;
  for (const BinBox& box : boxes) {
    bins += static_cast<std::size_t>(box.bins());
  }
  std::vector<double> logs(bins, -7.0);
  likelihood.evaluate(boxes, of.elements, logs);
  return logs;
}

/// Largest error of the results in nats; infinite where one of them is not finite.
double largest_error(const std::vector<double>& got, const std::vector<long double>& expected) {
  double largest = got.size() == expected.size() ? 0.0 : HUGE_VAL;
  for (std::size_t i = 0; i < std::min(got.size(), expected.size()); ++i) {
    const auto error = static_cast<double>(std::abs(got[i] - expected[i]));
    largest = std::isfinite(error) ? std::max(largest, error) : HUGE_VAL;
  }
  return largest;
}

/// Expects errors within their bound, and returns it.
double expect_within_bounds(const BinCase& of, const std::vector<BinBox>& boxes,
                            const std::string& name) {
  const BinLikelihood likelihood = likelihood_of(of);
  const double error = likelihood.error(0, of.elements);
  EXPECT_LE(largest_error(evaluated(likelihood, of, boxes), by_definition(of, boxes)), error)
      << name;
  return error;
}

std::vector<BinBox> planes(const PoseLattice& lattice) {
  std::vector<BinBox> boxes;
  for (int t = 0; t < lattice.theta_rad.count; ++t) {
    boxes.push_back(whole_plane(lattice, t));
  }
  return boxes;
}

TEST(BinLikelihood, HasTheSameBitsOnThreads) {
  const BinCase of = letter_case();
  const BinLikelihood likelihood = likelihood_of(of);
  // Planes are larger than a thread's task, the small boxes between them smaller.
  std::vector<BinBox> boxes = planes(of.lattice);
  for (int i = 0; i < 300; ++i) {
    const BinBox small{
        .theta = i % 3, .y_first = i % 24, .y_count = 1 + i % 7, .x_first = i % 58, .x_count = 5};
    boxes.insert(boxes.end() - 1, small);
  }
  const auto on_threads = [&](int threads) {
    return tbb::task_arena(threads).execute([&] { return evaluated(likelihood, of, boxes); });
  };
  EXPECT_EQ(on_threads(4), on_threads(1));
}

class BinsAlongAxes : public testing::TestWithParam<int> {};

TEST_P(BinsAlongAxes, AreWithinTheBounds) {
  BinCase of = letter_case();
  of.lattice.x_mm.count = GetParam();
  of.lattice.y_mm.count = 2;
  expect_within_bounds(of, planes(of.lattice), "along x");
  std::swap(of.lattice.x_mm, of.lattice.y_mm);
  expect_within_bounds(of, planes(of.lattice), "along y");
}

INSTANTIATE_TEST_SUITE_P(Bins, BinsAlongAxes, testing::Values(1, 7, 63, 65, 1000));

class ElementsOnTheHost : public testing::TestWithParam<std::size_t> {};

TEST_P(ElementsOnTheHost, AreWithinTheBounds) {
  BinCase of = letter_case();
  of.elements = random_elements(GetParam(), 6.0, 2, GetParam());
  expect_within_bounds(of, {{.y_count = 5, .x_count = 5}}, "elements");
}

INSTANTIATE_TEST_SUITE_P(Numbers, ElementsOnTheHost, testing::Values(0, 1, 7, 63, 65, 1000));

TEST(BinLikelihood, HasATightBoundOnALetter) {
  const BinCase of = letter_case();
  // A posterior's masses are uncertain by as much of themselves.
  EXPECT_LT(expect_within_bounds(of, planes(of.lattice), "letter"), 1e-9);
}

TEST(BinLikelihood, IsTheContactModelsAtTheInterpolatedLogOdds) {
  const BinCase of = letter_case();
  const InterpolatedMap map(of.map, *of.contact.prior);
  const BinBox plane = whole_plane(of.lattice, 1);
  const std::vector<double> logs = evaluated(likelihood_of(of), of, {plane});
  for (int k = 0; k < plane.bins(); k += 17) {
    const glm::dvec2 at(of.lattice.x_mm.centre(k % plane.x_count),
                        of.lattice.y_mm.centre(k / plane.x_count));
    double sum = 0.0;
    for (const ReadingRun& run : of.elements.runs) {
      for (std::size_t e = run.begin; e < run.end; ++e) {
        const glm::dvec2 p_mm =
            rotate(of.lattice.theta_rad.centre(1), of.elements.from_pivot_mm[e]) + at;
        sum += of.contact.log_likelihood(run.reading, {map.log_odds(p_mm)});
      }
    }
    // Both are float64, with rounding of their own.
    ASSERT_NEAR(logs[k], sum, 1e-9) << "bin " << k;
  }
}

TEST(BinLikelihood, StaysWithinItsBoundsInHardCases) {
  const auto check = [](const std::string& name, const auto& change) {
    BinCase of = letter_case();
    of.lattice.x_mm.count = 23;
    of.lattice.y_mm.count = 4;
    change(of);
    expect_within_bounds(of, planes(of.lattice), name);
  };
  for (const double gamma : {0.0, 1e-300, 1e-40, 1e-12, 1e-9, 1e-6, 0.9, 1.0 - 0x1p-53}) {
    for (const double prior : {1e-6, 0.2, 1.0 - 1e-6}) {
      for (const double steepness : {2.0, 1000.0}) {
        check(fmt::format("gamma {}, prior {}, log odds +-{}", gamma, prior, steepness),
              [&](BinCase& of) {
                of.contact.gamma = gamma;
                of.contact.prior = prior;
                of.map = random_map(31, 27, 0.5, steepness, 73);
              });
      }
    }
  }
  for (const double cell_mm : {0.02, 0.5, 3.0, 100.0}) {
    check(fmt::format("cells of {} mm", cell_mm),
          [&](BinCase& of) { of.map = random_map(41, 37, cell_mm, 12.0, 74); });
  }
  for (const glm::ivec2 cells : {glm::ivec2(1, 1), {1, 40}, {40, 1}, {2, 3}}) {
    check(fmt::format("{} x {} cells", cells.x, cells.y),
          [&](BinCase& of) { of.map = random_map(cells.x, cells.y, 0.5, 12.0, 75); });
  }
  for (const double step_mm : {1e-7, 0.001, 0.9, 1.0, 1.1, 5.0}) {
    check(fmt::format("bins {} mm apart", step_mm), [&](BinCase& of) {
      of.lattice.x_mm = {-11.5 * step_mm, 11.5 * step_mm, 23};
      of.lattice.y_mm = {0.3 - 4.5 * step_mm, 0.3 + 4.5 * step_mm, 9};
    });
  }
  for (const double cell_mm : {0.02, 0.5}) {
    check(fmt::format("a pivot 1e5 mm from the touches, cells of {} mm", cell_mm),
          [&](BinCase& of) {
            of.map = random_map(41, 37, cell_mm, 12.0, 76);
            of.lattice.theta_rad = {-1e-6, 1e-6, 3};
            of.lattice.x_mm = {-1e5 - 3.0, -1e5 + 3.0, 23};
            for (glm::dvec2& p_mm : of.elements.from_pivot_mm) {
              p_mm = glm::dvec2(1e5, 0.0) + 0.1 * p_mm;
            }
          });
  }
  check("a map 1e5 mm away", [](BinCase& of) {
    of.map.origin_mm += glm::dvec2(1e5, -1e5);
    of.lattice.x_mm = {1e5 - 3.0, 1e5 + 3.0, 23};
    of.lattice.y_mm = {-1e5 - 3.0, -1e5 + 3.0, 9};
  });
}

TEST(BinLikelihood, OfElementsOffTheMapIsThePriors) {
  for (const double away_mm : {40.0, 1e6, 1e9, 1e30, 1e300}) {
    BinCase of = letter_case();
    for (std::size_t e = 0; e < of.elements.from_pivot_mm.size(); e += 2) {
      of.elements.from_pivot_mm[e] = {away_mm, -0.7 * away_mm};
    }
    expect_within_bounds(of, {whole_plane(of.lattice, 0)}, fmt::format("{} mm away", away_mm));
  }
}

/// A table with so many nodes, whose log-likelihoods change at every one of them.
LikelihoodTable table_of(std::size_t nodes, double nats = 8.0) {
  LikelihoodTable table{.first_log_odds = -6.0, .last_log_odds = 5.0, .nodes = nodes};
  Uniform random(87);
  for (std::size_t i = 0; i < table.levels() * nodes; ++i) {
    table.log_likelihood.push_back(random(-nats, 0.0));
  }
  return table;
}

constexpr std::array<std::size_t, 9> table_nodes{2, 15, 16, 17, 33, 49, 64, 65, 300};

TEST(BinLikelihood, OfTablesOfAnySizeIsWithinItsBounds) {
  for (const double nats : {8.0, most_log_odds}) {
    for (const std::size_t nodes : table_nodes) {
      BinCase of = letter_case();
      of.contact.table = table_of(nodes, nats);
      const double error = expect_within_bounds(of, planes(of.lattice), "a table");
      EXPECT_TRUE(error < 1e-9 || nodes > 10 || nats > 8.0) << "few nodes change as slowly";
    }
  }
}

TEST(BinLikelihood, OfATableIsWithinItsBounds) {
  BinCase of = letter_case();
  of.contact.table = crooked_table();
  of.elements = random_elements(41, 6.0, of.contact.table->levels(), 78);
  expect_within_bounds(of, planes(of.lattice), "crooked table");
  of.map = random_map(31, 27, 0.5, 1000.0, 79);
  expect_within_bounds(of, planes(of.lattice), "log odds beyond the table");
}

TEST(BinLikelihood, TakesEachObjectsRowsOfATable) {
  BinCase of = letter_case();
  of.contact.table = crooked_table();
  const LikelihoodTable first = *of.contact.table;
  LikelihoodTable second = first;
  std::reverse(second.log_likelihood.begin(), second.log_likelihood.end());
  of.contact.table->log_likelihood.insert(of.contact.table->log_likelihood.end(),
                                          second.log_likelihood.begin(),
                                          second.log_likelihood.end());
  const std::vector<Hypothesis> hypotheses{{of.map, 1.0}, {of.map, 1.0}};
  const BinLikelihood both(hypotheses, of.contact, of.lattice);
  const BinBox box{.object = 1, .y_count = 4, .x_count = 6};
  const std::vector<double> got = evaluated(both, of, {box});
  of.contact.table = second;
  EXPECT_LE(largest_error(got, by_definition(of, {box})), both.error(1, of.elements));
}

std::vector<unsigned char> bits(const std::vector<double>& logs) {
  std::vector<unsigned char> bytes(logs.size() * sizeof(double));
  std::memcpy(bytes.data(), logs.data(), bytes.size());
  return bytes;
}

TEST(BinLikelihood, HasTheSameBitsWithEverySetOfInstructions) {
  std::vector<BinCase> cases(4 + table_nodes.size(), letter_case());
  cases[1].contact.gamma = 0.0;
  cases[2].map = random_map(31, 27, 0.05, 1000.0, 80);
  cases[3].contact.table = crooked_table();
  for (std::size_t i = 0; i < table_nodes.size(); ++i) {
    cases[4 + i].contact.table = table_of(table_nodes[i]);
  }
  for (std::size_t c = 0; c < cases.size(); ++c) {
    const BinCase& of = cases[c];
    const BinLikelihood likelihood = likelihood_of(of);
    std::optional<std::vector<unsigned char>> first;
    with_every_set_of_instructions([&](const std::string& name) {
      const auto own = bits(evaluated(likelihood, of, planes(of.lattice)));
      EXPECT_EQ(own, first.value_or(own)) << fmt::format("case {}, {}", c, name);
      first = own;
    });
  }
}

/// Cuts a box in two, at random, until parts are small; in random order of the parts' sizes.
std::vector<BinBox> parts_of(const BinBox& box, Uniform& random) {
  if (box.bins() <= 1 || (box.bins() < 300 && random(0.0, 1.0) < 0.3)) {
    return {box};
  }
  BinBox low = box;
  BinBox high = box;
  if (box.y_count > 1) {
    low.y_count = 1 + static_cast<int>(random(0.0, box.y_count - 1.0));
    high.y_first += low.y_count;
    high.y_count -= low.y_count;
  } else {
    low.x_count = 1 + static_cast<int>(random(0.0, box.x_count - 1.0));
    high.x_first += low.x_count;
    high.x_count -= low.x_count;
  }
  if (random(0.0, 1.0) < 0.5 && box.x_count > 1 && box.y_count > 1) {
    low = high = box;
    low.x_count = 1 + static_cast<int>(random(0.0, box.x_count - 1.0));
    high.x_first += low.x_count;
    high.x_count -= low.x_count;
  }
  std::vector<BinBox> parts = parts_of(low, random);
  const std::vector<BinBox> rest = parts_of(high, random);
  parts.insert(parts.end(), rest.begin(), rest.end());
  return parts;
}

void expect_same_in_parts(const BinCase& of, const BinBox& plane, Uniform& random) {
  const BinLikelihood likelihood = likelihood_of(of);
  const std::vector<double> whole = evaluated(likelihood, of, {plane});
  const std::vector<BinBox> parts = parts_of(plane, random);
  const std::vector<double> in_parts = evaluated(likelihood, of, parts);
  ASSERT_GT(parts.size(), 1U);
  std::size_t k = 0;
  for (const BinBox& part : parts) {
    for (int j = 0; j < part.y_count; ++j) {
      for (int i = 0; i < part.x_count; ++i, ++k) {
        ASSERT_EQ(in_parts[k], whole[(part.y_first + j) * plane.x_count + part.x_first + i])
            << "bin " << part.x_first + i << ", " << part.y_first + j << " in a box of "
            << part.x_count << " x " << part.y_count;
      }
    }
  }
}

TEST(BinLikelihood, HasTheSameBitsInEveryBox) {
  Uniform random(81);
  for (const double cell_mm : {0.03, 0.5, 4.0}) {
    BinCase of = letter_case();
    of.map = random_map(31, 27, cell_mm, 12.0, 82);
    expect_same_in_parts(of, whole_plane(of.lattice, 1), random);
    of.contact.table = crooked_table();
    of.elements = random_elements(41, 6.0, of.contact.table->levels(), 86);
    expect_same_in_parts(of, whole_plane(of.lattice, 1), random);
  }
}

TEST(BinLikelihood, HasTheSameBitsInABoxOfItsOwn) {
  for (const double cell_mm : {0.03, 0.5, 4.0}) {
    for (const std::size_t elements : {1U, 7U, 63U, 1000U}) {
      BinCase of = letter_case();
      of.lattice.y_mm.count = 7;
      of.map = random_map(31, 27, cell_mm, 12.0, 82);
      of.contact.table = crooked_table();
      of.elements = random_elements(elements, 6.0, 4, 85);
      const BinBox plane = whole_plane(of.lattice, 1);
      std::vector<BinBox> bins;
      for (std::int64_t i = 0; i < plane.bins(); ++i) {
        bins.push_back({.theta = 1,
                        .y_first = static_cast<std::int32_t>(i / plane.x_count),
                        .y_count = 1,
                        .x_first = static_cast<std::int32_t>(i % plane.x_count),
                        .x_count = 1});
      }
      with_every_set_of_instructions([&](const std::string& name) {
        const BinLikelihood likelihood = likelihood_of(of);
        EXPECT_EQ(evaluated(likelihood, of, bins), evaluated(likelihood, of, {plane}))
            << name << ", " << elements << " elements, cells of " << cell_mm << " mm";
      });
    }
  }
}

TEST(BinLikelihood, KeepsObjectsAndThetasApart) {
  BinCase of = letter_case();
  const OccupancyGrid other = random_map(20, 40, 0.8, 5.0, 83);
  const std::vector<Hypothesis> hypotheses{{of.map, 1.0}, {other, 1.0}};
  const BinLikelihood both(hypotheses, of.contact, of.lattice);
  const std::vector<BinBox> boxes{{.object = 1, .theta = 2, .y_count = 3, .x_count = 3},
                                  {.object = 0, .theta = 2, .y_count = 3, .x_count = 3},
                                  {.object = 0, .theta = 1, .y_count = 3, .x_count = 3},
                                  {.object = 1, .theta = 1, .y_count = 3, .x_count = 3}};
  const std::vector<double> got = evaluated(both, of, boxes);
  for (std::size_t b = 0; b < boxes.size(); ++b) {
    BinCase one = of;
    one.map = hypotheses[boxes[b].object].map;
    const auto first = got.begin() + static_cast<std::ptrdiff_t>(9 * b);
    EXPECT_LE(largest_error(std::vector<double>(first, first + 9), by_definition(one, {boxes[b]})),
              both.error(boxes[b].object, of.elements))
        << "box " << b;
  }
}

TEST(BinLikelihood, RefusesAMapThatIndicesDoNotReach) {
  OccupancyGrid map = random_map(1, 1, 0.5, 1.0, 84);
  map.nx = 1 << 29;
  ContactModel contact;
  contact.prior = 0.2;
  const Hypothesis hypothesis{map, 1.0};
  EXPECT_THROW(BinLikelihood(std::span(&hypothesis, 1), contact, {}), Error);
}

TEST(BinLikelihood, CountsTheMemoryOfItsNodes) {
  const BinCase of = letter_case();
  // Each of the bordered map's nodes stands there four times.
  EXPECT_GE(likelihood_of(of).bytes(), std::uint64_t{39 * 35 * 4 * sizeof(float)});
}

}  // namespace palpate::bin_likelihood_test
