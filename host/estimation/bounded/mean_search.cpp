#include "estimation/bounded/mean_search.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "estimation/bounded/search/item_bounds.hpp"
#include "estimation/log_sum.hpp"
#include "estimation/parallel_for.hpp"

namespace palpate {

namespace {

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

bool MeanSearch::survey(const Deadline& deadline, bool everywhere) {
  const std::size_t thetas = space_.turns.size();
  counted_.emplace(space_, options_.lattice, rectangle_, everywhere);
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
  if (bins == 0 && !everywhere) {
    // Where no pose of the region brings the array to an object, all poses are alike.
    return survey(deadline, true);
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

}  // namespace palpate
