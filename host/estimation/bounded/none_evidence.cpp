#include "estimation/bounded/none_evidence.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "estimation/bounded/search/item_bounds.hpp"
#include "estimation/log_sum.hpp"
#include "estimation/parallel_for.hpp"

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
/// Memory for what searches keep of all touches.
constexpr std::size_t most_kept_bytes = std::size_t{32} << 20;

double width(const LogInterval& of) { return of.high - of.low; }

/// What the sums of an object's largest tiles need at most, in bytes.
std::size_t bytes_of_sums(const SearchSpace& space, const TileBounds& bounds) {
  const TileLevel& level = bounds.levels().front();
  const auto tiles = [](const TileAxis& axis) { return static_cast<std::size_t>(axis.tiles()); };
  return space.turns.size() * tiles(level.x) * tiles(level.y) *
         sizeof(PlaneDivision::LargestSums::value_type);
}

}  // namespace

MeanSearch::MeanSearch(const SearchSpace& space, const BoundedOptions& options,
                       const BinLikelihood& likelihood, const TouchEvidence& touch,
                       KnownElements known, std::size_t most_bytes)
    : space_(space),
      options_(options),
      likelihood_(likelihood),
      elements_(std::move(known)),
      rectangle_(
          array_rectangle(touch.T_robot_sensor, touch.elements_mm, options.lattice.pivot_mm)),
      reaches_(undisplaced_reaches(elements_, space.turns)),
      unpenalised_(unpenalised(space, elements_)),
      prior_log_likelihood_(
          prior_log_likelihoods(elements_, options.contact, space.bounds.size())) {
  std::size_t bytes = 0;
  for (const TileBounds& bounds : space.bounds) {
    bytes += bytes_of_sums(space, bounds);
  }
  keep_sums_ = bytes <= most_bytes;
  for (std::size_t i = 0; i < space.bounds.size(); ++i) {
    prior_log_likelihood_[i] += space.log_weight[i];
    errors_.push_back(likelihood.undisplaced_error(i, elements_));
  }
}

std::uint64_t MeanSearch::bytes() const {
  std::uint64_t bytes = surveys_.capacity() * sizeof(PlaneSurvey);
  for (const PlaneDivision::LargestSums& sums : sums_) {
    bytes += sizeof(PlaneDivision::LargestSums) +
             sums.capacity() * sizeof(PlaneDivision::LargestSums::value_type);
  }
  return bytes;
}

template <typename Work>
bool MeanSearch::for_planes(const Deadline& deadline, const Work& work) const {
  constexpr std::size_t together = 8;
  constexpr std::size_t tasks_between_deadlines = 1024;
  const std::size_t thetas = space_.turns.size();
  const std::size_t of_object = (thetas + together - 1) / together;
  const std::size_t tasks = of_object * space_.bounds.size();
  for (std::size_t begin = 0; begin < tasks; begin += tasks_between_deadlines) {
    if (deadline.passed()) {
      return false;
    }
    parallel_for(std::min(tasks_between_deadlines, tasks - begin), [&](std::size_t i) {
      const std::size_t task = begin + i;
      const std::size_t first = task % of_object * together;
      work(task / of_object, first, std::min(first + together, thetas));
    });
  }
  return true;
}

bool MeanSearch::survey(const Deadline& deadline) {
  const std::size_t thetas = space_.turns.size();
  const MeanTask task = this->task();
  std::vector<PlaneSurvey> surveys(space_.bounds.size() * thetas);
  std::vector<PlaneDivision::LargestSums> sums(surveys.size());
  if (!for_planes(deadline, [&](std::size_t object, std::size_t first, std::size_t end) {
        PlaneDivision planes(task, object);
        for (std::size_t theta = first; theta < end; ++theta) {
          const std::size_t i = object * thetas + theta;
          surveys[i] = planes.survey(static_cast<int>(theta), sums[i]);
          if (!keep_sums_) {
            sums[i] = {};
          }
        }
      })) {
    return false;
  }
  std::int64_t bins = 0;
  double weighted = 0.0;
  for (std::size_t i = 0; i < surveys.size(); ++i) {
    bins += surveys[i].bins;
    weighted += std::exp(space_.log_weight[i / thetas]) * static_cast<double>(surveys[i].bins);
  }
  if (bins == 0 && !everywhere_) {
    // Where no pose of the region brings the array to an object, all poses are alike.
    everywhere_ = true;
    return survey(deadline);
  }
  surveys_ = std::move(surveys);
  sums_ = std::move(sums);
  log_bins_ = std::log(static_cast<double>(bins));
  log_weighted_bins_ = std::log(weighted);
  log_share_ = log_weighted_bins_ - std::log(static_cast<double>(options_.lattice.bins()));
  return true;
}

std::optional<LogInterval> MeanSearch::bounds(double least, const Deadline& deadline) {
  if (surveys_.empty() && !survey(deadline)) {
    return {};
  }
  // The mean is of so many bins, each with its object's weight.
  const double least_of_bin = least + log_weighted_bins_ - log_bins_;
  const MeanTask task = this->task();
  const std::size_t thetas = space_.turns.size();
  std::vector<double> left_out(surveys_.size());
  std::vector<double> evaluated(surveys_.size(), nothing);
  if (!for_planes(deadline, [&](std::size_t object, std::size_t first, std::size_t end) {
        PlaneDivision planes(task, object);
        for (std::size_t theta = first; theta < end; ++theta) {
          const std::size_t i = object * thetas + theta;
          left_out[i] = surveys_[i].best < least_of_bin
                            ? surveys_[i].left_out
                            : planes.divide(static_cast<int>(theta), least_of_bin, sums_[i]);
        }
        evaluated[object * thetas + first] = planes.evaluated();
      })) {
    return {};
  }
  LogSum low;
  LogSum high;
  for (std::size_t i = 0; i < surveys_.size(); ++i) {
    const std::size_t object = i / thetas;
    const double error = errors_[object];
    low.add(evaluated[i] - error);
    high.add(evaluated[i] + error);
    high.add(left_out[i]);
    if (surveys_[i].off_map > 0) {
      // Where every element sees the prior, all bins have the same likelihood.
      const double off_map =
          prior_log_likelihood_[object] + std::log(static_cast<double>(surveys_[i].off_map));
      low.add(off_map - error);
      high.add(off_map + error);
    }
  }
  const double log_low = low.log() - log_weighted_bins_;
  const double log_high = high.log() - log_weighted_bins_;
  // Each exponential and each addition of the sums rounds by a few units of 2^-53, as logs do.
  const double terms = std::exp(log_bins_) + static_cast<double>(surveys_.size());
  const double rounding = 4.0 * (terms + std::abs(log_high)) * 0x1p-53;
  return LogInterval{log_low - rounding, log_high + rounding};
}

void NoneEvidence::add(std::span<const TouchEvidence> touches) {
  std::vector<TouchMean> added;
  const std::size_t most_bytes =
      most_kept_bytes / std::max<std::size_t>(means_.size() + touches.size(), 1);
  for (const TouchEvidence& touch : touches) {
    // A touch without a known element does not even tell where the array was.
    if (const KnownElements known = known_elements(touch, options_); !known.runs.empty()) {
      TouchMean& mean = added.emplace_back(
          TouchMean{.search = {space_, options_, likelihood_, touch, known, most_bytes}});
      for (const TileBounds& of : space_.bounds) {
        mean.before.high = std::max(mean.before.high, of.best(0, known));
      }
    }
  }
  means_.reserve(means_.size() + added.size());
  for (TouchMean& mean : added) {
    means_.push_back(std::move(mean));
  }
}

std::uint64_t NoneEvidence::bytes() const {
  std::uint64_t bytes = 0;
  for (const TouchMean& mean : means_) {
    bytes += mean.search.bytes();
  }
  return bytes;
}

bool NoneEvidence::search(TouchMean& mean, const Deadline& deadline) {
  double least = infinity;
  bool close = false;
  if (!mean.found.empty()) {
    // Where bounds are far from the mean, it is looked for twice as far below each time.
    const double gap =
        std::clamp(-usual_gap * mean.found.front().high, least_gap_nats, most_gap_nats);
    const LogInterval& last = mean.found.back();
    const double by_low = last.low + left_out_nats.at(mean.close_searches);
    const double by_high = last.high - std::ldexp(gap, static_cast<int>(mean.found.size()) - 1);
    close = by_low >= by_high;
    least = close ? by_low : by_high;
  }
  const bool at_rounding = close && mean.close_searches >= first_at_rounding;
  const std::optional<LogInterval> found = mean.search.bounds(least, deadline);
  if (!found) {
    return false;
  }
  const LogInterval last = mean.found.empty() ? mean.before : mean.found.back();
  mean.close_searches += close ? 1 : 0;
  mean.found.push_back({std::max(last.low, found->low), std::min(last.high, found->high)});
  mean.closest = mean.close_searches == left_out_nats.size() ||
                 (mean.found.size() >= most_in_vain && mean.found.back().low == -infinity) ||
                 (at_rounding && width(mean.found.back()) > least_gain * width(last));
  return true;
}

LogInterval NoneEvidence::bounds(const Enough& enough, const Deadline& deadline) {
  if (means_.empty()) {
    return {};
  }
  // What an earlier call found closer does not count: bounds depend on what is asked for.
  std::vector<std::size_t> searches(means_.size());
  const auto of = [&](std::size_t i) {
    return searches[i] == 0 ? means_[i].before : means_[i].found[searches[i] - 1];
  };
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
      const bool closest = means_[i].closest && searches[i] == means_[i].found.size();
      if (!closest && (!worst || badness(i) > badness(*worst))) {
        worst = i;
      }
    }
    const LogInterval all = sum();
    if (!worst || enough(all) ||
        (searches[*worst] == means_[*worst].found.size() && !search(means_[*worst], deadline))) {
      return all;
    }
    ++searches[*worst];
  }
}

}  // namespace palpate
