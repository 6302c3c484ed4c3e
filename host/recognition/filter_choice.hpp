#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "palpate/learned_sensor.hpp"
#include "recognition/resolve.hpp"

namespace palpate {

// The part of resolve() that chooses the filter and its bins, and says how far touches may be
// displaced and how closely bounds find the evidence.

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
/// filter_for_bins() where neither is wished for and nothing needs the histogram. Objects that slip
/// need it.
/// @param every_bin_for see Circumstances
/// @param histogram with the lattice, the contact model, the weight of "(none)", and the sensor
/// model's touch_sd
/// @throws Error on values out of range, and where the filter has no use for an option
ChosenFilter choose_filter(const FilterWish& wish, const Request& request,
                           const std::string& every_bin_for, HistogramOptions histogram);

/// An axis of one bin limits nothing.
/// @param lattice with the counts that are used, or with one bin where these are not known yet
/// @throws Error where a standard deviation is wider than the region
void require_within_region(const Request& request, const PoseLattice& lattice);

/// Most bins, of all objects together, for which `auto` takes the histogram: up to here it answers
/// quickly, and takes no longer where nothing fits. Above it, bounds answer much sooner where
/// something does.
inline constexpr std::int64_t most_histogram_bins = 100'000;

/// Most bins, of all objects together, that chosen_bins() gives to bounds.
inline constexpr std::int64_t most_bounded_bins = 1'000'000'000;

/// Bins that balanced_lattice() chose.
struct ChosenBins {
  BalancedLattice balanced;
  std::int64_t most_bins = 0;  ///< limit of all objects' bins together
};
/// As many bins as the device's memory holds; most_bounded_bins where bounds are or may become the
/// filter.
/// @param device called where its memory is asked for
/// @throws Error as balanced_lattice() does
ChosenBins chosen_bins(const DeviceSource& device, std::span<const Hypothesis> hypotheses,
                       const ChosenFilter& filter, BinWidth width);

/// Bounds in the place of a histogram of more than `most_bins` bins in all, unless
/// bounded_instead() has none or bounds have no room.
/// @throws Error on a lattice out of range
FilterOptions filter_for_bins(std::span<const Hypothesis> hypotheses, const FilterOptions& filter,
                              std::int64_t most_bins = most_histogram_bins);

/// The filter as it is opened for a sensor model. A temperature above 1 and features give also
/// improbable labels a share, for which bounds find each label's evidence: within 0.05 times the
/// temperature of the touches so far, so that no probability is off by more than about 10 % or
/// 1e-4, or closer where BoundedOptions::evidence_nats says so. With a table, a search that meets
/// nothing but poor fits ends, unless it is to honour_tolerance.
FilterOptions with_evidence(FilterOptions filter, const LearnedSensor& sensor,
                            bool honour_tolerance = false);

/// Whether the machine has room for a bounded posterior.
/// @throws Error on a lattice out of range
bool bounds_have_room(std::span<const Hypothesis> hypotheses, BoundedOptions options);

}  // namespace palpate
