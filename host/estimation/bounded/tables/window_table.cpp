#include "estimation/bounded/tables/window_table.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <span>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

namespace {

/// In penalties: rounding in float64 of log odds and log-likelihoods never matters as much.
constexpr double margin = 0.01;

/// The largest log-likelihood of a reading over an interval of log odds. Eq. 7 rises or falls with
/// the log odds, and is largest at an end; a table is so at an end or at a node between.
double largest_in(const Extremes& range, const ContactModel& contact, Reading reading,
                  std::size_t object) {
  const auto at = [&](double log_odds) {
    return contact.log_likelihood(reading, {log_odds}, object);
  };
  if (!contact.table) {
    return at(reading == Reading::no_contact ? range.least : range.most);
  }
  const LikelihoodTable& table = *contact.table;
  const std::span<const double> nodes = numbers_of(table, reading, object);
  const auto last = static_cast<double>(table.nodes - 1);
  // A node too many on either side leaves bounds true: rounding must not leave one out.
  constexpr double rounding = 1e-6;
  const auto node_after = [&](double log_odds, double spare) {
    const double place = (log_odds - table.first_log_odds) * nodes_per_nat(table);
    return static_cast<std::size_t>(std::clamp(place, 0.0, last) + 1.0 + spare);
  };
  double highest = std::max(at(range.least), at(range.most));
  for (std::size_t i = node_after(range.least, -rounding);
       i < std::min(node_after(range.most, rounding), table.nodes); ++i) {
    highest = std::max(highest, nodes[i]);
  }
  return highest;
}

/// Places along one axis where log odds may be extreme in a square: its borders, and the nodes
/// between them. Each lies between a node, of which -1 is the prior's before the first, and the
/// next.
struct Places {
  std::vector<int> node;
  std::vector<double> fraction;  ///< towards the next node
  std::vector<int> first;        ///< [squares + 1] the place on a square's lower border

  int squares() const { return static_cast<int>(first.size()) - 1; }

  Places(int nodes, double square_cells) {
    const double end = nodes + 1.0;  // all beyond is the prior, as the map's end is
    int next = 0;
    for (double border = 0.0; first.empty() || border < end;) {
      border = std::min(static_cast<double>(first.size()) * square_cells, end);
      for (; next < border; ++next) {
        node.push_back(next - 1);
        fraction.push_back(0.0);
      }
      first.push_back(static_cast<int>(node.size()));
      const int before = static_cast<int>(border);
      node.push_back(before - 1);
      fraction.push_back(border - before);
      next = before + 1;
    }
  }
};

/// Replaces every number by the least of the `width` numbers from it on, by doubling.
/// @param stride between neighbours; `count` numbers, of which the last width - 1 have no meaning
void slide_minimum(std::vector<std::uint16_t>& numbers, std::size_t stride, int width) {
  int covered = 1;
  while (covered < width) {
    const int step = std::min(covered, width - covered);
    const std::size_t shift = stride * static_cast<std::size_t>(step);
    const std::size_t end = numbers.size() - shift;
    for (std::size_t i = 0; i < end; ++i) {
      numbers[i] = std::min(numbers[i], numbers[i + shift]);
    }
    covered += step;
  }
}

}  // namespace

MapSquares map_squares(const OccupancyGrid& map, double prior_log_odds,
                       const glm::dvec2& square_mm) {
  const Places x(map.nx, square_mm.x / map.cell_mm);
  const Places y(map.ny, square_mm.y / map.cell_mm);
  const auto node = [&](int i, int j) -> double {
    return i < 0 || j < 0 || i >= map.nx || j >= map.ny
               ? prior_log_odds
               : map.log_odds[static_cast<std::size_t>(j) * map.nx + i];
  };
  std::vector<double> log_odds;  // [y place, x place]
  log_odds.reserve(x.node.size() * y.node.size());
  for (std::size_t k = 0; k < y.node.size(); ++k) {
    for (std::size_t i = 0; i < x.node.size(); ++i) {
      const auto along = [&](int row) {
        const double left = node(x.node[i], row);
        return left + x.fraction[i] * (node(x.node[i] + 1, row) - left);
      };
      const double below = along(y.node[k]);
      log_odds.push_back(
          y.fraction[k] == 0.0 ? below : below + y.fraction[k] * (along(y.node[k] + 1) - below));
    }
  }
  MapSquares squares{.nx = x.squares(), .ny = y.squares(), .ranges = {}};
  squares.ranges.reserve(static_cast<std::size_t>(squares.nx) * squares.ny);
  for (int j = 0; j < squares.ny; ++j) {
    for (int i = 0; i < squares.nx; ++i) {
      constexpr double infinity = std::numeric_limits<double>::infinity();
      Extremes& range = squares.ranges.emplace_back(Extremes{infinity, -infinity});
      for (int row = y.first[j]; row <= y.first[j + 1]; ++row) {
        for (int column = x.first[i]; column <= x.first[i + 1]; ++column) {
          range.include(log_odds[static_cast<std::size_t>(row) * x.node.size() + column]);
        }
      }
    }
  }
  return squares;
}

SquarePenalties square_penalties(const MapSquares& squares, const ContactModel& contact,
                                 Reading reading, std::size_t object) {
  const double prior =
      contact.log_likelihood(reading, {log_odds_from_probability(*contact.prior)}, object);
  SquarePenalties penalties{.best = prior, .nx = squares.nx, .ny = squares.ny, .least = {}};
  std::vector<double> highest;
  highest.reserve(squares.ranges.size());
  for (const Extremes& range : squares.ranges) {
    highest.push_back(largest_in(range, contact, reading, object));
    penalties.best = std::max(penalties.best, highest.back());
  }
  const auto penalty = [&](double log_likelihood) {
    return static_cast<std::uint16_t>(
        std::clamp((penalties.best - log_likelihood) * penalties_per_nat - margin, 0.0,
                   static_cast<double>(largest_penalty)));
  };
  penalties.least.resize(highest.size());
  std::transform(highest.begin(), highest.end(), penalties.least.begin(), penalty);
  penalties.beyond = penalty(prior);
  return penalties;
}

WindowTable window_table(const SquarePenalties& penalties, int side, int window) {
  WindowTable table{.best = penalties.best,
                    .side = side,
                    .side_log2 = std::countr_zero(static_cast<unsigned>(side)),
                    .columns = 2 * WindowTable::margin + (penalties.nx + side - 1) / side,
                    .rows = 2 * WindowTable::margin + (penalties.ny + side - 1) / side,
                    .beyond = penalties.beyond,
                    .entries = {}};
  // Places in the table are counted in 32 bits.
  const std::int64_t entries = std::int64_t{table.columns} * table.rows * batch_side * side * side;
  if (entries > std::numeric_limits<std::int32_t>::max()) {
    throw Error(Fault::input,
                fmt::format("a map of {} x {} squares is too large for bounds; use PoseHistogram "
                            "(`filter histogram`), or larger cells",
                            penalties.nx, penalties.ny));
  }
  // The squares, with what lies beyond on all sides: windows of the last rows' batches reach
  // batch_side tiles further.
  const std::size_t width = static_cast<std::size_t>(table.columns) * side + side;
  const std::size_t height = static_cast<std::size_t>(table.rows + batch_side) * side;
  const std::size_t before = static_cast<std::size_t>(WindowTable::margin) * side;
  std::vector<std::uint16_t> least(width * height, penalties.beyond);
  for (int j = 0; j < penalties.ny; ++j) {
    const auto row = penalties.least.begin() + static_cast<std::ptrdiff_t>(j) * penalties.nx;
    std::copy(row, row + penalties.nx,
              least.begin() + static_cast<std::ptrdiff_t>((before + j) * width + before));
  }
  slide_minimum(least, 1, window);
  slide_minimum(least, width, window);
  const std::size_t plane = static_cast<std::size_t>(table.columns) * table.rows * batch_side;
  table.entries.resize(plane * side * side);
  auto* entry = table.entries.data();
  for (int phase_y = 0; phase_y < side; ++phase_y) {
    for (int phase_x = 0; phase_x < side; ++phase_x) {
      for (int row = 0; row < table.rows; ++row) {
        const std::uint16_t* from =
            least.data() + (static_cast<std::size_t>(row) * side + phase_y) * width + phase_x;
        for (int column = 0; column < table.columns; ++column, from += side) {
          for (int j = 0; j < batch_side; ++j) {
            *entry++ = from[static_cast<std::size_t>(j) * side * width];
          }
        }
      }
    }
  }
  table.largest = *std::max_element(table.entries.begin(), table.entries.end());
  return table;
}

}  // namespace palpate
