#pragma once

#include <filesystem>
#include <vector>

#include "commands.hpp"
#include "palpate/bounded_posterior.hpp"
#include "palpate/device.hpp"
#include "report.hpp"

namespace palpate::bench {

/// What the parts of `palpate-bench bounded` work on.
struct BoundedInputs {
  Device& device;
  const std::vector<Hypothesis>& letters;
  const BoundedRunOptions& options;

  int unknowns(int usual = 20) const { return options.quick ? 3 : usual; }
};

// Each part adds its cases to the report and returns a record of every run.

/// Nine touches in one update on lattices of 10^4 to 10^7 bins per object, beside the dense engine.
Json measure_bounded_speed(const BoundedInputs& inputs, Report& report);
/// The mode over the poses that scan matchers search, tables included and not.
Json measure_bounded_mode(const BoundedInputs& inputs, Report& report);
/// Touch after touch, each with an estimate, the first within a budget.
Json measure_bounded_streaming(const BoundedInputs& inputs, Report& report);
/// Many objects, far away: time and memory.
Json measure_bounded_large(const BoundedInputs& inputs, Report& report);
/// Time over bins, from 10^4 to 10^9 in all, beside the dense engine.
Json measure_bounded_growth(const BoundedInputs& inputs, Report& report);
/// Certificates beside the distances from the posterior over all bins.
Json measure_bounded_accuracy(const BoundedInputs& inputs, Report& report);
/// Everyday objects from one press each, in a folder of recordings.
/// @throws Error where the folder holds no recording, or one of another array
Json measure_bounded_presses(const BoundedInputs& inputs, Report& report);

/// The chart of measure_bounded_growth(), as PNG and SVG.
inline constexpr const char* growth_figure = "bounded_growth";
/// @throws Error where the disk refuses
void draw_growth(const Json& records, const std::filesystem::path& folder);

}  // namespace palpate::bench
