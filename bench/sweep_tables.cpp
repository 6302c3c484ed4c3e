#include <fmt/format.h>

#include "sweep_page.hpp"

namespace palpate::bench {

namespace {

/// "0.316 to 0.238 (-25 %)".
std::string step_text(const Json& step) {
  const double from = step.at("from");
  const double to = step.at("to");
  return fmt::format("{:.3f} to {:.3f} ({:+.0f} %)", from, to,
                     from > 0.0 ? 100.0 * (to / from - 1.0) : 0.0);
}

const Text millimetres = number_text("{:.3f}");
const Text nats = number_text("{:.1e}");

}  // namespace

std::vector<Column> run_columns() {
  return {{"filter", "/filter"},
          {"map cells, mm", "/cell_mm"},
          {"bins per object, or particles", "/count", count_text},
          {"bins", "/bins"},
          {"trials", "/trials"},
          {"in full", "/full_trials"},
          {"time per touch", "/seconds_per_touch", seconds_text},
          {"per unknown", "/seconds_per_unknown", seconds_text},
          {"per refined pose", "/seconds_refine", seconds_text},
          {"memory, MiB", "/device_bytes", number_text("{:.1f}", 1.0 / (1 << 20))},
          {"recognised, %", "/accuracy", number_text("{:.0f}", 100.0)},
          {"calibration error", "/expected_calibration_error", millimetres},
          {"located", "/error_mm/trials"},
          {"mode: mean error, mm", "/error_mm", mean_text},
          {"95 %", "/error_mm/p95", millimetres},
          {"refined: mean error, mm", "/refined_error_mm", mean_text},
          {"95 %", "/refined_error_mm/p95", millimetres},
          {"nearest bin, mm", "/nearest_bin_mm", millimetres},
          {"largest deviation, nats", "/deviation_nats/largest", nats},
          {"RMS", "/deviation_nats/rms", nats},
          {"mode: median, mm", "/error_mm/median", millimetres},
          {"refined: median, mm", "/refined_error_mm/median", millimetres},
          {"least probability", "/least_confidence", number_text("{:.6f}")},
          {"evaluated by", "/path"}};
}

std::vector<Column> precision_columns() {
  return {{"evaluated by", "/path"},
          {"bins per object", "/count", count_text},
          {"ns per pose, element and touch", "/nanoseconds", number_text("{:.2f}")},
          {"largest deviation, nats", "/deviation_nats/largest", nats},
          {"RMS", "/deviation_nats/rms", nats}};
}

std::vector<Column> bounds_columns() {
  return {{"bins per object", "/count", count_text},
          {"bins in all", "/bins_in_all", count_text},
          {"trials", "/trials"},
          {"histogram, asked once", "/histogram/once", seconds_text},
          {"bounded", "/bounded/once", seconds_text},
          {"histogram, after each touch", "/histogram/each_touch", seconds_text},
          {"bounded", "/bounded/each_touch", seconds_text},
          {"bins evaluated", "/bins_evaluated", count_text},
          {"of all, %", "/share_evaluated", number_text("{:.3g}", 100.0)},
          {"certificate", "/certificate", number_text("{:.1e}")},
          {"measured error", "/measured_error", number_text("{:.1e}")},
          {"certificates that hold", "/certificates_hold"},
          {"same mode", "/same_modes"},
          {"host memory, MiB", "/host_bytes", number_text("{:.1f}", 1.0 / (1 << 20))},
          {"--filter auto takes", "/auto"},
          {"the faster one", "/auto_is_faster"}};
}

std::vector<Column> limit_columns() {
  return {{"what is changed", "/name"},
          {"elements", "/elements"},
          {"bins per object", "/count", count_text},
          {"mode: mean error, mm", "/error_mm", mean_text},
          {"refined: mean error, mm", "/refined_error_mm", mean_text},
          {"compared with", "/against"},
          {"mode: difference, mm", "/difference_mm", difference_text},
          {"refined: difference, mm", "/refined_difference_mm", difference_text}};
}

std::vector<Column> step_columns() {
  return {{"map cells, mm", "/cell_mm"},
          {"from bins", "/from", count_text},
          {"to bins", "/to", count_text},
          {"trials", "/trials"},
          {"mode: mean error, mm", "/error_mm", step_text},
          {"difference, mm", "/error_mm", difference_text},
          {"refined: mean error, mm", "/refined_error_mm", step_text},
          {"difference, mm", "/refined_error_mm", difference_text}};
}

std::vector<Column> verdict_columns() {
  return {{"goal", "/name"},
          {"measured, mm", "/value", millimetres},
          {"at most", "/at_most"},
          {"reached", "/reached"}};
}

Json steps_of(const Json& document) {
  Json steps = Json::array();
  for (const Json& knee : document.at("knees")) {
    steps.insert(steps.end(), knee.at("steps").begin(), knee.at("steps").end());
  }
  return steps;
}

}  // namespace palpate::bench
