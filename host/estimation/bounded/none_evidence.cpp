#include "estimation/bounded/none_evidence.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>
#include <tuple>

#include "estimation/known_elements.hpp"

namespace palpate {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
/// Bounds that a closer search leaves wider than this part are rounding.
constexpr double least_gain = 0.9;

/// What the searches of a touch leave out at most, in nats above a lower bound of its mean,
/// once that comes near.
constexpr std::array<double, 7> left_out_nats{0.0, -3.0, -6.5, -10.0, -14.0, -18.0, -22.0};
/// From this one on, a search that narrows bounds by little has come to rounding.
constexpr std::size_t first_at_rounding = 3;
/// The mean lies below the bounds of the largest tiles by about so large a part of these, in nats.
/// That is where the second search looks first, but no farther down than gains as much as it costs.
constexpr double usual_gap = 0.6;
constexpr double least_gap_nats = 2.0;
constexpr double most_gap_nats = 10.0;
/// Where so many searches found no likelihood, none is above e^-10^10: there may be none at all.
constexpr std::size_t most_in_vain = 32;

double width(const LogInterval& of) { return of.high - of.low; }

}  // namespace

void NoneEvidence::add(std::span<const TouchEvidence> touches) {
  std::vector<TouchMean> added;
  for (const TouchEvidence& touch : touches) {
    // A touch without a known element does not even tell where the array was.
    if (const KnownElements known = known_elements(touch, options_); !known.runs.empty()) {
      double high = -infinity;
      for (const TileBounds& of : space_.bounds) {
        high = std::max(high, of.best(0, known));
      }
      added.push_back(
          {.search = {space_, options_, likelihood_, touch, known}, .found = {{-infinity, high}}});
    }
  }
  means_.reserve(means_.size() + added.size());
  std::ranges::move(added, std::back_inserter(means_));
}

std::uint64_t NoneEvidence::bytes() const {
  std::uint64_t bytes = 0;
  for (const TouchMean& mean : means_) {
    bytes += mean.search.bytes() + mean.found.capacity() * sizeof(LogInterval);
  }
  return bytes;
}

bool NoneEvidence::search(TouchMean& mean, const Deadline& deadline) {
  const LogInterval last = mean.found.back();
  const std::size_t before = mean.found.size() - 1;  // searches
  double least = infinity;
  bool close = false;
  if (before > 0) {
    // Where bounds are far from the mean, it is looked for twice as far below each time.
    const double gap = std::clamp(-usual_gap * mean.found[1].high, least_gap_nats, most_gap_nats);
    const double by_low = last.low + left_out_nats.at(mean.close_searches);
    const double by_high = last.high - std::ldexp(gap, static_cast<int>(before) - 1);
    close = by_low >= by_high;
    least = close ? by_low : by_high;
  }
  const bool at_rounding = close && mean.close_searches >= first_at_rounding;
  const std::optional<LogInterval> found = mean.search.bounds(least, deadline);
  if (!found) {
    return false;
  }
  mean.close_searches += close ? 1 : 0;
  const LogInterval closer{std::max(last.low, found->low), std::min(last.high, found->high)};
  mean.found.push_back(closer);
  mean.closest = mean.close_searches == left_out_nats.size() ||
                 (before + 1 >= most_in_vain && closer.low == -infinity) ||
                 (at_rounding && width(closer) > least_gain * width(last));
  return true;
}

LogInterval NoneEvidence::bounds(const Enough& enough, const Deadline& deadline) {
  if (means_.empty()) {
    return {};
  }
  // What an earlier call found closer does not count: bounds depend on what is asked for.
  std::vector<std::size_t> searches(means_.size());
  const auto of = [&](std::size_t i) { return means_[i].found[searches[i]]; };
  const auto sum = [&] {
    // Added in an order of their own, so that the order of touches shows in no bit.
    std::vector<double> low;
    std::vector<double> high;
    for (std::size_t i = 0; i < means_.size(); ++i) {
      low.push_back(of(i).low);
      high.push_back(of(i).high);
    }
    std::ranges::sort(low);
    std::ranges::sort(high);
    const double log_share = means_.front().search.log_share();
    return LogInterval{std::accumulate(low.begin(), low.end(), log_share),
                       std::accumulate(high.begin(), high.end(), log_share)};
  };
  for (;;) {
    // Where several touches are not known from below, the one that tells most costs least.
    std::optional<std::size_t> worst;
    const auto badness = [&](std::size_t i) {
      return std::tuple(searches[i] == 0, width(of(i)), -of(i).high);
    };
    for (std::size_t i = 0; i < means_.size(); ++i) {
      const bool closest = means_[i].closest && searches[i] + 1 == means_[i].found.size();
      if (!closest && (!worst || badness(i) > badness(*worst))) {
        worst = i;
      }
    }
    const LogInterval all = sum();
    if (!worst || enough(all) ||
        (searches[*worst] + 1 == means_[*worst].found.size() &&
         !search(means_[*worst], deadline))) {
      return all;
    }
    ++searches[*worst];
  }
}

}  // namespace palpate
