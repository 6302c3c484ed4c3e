#include "reading_penalties.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace palpate {

namespace {

/// In penalties: rounding in float64 of log odds and log-likelihoods never matters as much.
constexpr double margin = 0.01;

/// The largest log-likelihood at the inner nodes of a likelihood table, over intervals of log odds.
class InnerNodes {
 public:
  InnerNodes(const ContactModel& contact, Reading reading, std::size_t object) {
    if (!contact.table) {
      return;  // Eq. 7 rises or falls with the log odds: it is largest at an interval's end
    }
    const LikelihoodTable& table = *contact.table;
    const std::size_t set = table.sets() == 1 ? 0 : object;
    nodes_ = std::span(table.log_likelihood)
                 .subspan((set * table.levels() + static_cast<std::size_t>(reading)) * table.nodes,
                          table.nodes);
    first_ = table.first_log_odds;
    step_ = (table.last_log_odds - table.first_log_odds) / static_cast<double>(table.nodes - 1);
    // A tree of maxima: leaf i stands at n + i, its parent at half the index.
    tree_.resize(2 * nodes_.size());
    std::copy(nodes_.begin(), nodes_.end(),
              tree_.begin() + static_cast<std::ptrdiff_t>(nodes_.size()));
    for (std::size_t i = nodes_.size() - 1; i > 0; --i) {
      tree_[i] = std::max(tree_[2 * i], tree_[2 * i + 1]);
    }
  }

  /// -infinity where no node lies inside.
  double largest(double low, double high) const {
    double most = -std::numeric_limits<double>::infinity();
    if (nodes_.empty()) {
      return most;
    }
    // A node too many on either side leaves bounds true.
    const auto last = static_cast<double>(nodes_.size());
    std::size_t begin = nodes_.size() + static_cast<std::size_t>(std::clamp(
                                            std::ceil((low - first_) / step_ - 1e-6), 0.0, last));
    std::size_t end =
        nodes_.size() + static_cast<std::size_t>(std::clamp(
                            std::floor((high - first_) / step_ + 1e-6) + 1.0, 0.0, last));
    for (; begin < end; begin /= 2, end /= 2) {
      if (begin % 2 == 1) {
        most = std::max(most, tree_[begin++]);
      }
      if (end % 2 == 1) {
        most = std::max(most, tree_[--end]);
      }
    }
    return most;
  }

 private:
  std::span<const double> nodes_;
  double first_ = 0.0;
  double step_ = 1.0;
  std::vector<double> tree_;
};

/// A map's nodes with one node of the prior around them, and between them the interpolated log odds
/// where squares are divided.
struct Nodes {
  int nx = 0;
  int ny = 0;
  std::vector<double> log_odds;  ///< [ny, nx]

  double at(int i, int j) const { return log_odds[static_cast<std::size_t>(j) * nx + i]; }
};

Nodes divided_nodes(const OccupancyGrid& map, double prior_log_odds, int parts) {
  const auto cell = [&](int i, int j) -> double {
    return i < 0 || j < 0 || i >= map.nx || j >= map.ny
               ? prior_log_odds
               : map.log_odds[static_cast<std::size_t>(j) * map.nx + i];
  };
  Nodes nodes{.nx = (map.nx + 1) * parts + 1, .ny = (map.ny + 1) * parts + 1, .log_odds = {}};
  nodes.log_odds.resize(static_cast<std::size_t>(nodes.nx) * nodes.ny);
  for (int j = 0; j < nodes.ny; ++j) {
    const int row = j / parts - 1;
    const double fy = static_cast<double>(j % parts) / parts;
    for (int i = 0; i < nodes.nx; ++i) {
      const int column = i / parts - 1;
      const double fx = static_cast<double>(i % parts) / parts;
      const double below = std::lerp(cell(column, row), cell(column + 1, row), fx);
      nodes.log_odds[static_cast<std::size_t>(j) * nodes.nx + i] =
          fy == 0.0
              ? below
              : std::lerp(below, std::lerp(cell(column, row + 1), cell(column + 1, row + 1), fx),
                          fy);
    }
  }
  return nodes;
}

}  // namespace

SquarePenalties square_penalties(const OccupancyGrid& map, const ContactModel& contact,
                                 Reading reading, std::size_t object, int parts) {
  const double prior_log_odds = log_odds_from_probability(*contact.prior);
  const Nodes nodes = divided_nodes(map, prior_log_odds, parts);
  const InnerNodes inner(contact, reading, object);
  std::vector<double> at_node(nodes.log_odds.size());
  std::transform(nodes.log_odds.begin(), nodes.log_odds.end(), at_node.begin(),
                 [&](double l) { return contact.log_likelihood(reading, {l}, object); });
  SquarePenalties penalties{.parts = parts, .nx = nodes.nx - 1, .ny = nodes.ny - 1, .least = {}};
  const double prior = contact.log_likelihood(reading, {prior_log_odds}, object);
  penalties.best = prior;
  std::vector<double> largest(static_cast<std::size_t>(penalties.nx) * penalties.ny);
  for (int j = 0; j < penalties.ny; ++j) {
    for (int i = 0; i < penalties.nx; ++i) {
      // Bilinear log odds are extreme at a square's corners.
      const std::size_t corner = static_cast<std::size_t>(j) * nodes.nx + i;
      const std::size_t above = corner + static_cast<std::size_t>(nodes.nx);
      double most = std::max(std::max(at_node[corner], at_node[corner + 1]),
                             std::max(at_node[above], at_node[above + 1]));
      if (contact.table) {
        const auto [low, high] = std::minmax({nodes.log_odds[corner], nodes.log_odds[corner + 1],
                                              nodes.log_odds[above], nodes.log_odds[above + 1]});
        most = std::max(most, inner.largest(low, high));
      }
      largest[static_cast<std::size_t>(j) * penalties.nx + i] = most;
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
                        .parts = squares.parts,
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

}  // namespace palpate
