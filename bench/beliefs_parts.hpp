#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "commands.hpp"
#include "palpate/pose_histogram.hpp"
#include "report.hpp"

namespace palpate::bench {

/// What the parts of `palpate-bench beliefs` work on.
struct BeliefInputs {
  Device& device;
  const std::vector<Hypothesis>& letters;
  const BeliefsOptions& options;

  /// Unknowns of every letter and shape: what the options say, else by size of the run.
  int trials_each(int usual, int quick) const {
    return options.trials.value_or(options.quick ? quick : usual);
  }
};

// Each part measures one uncertainty, adds its cases to the report, and returns the records that
// its charts are drawn from.

/// Touches that lie beside the reported poses, as if exact and averaged.
Json measure_misplaced(const BeliefInputs& inputs, Report& report);
/// Standard deviations of misplaced touches, as the touches alone tell them.
Json measure_touch_sd(const BeliefInputs& inputs, Report& report);
/// "None of these", with exact and with misplaced touches.
Json measure_none(const BeliefInputs& inputs, Report& report);
/// Objects that move between touches.
Json measure_slip(const BeliefInputs& inputs, Report& report);
/// Touches chosen by what they are expected to tell, beside random ones.
Json measure_plan(const BeliefInputs& inputs, Report& report);
/// Time and memory of all these.
Json measure_costs(const BeliefInputs& inputs, Report& report);

/// The charts of a part, by the part's name, in the order in which they are drawn; empty for a part
/// without charts.
std::vector<const char*> belief_figures(const std::string& part);
/// Draws a part's charts from its records, each as PNG and SVG.
/// @throws Error where the disk refuses
void draw_belief_figures(const std::string& part, const Json& records,
                         const std::filesystem::path& folder);

}  // namespace palpate::bench
