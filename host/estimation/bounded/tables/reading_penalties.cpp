#include "estimation/bounded/tables/reading_penalties.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

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

}  // namespace palpate
