#include "bins_by_definition.hpp"

#include <algorithm>
#include <cmath>

#include "support/synthetic.hpp"

namespace palpate {

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

}  // namespace palpate
