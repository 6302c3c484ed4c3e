#include "bins_by_definition.hpp"

#include <algorithm>
#include <cmath>

#include "support/synthetic.hpp"

namespace palpate {

namespace {

using Real = long double;

Real node(const OccupancyGrid& map, Real prior, long long i, long long j) {
  return i >= 0 && i < map.nx && j >= 0 && j < map.ny
             ? Real{map.at(static_cast<int>(i), static_cast<int>(j))}
             : prior;
}

Real log_odds(const OccupancyGrid& map, Real prior, Real x_mm, Real y_mm) {
  const Real x = (x_mm - map.origin_mm.x) / map.cell_mm;
  const Real y = (y_mm - map.origin_mm.y) / map.cell_mm;
  if (!(x > -1 && x < map.nx && y > -1 && y < map.ny)) {
    return prior;
  }
  const auto i = static_cast<long long>(std::floor(x));
  const auto j = static_cast<long long>(std::floor(y));
  const Real fx = x - std::floor(x);
  const Real fy = y - std::floor(y);
  return (1 - fy) * ((1 - fx) * node(map, prior, i, j) + fx * node(map, prior, i + 1, j)) +
         fy * ((1 - fx) * node(map, prior, i, j + 1) + fx * node(map, prior, i + 1, j + 1));
}

Real by_table(const LikelihoodTable& table, Reading level, Real log_odds) {
  const Real last = static_cast<Real>(table.nodes - 1);
  const Real place = std::clamp(
      (log_odds - table.first_log_odds) * last / (Real{table.last_log_odds} - table.first_log_odds),
      Real{0}, last);
  const auto i = std::min(static_cast<std::size_t>(place), table.nodes - 2);
  const double* row = &table.log_likelihood[static_cast<std::size_t>(level) * table.nodes];
  return row[i] + (Real{row[i + 1]} - row[i]) * (place - static_cast<Real>(i));
}

Real log_likelihood(const ContactModel& contact, Reading reading, Real l) {
  if (contact.table) {
    return by_table(*contact.table, reading, l);
  }
  const Real z = reading == Reading::no_contact ? -l : l;
  const Real log_p = std::min(z, Real{0}) - std::log1p(std::exp(-std::abs(z)));
  const Real gamma = contact.gamma;
  const Real trusted = std::log1p(-gamma) + log_p;
  if (gamma == 0) {
    return trusted;
  }
  const Real floor = std::log(gamma) + std::log(Real{*contact.prior});
  return std::max(floor, trusted) + std::log1p(std::exp(-std::abs(floor - trusted)));
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

std::vector<long double> by_definition(const BinCase& of, const std::vector<BinBox>& boxes) {
  const Real prior = log_odds_from_probability(*of.contact.prior);
  std::vector<Real> logs;
  for (const BinBox& box : boxes) {
    const Real theta = of.lattice.theta_rad.centre(box.theta);
    const Real c = std::cos(theta);
    const Real s = std::sin(theta);
    for (std::int64_t bin = 0; bin < box.bins(); ++bin) {
      const auto j = box.y_first + static_cast<int>(bin / box.x_count);
      const auto i = box.x_first + static_cast<int>(bin % box.x_count);
      Real sum = 0;
      for (const ReadingRun& run : of.elements.runs) {
        for (std::size_t e = run.begin; e < run.end; ++e) {
          const Real x = of.elements.from_pivot_mm[e].x;
          const Real y = of.elements.from_pivot_mm[e].y;
          const Real l = log_odds(of.map, prior, c * x - s * y + of.lattice.x_mm.centre(i),
                                  s * x + c * y + of.lattice.y_mm.centre(j));
          sum += log_likelihood(of.contact, run.reading, l);
        }
      }
      logs.push_back(sum);
    }
  }
  return logs;
}

}  // namespace palpate
