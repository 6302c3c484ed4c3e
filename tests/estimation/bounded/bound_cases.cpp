#include "bound_cases.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include "support/shared_device.hpp"
#include "support/touched_shape.hpp"

namespace palpate {

namespace {

/// Bins about a place of the map's, in mm.
Axis random_axis(Uniform& random, double cell_mm, double middle_mm) {
  const int count = one_of(random, std::array{1, 2, 9, 23, 40});
  // A power of two puts bins on the cells' borders again and again.
  const double step_mm =
      cell_mm * (random(0.0, 2.0) < 1.0 ? one_of(random, std::array{0.125, 0.25, 0.5, 1.0, 2.0})
                                        : std::exp(random(std::log(0.1), std::log(12.0))));
  const double lower = middle_mm - 0.5 * count * step_mm;
  if (count == 1 && random(0.0, 2.0) < 1.0) {
    return {middle_mm, middle_mm, 1};
  }
  return {lower, lower + count * step_mm, count};
}

/// One of the kinds of maps that bounds must hold on: a letter; noise of log odds within +-12 or
/// +-1000; few cells; cells of 0.02 and 100 mm; one cell.
OccupancyGrid random_bound_map(Uniform& random) {
  struct Kind {
    int nx, ny;
    double cell_mm, steepness;
  };
  constexpr std::array<Kind, 8> kinds{{{0, 0, 0.0, 0.0},
                                       {31, 27, 0.5, 12.0},
                                       {29, 33, 0.37, 1000.0},
                                       {3, 2, 0.5, 12.0},
                                       {41, 17, 0.02, 12.0},
                                       {21, 30, 100.0, 12.0},
                                       {1, 1, 2.0, 1000.0},
                                       {64, 5, 0.5, 3.0}}};
  const auto seed = static_cast<std::uint64_t>(random(1.0, 1e9));
  const auto [nx, ny, cell_mm, steepness] = one_of(random, kinds);
  return nx == 0 ? map_of(on_letter_l, "L") : random_map(nx, ny, cell_mm, steepness, seed);
}

}  // namespace

BinCase letter_case() {
  return {
      .map = random_map(31, 27, 0.5, 12.0, 71),
      .contact = {.prior = 0.2},
      .lattice = {.x_mm = {-3.0, 3.5, 65}, .y_mm = {-2.0, 1.0, 31}, .theta_rad = {0.0, two_pi, 3}},
      .elements = random_elements(36, 6.0, 2, 72)};
}

KnownElements random_elements(std::size_t count, double half_mm, std::size_t levels,
                              std::uint64_t seed) {
  Uniform random(seed);
  KnownElements elements;
  for (std::size_t level = 0; level < levels; ++level) {
    const std::size_t begin = elements.from_pivot_mm.size();
    const std::size_t end = (level + 1) * count / levels;
    while (elements.from_pivot_mm.size() < end) {
      const double x = random(-half_mm, half_mm);
      elements.from_pivot_mm.emplace_back(x, random(-half_mm, half_mm));
    }
    elements.runs.push_back({static_cast<Reading>(level), begin, end});
  }
  return elements;
}

LikelihoodTable crooked_table() {
  LikelihoodTable table{.first_log_odds = -7.0, .last_log_odds = 9.0, .nodes = 13};
  table.level_edges = {5.0, 8.0};
  Uniform random(77);
  for (std::size_t i = 0; i < table.levels() * table.nodes; ++i) {
    table.log_likelihood.push_back(i < 3 * table.nodes ? random(-4.0, 0.0) : random(-3e3, 3e3));
  }
  return table;
}

LikelihoodTable crooked_table_of_two() {
  LikelihoodTable table = crooked_table();
  const std::vector<double> first = table.log_likelihood;
  table.log_likelihood.insert(table.log_likelihood.end(), first.rbegin(), first.rend());
  return table;
}

std::vector<double> by_definition(const BinCase& of, const std::vector<BinBox>& boxes) {
  std::vector<double> logs;
  for (const BinBox& box : boxes) {
    for (std::int64_t i = 0; i < box.bins(); ++i) {
      const Pose pose = reference::bin_pose(of.lattice, box.bin(i, of.lattice));
      double sum = 0.0;
      for (const ReadingRun& run : of.elements.runs) {
        for (std::size_t e = run.begin; e < run.end; ++e) {
          const double l = reference::interpolate(
              of.map, *of.contact.prior, reference::transform(pose, of.elements.from_pivot_mm[e]));
          sum += reference::log_likelihood(run.reading, {l}, of.contact,
                                           static_cast<std::size_t>(box.object));
        }
      }
      logs.push_back(sum);
    }
  }
  return logs;
}

BinCase random_bound_case(Uniform& random) {
  BinCase of{.map = random_bound_map(random), .contact = {}, .lattice = {}, .elements = {}};
  const double cell_mm = of.map.cell_mm;
  of.contact.gamma = one_of(random, std::array{0.0, 0.1});
  of.contact.prior = one_of(random, std::array{0.2, 0.5, 1e-6});
  if (random(0.0, 4.0) < 1.0) {
    of.contact.table = crooked_table_of_two();
  }
  const auto near_the_map = [&] { return cell_mm * random(-12.0, 12.0); };
  of.lattice.x_mm = random_axis(random, cell_mm, near_the_map());
  of.lattice.y_mm = random_axis(random, cell_mm, near_the_map());
  // Angles of which one is 0, but for the full circle.
  of.lattice.theta_rad =
      one_of(random, std::array{Axis{0.0, 0.0, 1}, Axis{-1.5, 1.5, 3}, Axis{0.0, two_pi, 4}});
  const std::size_t levels = of.contact.table ? of.contact.table->levels() : 2;
  of.elements = random_elements(one_of(random, std::array{1U, 7U, 36U}),
                                cell_mm * one_of(random, std::array{2.0, 12.0, 40.0}), levels,
                                static_cast<std::uint64_t>(random(1.0, 1e9)));
  const glm::dvec2 first_mm(of.lattice.x_mm.centre(0), of.lattice.y_mm.centre(0));
  for (glm::dvec2& p_mm : of.elements.from_pivot_mm) {
    const double kind = random(0.0, 8.0);
    if (kind < 2.0) {
      // The first bin puts it on a node at theta 0.
      const glm::dvec2 node(std::floor(random(-2.0, of.map.nx + 2.0)),
                            std::floor(random(-2.0, of.map.ny + 2.0)));
      p_mm = of.map.origin_mm + cell_mm * node - first_mm;
    } else if (kind < 2.5) {
      p_mm *= std::pow(10.0, random(0.0, 6.0));
    }
  }
  return of;
}

std::size_t random_object(const BinCase& of, Uniform& random) {
  return of.contact.table && random(0.0, 2.0) < 1.0 ? 1 : 0;
}

glm::dvec2 turn_of(const PoseLattice& lattice, int theta) {
  const double theta_rad = lattice.theta_rad.centre(theta);
  return {std::cos(theta_rad), std::sin(theta_rad)};
}

const std::vector<Hypothesis>& two_shapes() {
  static const std::vector<Hypothesis> two{{map_of(on_letter_l, "L"), 1.0},
                                           {map_of(on_disc, "disc"), 2.0}};
  return two;
}

const std::vector<Hypothesis>& two_made_up() {
  static const std::vector<Hypothesis> two{{random_map(31, 27, 0.5, 3.0, 801), 1.0},
                                           {random_map(23, 29, 0.5, 3.0, 802), 3.0}};
  return two;
}

BoundedOptions small_options() {
  return {.lattice = {.x_mm = {-6.0, 6.0, 13},
                      .y_mm = {-5.0, 6.0, 12},
                      .theta_rad = {0, two_pi, 16},
                      .pivot_mm = {2.0, -1.0}}};
}

BoundedOptions uncertain_options() {
  BoundedOptions options = small_options();
  options.touch_sd = {.mm = 1.0, .rad = 0.2};
  return options;
}

Recording touches_of_l(std::size_t touches, std::uint64_t seed) {
  return touches_of(on_letter_l, {{1.3, -0.8}, 0.7}, touches, seed);
}

PoseLattice cell_by_cell(double cell_mm) {
  constexpr double eighth = std::numbers::pi / 4;
  return {.x_mm = {-8.5 * cell_mm, 8.5 * cell_mm, 17},
          .y_mm = {-7.5 * cell_mm, 7.5 * cell_mm, 15},
          .theta_rad = {-eighth, two_pi - eighth, 4}};
}

Recording touches_on_nodes(double cell_mm) {
  Uniform random(862);
  Recording recording;
  for (int e = 0; e < 20; ++e) {
    const double x = std::floor(random(-8.0, 8.0)) + e % 2 / 2.0;
    recording.elements_mm.emplace_back(cell_mm * x, cell_mm * std::floor(random(-8.0, 8.0)));
  }
  for (int i = 0; i < 3; ++i) {
    recording.T_robot_sensor.push_back({{cell_mm * i, -cell_mm * i}, i * std::numbers::pi / 2});
    for (int e = 0; e < 20; ++e) {
      recording.pressure.push_back((e + i) % 3 == 0 ? 10.0 : 0.0);
    }
  }
  return recording;
}

HistogramOptions dense_options(const BoundedOptions& options) {
  return {.lattice = options.lattice,
          .contact = options.contact,
          .none_weight = options.none_weight,
          .touch_sd = options.touch_sd};
}

BothFilters::BothFilters(const std::vector<Hypothesis>& objects, const BoundedOptions& options)
    : bounded(objects, options), dense(shared_device(), objects, dense_options(options)) {}

void BothFilters::update(const Touch& touch) {
  bounded.update(touch);
  dense.update(touch);
}

}  // namespace palpate
