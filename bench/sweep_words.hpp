#pragma once

#include <string>
#include <vector>

#include "sweep_result.hpp"

namespace palpate::bench {

/// A count such as 100, 17.5 k or 1 M.
std::string count_text(double count);
/// Seconds with a unit and a prefix.
std::string seconds_text(double seconds);
/// A mean with its standard error, in mm; a dash for none.
std::string mean_text(const std::optional<ErrorsOverTrials>& errors);

/// Where bins suffice for maps of one cell size, and what more or fewer than --bins auto takes do.
/// `runs` are by rising count.
std::string knee_sentence(const CellFinding& finding, const std::vector<SweepPoint>& runs);

/// How well windows agree with the full posterior; empty where there are none.
std::string window_sentence(const SweepResult& result);

/// By how much more a limit errs than what it is compared with, with the standard error; a dash
/// where it is compared with nothing.
std::string difference_text(const SweepResult& result, const Limit& limit, PoseKind kind);
/// What it is compared with; a dash for nothing.
std::string against_text(const SweepResult& result, const Limit& limit);

}  // namespace palpate::bench
