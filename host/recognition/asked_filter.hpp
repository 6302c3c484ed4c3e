#pragma once

#include <span>
#include <string>

#include "recognition/resolve.hpp"

namespace palpate {

// The part of resolve() that chooses the filter and says how far touches may be displaced.

/// The filter that is asked for.
struct FilterWish {
  FilterKind kind = FilterKind::automatic;
  std::string by;  ///< what names it, such as "`filter bounded`" or "filter: bounded in a.yaml"
};

/// @throws Error on options that only another filter reads
FilterWish filter_wish(const Request& request);

struct ChosenFilter {
  FilterOptions options;
  bool automatic = false;    ///< RecognitionTask::auto_filter
  std::string asked_for_by;  ///< RecognitionTask::filter_asked_for_by
};

/// The options of the filter that is wished for. Leaves the choice between histogram and bounds to
/// settle_filter() where neither is wished for and nothing needs the histogram.
/// @param histogram with the lattice, the contact model, and the sensor model's touch_sd
/// @throws Error on values out of range, and where the filter has no use for an option
ChosenFilter choose_filter(const FilterWish& wish, const Request& request,
                           const HistogramNeed& of_caller, std::span<const Hypothesis> hypotheses,
                           HistogramOptions histogram);

/// An axis of one bin limits nothing.
/// @param lattice with the counts that are used, or with one bin where these are not known yet
/// @throws Error where a standard deviation is wider than the region
void require_within_region(const Request& request, const PoseLattice& lattice);

}  // namespace palpate
