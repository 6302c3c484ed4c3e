#include "estimation/bounded/checked_options.hpp"

#include <cmath>
#include <string>

#include <fmt/format.h>

#include "estimation/bounded/search_memory.hpp"
#include "estimation/displacement_check.hpp"
#include "estimation/hypotheses.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

void refuse(const char* field, double value, const char* remedy) {
  throw Error(Fault::input, fmt::format("{} = {}: give {}", field, value, remedy));
}

/// @throws Error on an option out of range
void validate(const BoundedOptions& options) {
  const auto positive = [](double value) { return value > 0.0 && std::isfinite(value); };
  require_tolerance(options.tolerance);
  if (options.budget_s && !positive(*options.budget_s)) {
    refuse("budget_s", *options.budget_s, "a positive number of seconds, or none");
  }
  if (options.evidence_nats && !positive(*options.evidence_nats)) {
    refuse("evidence_nats", *options.evidence_nats, "a positive number of nats, or none");
  }
  if (!(options.evidence_growth >= 0.0 && std::isfinite(options.evidence_growth))) {
    refuse("evidence_growth", options.evidence_growth, "a number from 0");
  }
  if (options.none_weight && !positive(*options.none_weight)) {
    refuse("none_weight", *options.none_weight, "a positive number, or none");
  }
  if (options.threads < 0) {
    refuse("threads", options.threads, "at least 1, or 0 for all cores");
  }
}

}  // namespace

void require_tolerance(double tolerance) {
  if (!(tolerance > 0.0 && tolerance < 1.0)) {
    refuse("tolerance", tolerance, "a share of the mass between 0 and 1, such as 1e-6");
  }
}

BoundedOptions checked(const BoundedOptions& options, std::span<const Hypothesis> hypotheses) {
  validate_hypotheses(hypotheses);
  validate(options);
  BoundedOptions all = options;
  all.lattice.collapse_fixed().validate();
  validate_displacement(all.touch_sd, all.lattice, "touch_sd");
  all.contact = resolve(options.contact, hypotheses);
  if (const std::string why = why_no_room(hypotheses, all, memory_for_search()); !why.empty()) {
    throw Error(Fault::input, why);
  }
  return all;
}

}  // namespace palpate
