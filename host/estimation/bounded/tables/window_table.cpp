#include "estimation/bounded/tables/window_table.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <span>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

namespace {

/// In penalties: rounding in float64 of log odds and log-likelihoods never matters as much.
constexpr double margin = 0.01;

/// The largest log-likelihood at the nodes of a likelihood table within an interval of log odds;
/// -infinity where no node lies inside. Eq. 7 has no nodes: it rises or falls with the log odds,
/// and is largest at an interval's end.
class InnerNodes {
 public:
  InnerNodes(const ContactModel& contact, Reading reading, std::size_t object) {
    if (!contact.table) {
      return;
    }
    const LikelihoodTable& table = *contact.table;
    const std::size_t set = table.sets() == 1 ? 0 : object;
    nodes_ = std::span(table.log_likelihood)
                 .subspan((set * table.levels() + static_cast<std::size_t>(reading)) * table.nodes,
                          table.nodes);
    first_ = table.first_log_odds;
    step_ = (table.last_log_odds - table.first_log_odds) / static_cast<double>(table.nodes - 1);
  }

  double largest(double low, double high) const {
    double most = -std::numeric_limits<double>::infinity();
    // A node too many on either side leaves bounds true.
    const auto nodes = static_cast<double>(nodes_.size());
    const double begin = std::clamp(std::ceil((low - first_) / step_ - 1e-6), 0.0, nodes);
    const double end = std::clamp(std::floor((high - first_) / step_ + 1e-6) + 1.0, 0.0, nodes);
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      most = std::max(most, nodes_[i]);
    }
    return most;
  }

 private:
  std::span<const double> nodes_;
  double first_ = 0.0;
  double step_ = 1.0;
};

/// Places along one axis: from a node, -1 for the prior's before the first, towards the next.
struct Places {
  std::vector<int> node;
  std::vector<double> fraction;
  std::vector<int> first;  ///< [squares + 1] the place on a square's lower border

  void add(int at, double towards_next) {
    node.push_back(at);
    fraction.push_back(towards_next);
  }
  void begin_square() { first.push_back(static_cast<int>(node.size())); }
};

Places places_of_cells(int nodes, int parts) {
  Places places;
  for (int i = 0; i <= (nodes + 1) * parts; ++i) {
    places.begin_square();
    places.add(i / parts - 1, static_cast<double>(i % parts) / parts);
  }
  return places;
}

Places places_of_size(int nodes, double square_cells) {
  Places places;
  const double end = nodes + 1.0;
  const auto squares = static_cast<int>(std::ceil(end / square_cells));
  double next_node = 0.0;
  for (int i = 0; i <= squares; ++i) {
    // All beyond the map is the prior, as its end is.
    const double border = std::min(i * square_cells, end);
    for (; next_node < border; next_node += 1.0) {
      places.add(static_cast<int>(next_node) - 1, 0.0);
    }
    const double node = std::floor(border);
    places.begin_square();
    places.add(static_cast<int>(node) - 1, border - node);
    next_node = node + 1.0;
  }
  return places;
}

MapSquares at_places(const OccupancyGrid& map, double prior_log_odds, Places x, Places y) {
  const auto cell = [&](int i, int j) -> double {
    return i < 0 || j < 0 || i >= map.nx || j >= map.ny
               ? prior_log_odds
               : map.log_odds[static_cast<std::size_t>(j) * map.nx + i];
  };
  MapSquares squares{.first_x = std::move(x.first), .first_y = std::move(y.first), .log_odds = {}};
  squares.log_odds.reserve(x.node.size() * y.node.size());
  for (std::size_t j = 0; j < y.node.size(); ++j) {
    const int row = y.node[j];
    for (std::size_t i = 0; i < x.node.size(); ++i) {
      const int column = x.node[i];
      const auto along = [&](int of_row) {
        return std::lerp(cell(column, of_row), cell(column + 1, of_row), x.fraction[i]);
      };
      squares.log_odds.push_back(
          y.fraction[j] == 0.0 ? along(row) : std::lerp(along(row), along(row + 1), y.fraction[j]));
    }
  }
  return squares;
}

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

SquarePenalties square_penalties(const MapSquares& squares, const ContactModel& contact,
                                 Reading reading, std::size_t object) {
  const InnerNodes inner(contact, reading, object);
  const std::vector<double>& log_odds = squares.log_odds;
  std::vector<double> at_place(log_odds.size());
  std::transform(log_odds.begin(), log_odds.end(), at_place.begin(),
                 [&](double l) { return contact.log_likelihood(reading, {l}, object); });
  SquarePenalties penalties{.nx = squares.nx(), .ny = squares.ny(), .least = {}};
  const double prior =
      contact.log_likelihood(reading, {log_odds_from_probability(*contact.prior)}, object);
  penalties.best = prior;
  std::vector<double> largest;
  largest.reserve(static_cast<std::size_t>(penalties.nx) * penalties.ny);
  for (int j = 0; j < penalties.ny; ++j) {
    for (int i = 0; i < penalties.nx; ++i) {
      double most = -std::numeric_limits<double>::infinity();
      double low = std::numeric_limits<double>::infinity();
      double high = -low;
      for (int row = squares.first_y[j]; row <= squares.first_y[j + 1]; ++row) {
        const std::size_t in_row = static_cast<std::size_t>(row) * squares.columns();
        for (int column = squares.first_x[i]; column <= squares.first_x[i + 1]; ++column) {
          const std::size_t place = in_row + static_cast<std::size_t>(column);
          most = std::max(most, at_place[place]);
          low = std::min(low, log_odds[place]);
          high = std::max(high, log_odds[place]);
        }
      }
      if (contact.table) {
        most = std::max(most, inner.largest(low, high));
      }
      largest.push_back(most);
      penalties.best = std::max(penalties.best, most);
    }
  }
  const auto penalty = [&](double log_likelihood) {
    return static_cast<std::uint16_t>(
        std::clamp((penalties.best - log_likelihood) * penalties_per_nat - margin, 0.0,
                   static_cast<double>(largest_penalty)));
  };
  penalties.least.resize(largest.size());
  std::transform(largest.begin(), largest.end(), penalties.least.begin(), penalty);
  penalties.beyond = penalty(prior);
  return penalties;
}

SquarePenalties merged(const SquarePenalties& squares, int count) {
  SquarePenalties large{.best = squares.best,
                        .nx = (squares.nx + count - 1) / count,
                        .ny = (squares.ny + count - 1) / count,
                        .least = {},
                        .beyond = squares.beyond};
  const auto at = [&](int i, int j) -> std::uint16_t& {
    return large.least[static_cast<std::size_t>(j / count) * large.nx + i / count];
  };
  const bool whole = squares.nx % count == 0 && squares.ny % count == 0;
  large.least.assign(static_cast<std::size_t>(large.nx) * large.ny,
                     whole ? largest_penalty : squares.beyond);
  for (int j = 0; j < squares.ny; ++j) {
    for (int i = 0; i < squares.nx; ++i) {
      at(i, j) = std::min(at(i, j), squares.least[static_cast<std::size_t>(j) * squares.nx + i]);
    }
  }
  return large;
}

MapSquares squares_of_cells(const OccupancyGrid& map, double prior_log_odds, int parts) {
  return at_places(map, prior_log_odds, places_of_cells(map.nx, parts),
                   places_of_cells(map.ny, parts));
}

MapSquares squares_of_size(const OccupancyGrid& map, double prior_log_odds,
                           const glm::dvec2& square_mm) {
  return at_places(map, prior_log_odds, places_of_size(map.nx, square_mm.x / map.cell_mm),
                   places_of_size(map.ny, square_mm.y / map.cell_mm));
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

ChangeTable change_table(const WindowTable* to, const WindowTable& from) {
  const auto penalty_at = [to](std::size_t i) { return to == nullptr ? 0 : int{to->entries[i]}; };
  int offset = 0;
  for (std::size_t i = 0; i < from.entries.size(); ++i) {
    offset = std::max(offset, from.entries[i] - penalty_at(i));
  }
  ChangeTable change{.table = from, .offset = static_cast<std::uint16_t>(offset)};
  for (std::size_t i = 0; i < from.entries.size(); ++i) {
    change.table.entries[i] = static_cast<std::uint16_t>(penalty_at(i) - from.entries[i] + offset);
  }
  const int beyond = (to == nullptr ? 0 : int{to->beyond}) - from.beyond;
  change.table.beyond = static_cast<std::uint16_t>(beyond + offset);
  const auto& entries = change.table.entries;
  change.table.largest = *std::max_element(entries.begin(), entries.end());
  return change;
}

}  // namespace palpate
