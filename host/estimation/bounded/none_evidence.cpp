#include "estimation/bounded/none_evidence.hpp"

#include <algorithm>
#include <cmath>

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
  const HypothesisMass all = found.all();
  const double log_bins = std::log(bins);
  mean.log_share = log_bins - std::log(static_cast<double>(options_.lattice.bins()));
  return {log_subtract(all.evaluated, all.rounding) - log_bins,
          log_add(log_add(all.evaluated, all.rounding), all.dropped) - log_bins};
}

void NoneEvidence::narrow(TouchMean& mean, double width_nats, const Deadline& deadline) {
  // What an earlier call found finer does not count: bounds depend on what is asked for.
  mean.log_mean = {-infinity, infinity};
  for (std::size_t i = 0; i < tolerances.size();) {
    if (!mean.found[i]) {
      const LogInterval found = search(mean, tolerances[i], deadline);
      if (deadline.passed()) {
        mean.log_mean = width(found) < width(mean.log_mean) ? found : mean.log_mean;
        return;
      }
      mean.found[i] = found;
    }
    const double before = width(mean.log_mean);
    mean.log_mean = *mean.found[i];
    if (width(mean.log_mean) <= width_nats || width(mean.log_mean) > least_gain * before) {
      return;
    }
    // The first search tells little of what is needed; the others come close to their tolerance.
    for (++i; i + 1 < tolerances.size() && width_of_tolerance * tolerances[i] > width_nats;) {
      ++i;
    }
  }
}

LogInterval NoneEvidence::bounds(double width_nats, const Deadline& deadline) {
  if (means_.empty()) {
    return {};
  }
  for (TouchMean& mean : means_) {
    narrow(mean, width_nats / static_cast<double>(means_.size()), deadline);
  }
  // Added in an order of their own, so that the order of touches shows in no bit.
  const auto sum_of = [&](double LogInterval::*side) {
    std::vector<double> logs;
    for (const TouchMean& mean : means_) {
      logs.push_back(mean.log_mean.*side);
    }
    std::ranges::sort(logs);
    double sum = 0.0;
    for (const double log : logs) {
      sum += log;
    }
    return sum;
  };
  const double log_share = means_.front().log_share;
  return {log_share + sum_of(&LogInterval::low), log_share + sum_of(&LogInterval::high)};
}

}  // namespace palpate
