#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "recognition/recognition_job.hpp"

namespace palpate {

// The last step of resolve(): the filter and its bins.

/// What every step of resolve() reads of what is asked, and the sentences for the user to which a
/// step may add.
struct Asked {
  const Request& request;
  const Circumstances& of;
  const DeviceSource& device;
  std::vector<std::string> remarks = {};
};

/// The filter that is asked for.
struct FilterWish {
  FilterKind kind = FilterKind::automatic;
  std::string by;  ///< what names it, such as "`filter bounded`" or "filter: bounded in a.yaml"
};
/// @throws Error on options that only another filter reads
FilterWish filter_wish(const Request& request);

struct ChosenFilter {
  FilterOptions options;
  std::string by;  ///< RecognitionTask::filter_chosen_by
};
/// The filter that is wished for, on the bins that are used: those settled before, chosen, or
/// given. Automatic is bounds, but the histogram where objects slip, where an option reads every
/// bin, and where the search would take too much memory.
/// @param histogram what was settled by the steps before
/// @param width by which counts are chosen; none where they are given
/// @throws Error on values out of range, and where the filter has no use for an option
ChosenFilter choose_filter(Asked& asked, const FilterWish& wish,
                           std::span<const Hypothesis> hypotheses, HistogramOptions histogram,
                           std::optional<BinWidth> width);

/// Most bins, of all objects together, that chosen_bins() gives to bounds.
inline constexpr std::int64_t most_bounded_bins = 1'000'000'000;

/// Bins that balanced_lattice() chose.
struct ChosenBins {
  BalancedLattice balanced;
  std::int64_t most_bins = 0;  ///< limit of all objects' bins together
};
/// As many bins as the device's memory holds; most_bounded_bins by bounds.
/// @param device called where its memory is asked for
/// @throws Error as balanced_lattice() does
ChosenBins chosen_bins(const DeviceSource& device, std::span<const Hypothesis> hypotheses,
                       const FilterOptions& filter, BinWidth width);

/// The filter as it is opened for a sensor model. A temperature above 1 and features give also
/// improbable labels a share, for which bounds find each label's evidence: within 0.05 times the
/// temperature of the touches so far, so that no probability is off by more than about 10 % or
/// 1e-4, or closer where BoundedOptions::evidence_nats says so. With a table, a search that meets
/// nothing but poor fits ends, unless it is to honour_tolerance.
FilterOptions with_evidence(FilterOptions filter, const LearnedSensor& sensor,
                            bool honour_tolerance = false);

/// Whether the machine has the memory for a bounded posterior.
/// @throws Error on a lattice out of range
bool bounds_have_room(std::span<const Hypothesis> hypotheses, BoundedOptions options);

}  // namespace palpate
