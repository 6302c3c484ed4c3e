#include "estimation/bounded/tables/reading_penalties.hpp"

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
