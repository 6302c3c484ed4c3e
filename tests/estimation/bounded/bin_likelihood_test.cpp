#include "estimation/bounded/leaves/bin_likelihood.hpp"

#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "bound_cases.hpp"
#include "support/errors.hpp"
#include "support/every_set_of_instructions.hpp"
#include "support/synthetic.hpp"

namespace palpate::bin_likelihood_test {

BinLikelihood likelihood_of(const BinCase& of) {
  const Hypothesis hypothesis{of.map, 1.0};
  return {std::span(&hypothesis, 1), of.contact, of.lattice};
}

std::vector<double> evaluated(const BinLikelihood& likelihood, const BinCase& of,
                              const std::vector<BinBox>& boxes) {
  std::vector<double> logs(bins_in(boxes), -7.0);
  likelihood.evaluate(boxes, of.elements, logs);
  return logs;
}

std::vector<BinBox> planes(const PoseLattice& lattice) {
  std::vector<BinBox> boxes;
  for (int t = 0; t < lattice.theta_rad.count; ++t) {
    boxes.push_back(whole_plane(lattice, t));
  }
  return boxes;
}

/// Expects errors of all bins within their bound, and returns it.
double expect_within_bounds(const BinCase& of, const std::string& name) {
  const BinLikelihood likelihood = likelihood_of(of);
  const std::vector<BinBox> boxes = planes(of.lattice);
  const double error = likelihood.error(0, of.elements);
  EXPECT_LE(largest_difference(evaluated(likelihood, of, boxes), by_definition(of, boxes)), error)
      << name;
  return error;
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

constexpr std::size_t table_nodes[] = {2, 15, 16, 17, 33, 49, 64, 65, 300};

TEST(BinLikelihood, HasATightBoundOnALetter) {
  // A posterior's masses are uncertain by as much of themselves.
  EXPECT_LT(expect_within_bounds(letter_case(), "letter"), 1e-9);
}

TEST(BinLikelihood, StaysWithinItsBoundsForEveryNumberOfBinsAndElements) {
  for (const int count : {1, 7, 63, 65, 1000}) {
    BinCase of = letter_case();
    of.lattice.x_mm.count = count;
    of.lattice.y_mm.count = 2;
    expect_within_bounds(of, fmt::format("{} along x", count));
    std::swap(of.lattice.x_mm, of.lattice.y_mm);
    expect_within_bounds(of, fmt::format("{} along y", count));
  }
  for (const std::size_t count : {0U, 1U, 7U, 63U, 65U, 1000U}) {
    BinCase of = letter_case();
    of.lattice.x_mm.count = of.lattice.y_mm.count = 5;
    of.elements = random_elements(count, 6.0, 2, count);
    expect_within_bounds(of, fmt::format("{} elements", count));
  }
}

TEST(BinLikelihood, StaysWithinItsBoundsInHardCases) {
  const auto check = [](const std::string& name, const auto& change) {
    BinCase of = letter_case();
    of.lattice.x_mm.count = 23;
    of.lattice.y_mm.count = 4;
    change(of);
    expect_within_bounds(of, name);
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
  for (const double away_mm : {40.0, 1e6, 1e9, 1e30, 1e300}) {
    check(fmt::format("elements {} mm off the map", away_mm), [&](BinCase& of) {
      for (std::size_t e = 0; e < of.elements.from_pivot_mm.size(); e += 2) {
        of.elements.from_pivot_mm[e] = {away_mm, -0.7 * away_mm};
      }
    });
  }
}

TEST(BinLikelihood, OfATableIsWithinItsBounds) {
  for (const double nats : {8.0, most_log_odds}) {
    for (const std::size_t nodes : table_nodes) {
      BinCase of = letter_case();
      of.contact.table = table_of(nodes, nats);
      const double error = expect_within_bounds(of, fmt::format("{} nodes, {}", nodes, nats));
      EXPECT_TRUE(error < 1e-9 || nodes > 10 || nats > 8.0) << "few nodes change as slowly";
    }
  }
  BinCase of = letter_case();
  of.contact.table = crooked_table();
  of.elements = random_elements(41, 6.0, of.contact.table->levels(), 78);
  expect_within_bounds(of, "crooked table");
  of.map = random_map(31, 27, 0.5, 1000.0, 79);
  expect_within_bounds(of, "log odds beyond the table");
}

TEST(BinLikelihood, KeepsObjectsTheirRowsOfATableAndThetasApart) {
  BinCase of = letter_case();
  const std::vector<Hypothesis> hypotheses{{of.map, 1.0}, {random_map(20, 40, 0.8, 5.0, 83), 1.0}};
  of.contact.table = crooked_table_of_two();
  const BinLikelihood both(hypotheses, of.contact, of.lattice);
  const std::vector<BinBox> boxes{{.object = 1, .theta = 2, .y_count = 3, .x_count = 3},
                                  {.object = 0, .theta = 2, .y_count = 3, .x_count = 3},
                                  {.object = 0, .theta = 1, .y_count = 3, .x_count = 3},
                                  {.object = 1, .theta = 1, .y_count = 3, .x_count = 3}};
  const std::vector<double> got = evaluated(both, of, boxes);
  for (std::size_t b = 0; b < boxes.size(); ++b) {
    BinCase one = of;
    one.map = hypotheses[boxes[b].object].map;
    EXPECT_LE(largest_difference(std::span(got).subspan(9 * b, 9), by_definition(one, {boxes[b]})),
              both.error(boxes[b].object, of.elements))
        << "box " << b;
  }
}

/// Cuts a box in two, at random, until parts are small.
std::vector<BinBox> parts_of(const BinBox& box, Uniform& random) {
  if (box.bins() <= 1 || (box.bins() < 300 && random(0.0, 1.0) < 0.3)) {
    return {box};
  }
  const bool along_x = box.y_count == 1 || (box.x_count > 1 && random(0.0, 1.0) < 0.5);
  BinBox low = box;
  BinBox high = box;
  const auto cut = [&](auto first, auto count) {
    low.*count = 1 + static_cast<int>(random(0.0, box.*count - 1.0));
    high.*first += low.*count;
    high.*count -= low.*count;
  };
  if (along_x) {
    cut(&BinBox::x_first, &BinBox::x_count);
  } else {
    cut(&BinBox::y_first, &BinBox::y_count);
  }
  std::vector<BinBox> parts = parts_of(low, random);
  const std::vector<BinBox> rest = parts_of(high, random);
  parts.insert(parts.end(), rest.begin(), rest.end());
  return parts;
}

/// Expects the bits of a whole plane, the same by every set of instructions, in parts of it, too.
void expect_same_bits(const BinCase& of, const std::string& what) {
  Uniform random(81);
  const BinBox plane = whole_plane(of.lattice, 1);
  std::vector<BinBox> single;
  for (std::int32_t i = 0; i < plane.bins(); ++i) {
    single.push_back({0, 1, i / plane.x_count, 1, i % plane.x_count, 1});
  }
  std::optional<std::vector<double>> first;
  with_every_set_of_instructions([&](const std::string& name) {
    SCOPED_TRACE(fmt::format("{}, {}", what, name));
    EXPECT_EQ(vector_instructions(), name);
    const BinLikelihood likelihood = likelihood_of(of);
    const std::vector<double> whole = evaluated(likelihood, of, {plane});
    EXPECT_EQ(whole, first.value_or(whole));
    first = whole;
    EXPECT_EQ(evaluated(likelihood, of, single), whole);
    const std::vector<BinBox> parts = parts_of(plane, random);
    ASSERT_GT(parts.size(), 1U);
    std::vector<double> expected;
    for (const BinBox& part : parts) {
      for (int j = part.y_first; j < part.y_first + part.y_count; ++j) {
        const auto row = whole.begin() + std::ptrdiff_t{j} * plane.x_count + part.x_first;
        expected.insert(expected.end(), row, row + part.x_count);
      }
    }
    EXPECT_EQ(evaluated(likelihood, of, parts), expected);
  });
}

TEST(BinLikelihood, HasTheSameBitsInEveryBoxWithEverySetOfInstructions) {
  BinCase of = letter_case();
  of.contact.gamma = 0.0;
  expect_same_bits(of, "gamma 0");
  of = letter_case();
  of.map = random_map(31, 27, 0.05, 1000.0, 80);
  expect_same_bits(of, "log odds of +-1000");
  of = letter_case();
  of.lattice.y_mm.count = 7;
  for (const std::size_t nodes : table_nodes) {
    of.contact.table = table_of(nodes);
    expect_same_bits(of, fmt::format("{} nodes", nodes));
  }
  for (const double cell_mm : {0.03, 0.5, 4.0}) {
    of.map = random_map(31, 27, cell_mm, 12.0, 82);
    of.contact.table.reset();
    of.elements = letter_case().elements;
    expect_same_bits(of, fmt::format("cells of {} mm", cell_mm));
    of.contact.table = crooked_table();
    for (const std::size_t elements : {1U, 7U, 41U, 63U, 1000U}) {
      of.elements = random_elements(elements, 6.0, of.contact.table->levels(), 85);
      expect_same_bits(of, fmt::format("{} elements, cells of {} mm", elements, cell_mm));
    }
  }
}

TEST(BinLikelihood, RefusesAMapThatIndicesDoNotReach) {
  BinCase of = letter_case();
  of.map.nx = 1 << 29;
  expect_named(input_error([&] { likelihood_of(of); }), {"map"});
}

TEST(BinLikelihood, CountsTheMemoryOfItsNodes) {
  // Each of the bordered map's nodes stands there four times.
  EXPECT_GE(likelihood_of(letter_case()).bytes(), std::uint64_t{39 * 35 * 4 * sizeof(float)});
}

}  // namespace palpate::bin_likelihood_test
