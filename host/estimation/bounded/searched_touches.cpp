#include "estimation/bounded/searched_touches.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include <fmt/format.h>
#include <tbb/info.h>

#include "estimation/bounded/displaced/undisplaced_bins.hpp"
#include "estimation/hypotheses.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

SearchedTouches::SearchedTouches(std::span<const Hypothesis> hypotheses,
                                 const BoundedOptions& options)
    : options_(options),
      hypotheses_(hypotheses.begin(), hypotheses.end()),
      // More threads than cores gain nothing.
      threads_(options.threads > 0 ? std::min(options.threads, tbb::info::default_concurrency())
                                   : tbb::info::default_concurrency()),
      arena_(threads_),
      likelihood_(hypotheses_, options_.contact, options_.lattice, options_.touch_sd),
      space_(arena_.execute([&] { return SearchSpace(hypotheses_, options_); })),
      search_(space_, options_, likelihood_) {
  if (options_.none_weight) {
    none_.emplace(space_, options_, likelihood_);
    none_log_weight_ =
        palpate::none_log_weight(*options_.none_weight, hypotheses_, options_.lattice);
  }
}

void SearchedTouches::reset() {
  change_.forget();
  touches_.clear();
  taken_in_ = 0;
  informative_ = 0;
  elements_ = {};
  search_.largest().reset();
  if (none_) {
    none_->reset();
  }
}

void SearchedTouches::move_pivot(const glm::dvec2& pivot_mm) {
  options_.lattice = with_pivot(options_.lattice, pivot_mm, "bounded posterior", taken_in_ > 0);
  likelihood_.move_pivot(pivot_mm);
}

bool SearchedTouches::waiting() const {
  change_.refuse();
  return taken_in_ < touches_.size();
}

void SearchedTouches::take_in() {
  change_.change([&] {
    const std::span<const TouchEvidence> added = touches_.all().subspan(taken_in_);
    std::vector<KnownElements> known;
    for (const TouchEvidence& touch : added) {
      known.push_back(known_elements(touch, options_));
      for (KnownElements& displaced : known.back().touches) {
        displaced.undisplaced_bins = std::make_shared<UndisplacedBins>(
            hypotheses_.size(), space_.turns.size(), UndisplacedBins::most_bytes / touches_.size());
      }
    }
    arena_.execute([&] { search_.largest().add(known); });
    known.insert(known.begin(), std::move(elements_));
    elements_ = merged(known);
    if (none_) {
      none_->add(added);
    }
    taken_in_ = touches_.size();
    informative_ += static_cast<std::size_t>(std::ranges::count_if(added, &TouchEvidence::tells));
  });
}

std::string SearchedTouches::path() const {
  return fmt::format("{} on {} thread{}", likelihood_.instructions(), threads_,
                     threads_ == 1 ? "" : "s");
}

std::uint64_t SearchedTouches::bytes() const {
  std::uint64_t undisplaced_bins = 0;
  for (const KnownElements& touch : elements_.touches) {
    undisplaced_bins += touch.undisplaced_bins->bytes();
  }
  return undisplaced_bins + likelihood_.bytes() + space_.bytes() + search_.largest().bytes() +
         (none_ ? none_->bytes() : 0);
}

SearchResult SearchedTouches::search(const SearchGoal& goal, const Deadline& deadline,
                                     const BinVisitor& visitor, std::vector<PoseBlock>* refined) {
  return arena_.execute([&] { return search_.run(elements_, goal, deadline, visitor, refined); });
}

std::vector<double> SearchedTouches::log_likelihood(std::span<const BinBox> boxes) const {
  std::size_t bins = 0;
  for (const BinBox& box : boxes) {
    bins += static_cast<std::size_t>(box.bins());
  }
  std::vector<double> logs(bins);
  arena_.execute([&] { likelihood_.evaluate(boxes, elements_, logs); });
  return logs;
}

LogInterval SearchedTouches::bound_none(const NoneEvidence::Enough& enough,
                                        const Deadline& deadline) {
  const auto weighted = [&](const LogInterval& bounds) {
    return LogInterval{none_log_weight_ + bounds.low, none_log_weight_ + bounds.high};
  };
  return arena_.execute([&] {
    return weighted(none_->bounds(
        [&](const LogInterval& bounds) { return enough(weighted(bounds)); }, deadline));
  });
}

}  // namespace palpate
