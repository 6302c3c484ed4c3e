#include "estimation/bounded/none_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "estimation/bounded/log_sum.hpp"
#include "estimation/bounded/touch_overlap.hpp"

namespace palpate {

namespace {

/// A search's bounds are about so many times as wide as its tolerance.
constexpr double width_of_tolerance = 1.5;
/// Bounds that a search for a tenth of the tolerance narrows by less are rounding.
constexpr double least_gain = 0.9;

double width(const LogInterval& of) { return of.high - of.low; }

}  // namespace

NoneEvidence::NoneEvidence(SearchSpace& space, const BoundedOptions& options,
                           const BinLikelihood& likelihood)
    : space_(space), options_(options), search_(space, options, likelihood) {}

void NoneEvidence::add(std::span<const ArrayReadings> touches) {
  std::vector<TouchMean> added;
  for (const ArrayReadings& touch : touches) {
    // A touch without a known element does not even tell where the array was.
    if (std::ranges::any_of(touch.readings, [](Reading r) { return r != Reading::unknown; })) {
      added.push_back({.touch = touch});
    }
  }
  means_.insert(means_.end(), std::make_move_iterator(added.begin()),
                std::make_move_iterator(added.end()));
}

LogInterval NoneEvidence::search(TouchMean& mean, double tolerance, const Deadline& deadline) {
  const TouchOverlap overlap(mean.touch.rectangle, space_.boxes, options_.lattice);
  double bins = overlap.weighted_bins(space_.log_weight);
  // Where no pose of the region brings the array to an object, all poses are alike.
  const bool everywhere = bins == 0.0;
  if (everywhere) {
    for (const double log_weight : space_.log_weight) {
      bins += std::exp(log_weight) * static_cast<double>(options_.lattice.bins());
    }
  }
  const KnownElements elements = known_elements(mean.touch);
  search_.largest().reset();
  search_.largest().add(elements);
  const SearchResult found = search_.run(
      elements, {.tolerance = tolerance, .mode = false, .counted = everywhere ? nullptr : &overlap},
      deadline, [](const BinBox& /*box*/, std::span<const double> /*log_likelihood*/) {});
  const LogInterval all = found.all().bounds();
  const double log_bins = std::log(bins);
  mean.log_share = log_bins - std::log(static_cast<double>(options_.lattice.bins()));
  return {all.low - log_bins, all.high - log_bins};
}

LogInterval NoneEvidence::narrow(TouchMean& mean, double width_nats, const Deadline& deadline) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  // What an earlier call found finer does not count: bounds depend on what is asked for.
  LogInterval log_mean{-infinity, infinity};
  for (std::size_t i = space_.displacement ? 0 : 1; i < tolerances.size();) {
    if (!mean.found[i]) {
      const LogInterval found = search(mean, tolerances[i], deadline);
      if (deadline.passed()) {
        return width(found) < width(log_mean) ? found : log_mean;
      }
      mean.found[i] = found;
    }
    const double before = width(log_mean);
    log_mean = *mean.found[i];
    // The first searches may do the same work.
    const bool comparable = i > 2;
    if (width(log_mean) <= width_nats || (comparable && width(log_mean) > least_gain * before)) {
      break;
    }
    // Bounds and the first search tell little of what is needed; the others come close to their
    // tolerance.
    for (++i;
         i > 1 && i + 1 < tolerances.size() && width_of_tolerance * tolerances[i] > width_nats;) {
      ++i;
    }
  }
  return log_mean;
}

LogInterval NoneEvidence::bounds(double width_nats, const Deadline& deadline) {
  if (means_.empty()) {
    return {};
  }
  std::vector<double> low;
  std::vector<double> high;
  for (TouchMean& mean : means_) {
    const LogInterval log_mean =
        narrow(mean, width_nats / static_cast<double>(means_.size()), deadline);
    low.push_back(log_mean.low);
    high.push_back(log_mean.high);
  }
  // Added in an order of their own, so that the order of touches shows in no bit.
  const auto sum_of = [](std::vector<double>& logs) {
    std::ranges::sort(logs);
    return std::accumulate(logs.begin(), logs.end(), 0.0);
  };
  const double log_share = means_.front().log_share;
  return {log_share + sum_of(low), log_share + sum_of(high)};
}

}  // namespace palpate
