#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "palpate/pose.hpp"
#include "recognition/request.hpp"

namespace palpate {

// Options as texts, as flags, manifests and task files have them. What reads a text throws Error
// naming `what` the text is of, the text and the form wanted.

/// "X,Y,DEG"
Pose parse_pose(const std::string& what, const std::string& text);

void read_option(const std::string& what, const std::string& text, std::string& value);
void read_option(const std::string& what, const std::string& text, double& value);
void read_option(const std::string& what, const std::string& text, int& value);
void read_option(const std::string& what, const std::string& text, std::uint64_t& value);
/// "true" or "false"
void read_option(const std::string& what, const std::string& text, bool& value);
/// "LOWER:UPPER"
void read_option(const std::string& what, const std::string& text, std::array<double, 2>& value);
/// "A:B" with A < B
void read_option(const std::string& what, const std::string& text, Frames& value);
/// "25x25x16", "auto" or "fine"
void read_option(const std::string& what, const std::string& text, Bins& value);
/// "X,Y" or "auto"
void read_option(const std::string& what, const std::string& text, Pivot& value);
/// A number above 0, or "auto"
void read_option(const std::string& what, const std::string& text, NoneWeight& value);
void read_option(const std::string& what, const std::string& text, FilterKind& value);
void read_option(const std::string& what, const std::string& text, Resampling& value);
template <typename Value>
void read_option(const std::string& what, const std::string& text, std::optional<Value>& value) {
  read_option(what, text, value.emplace());
}

/// Calls visit(option, member) for each option of a request apart from its maps and its device.
template <typename AnyRequest, typename Visit>
void visit_options(AnyRequest& request, const Visit& visit) {
  visit("scene", request.scene);
  visit("sensor-model", request.sensor_model);
  visit("bins", request.bins);
  visit("x-mm", request.x_mm);
  visit("y-mm", request.y_mm);
  visit("theta-deg", request.theta_deg);
  visit("pivot-mm", request.pivot_mm);
  visit("prior", request.prior);
  visit("gamma", request.gamma);
  visit("threshold", request.threshold);
  visit("ratio", request.ratio);
  visit("touch-sd-mm", request.touch_sd_mm);
  visit("touch-sd-deg", request.touch_sd_deg);
  visit("slip-sd-mm", request.slip_sd_mm);
  visit("slip-sd-deg", request.slip_sd_deg);
  visit("none", request.none);
  visit("filter", request.filter);
  visit("tolerance", request.tolerance);
  visit("budget-ms", request.budget_ms);
  visit("evidence-nats", request.evidence_nats);
  visit("act-below-mm", request.act_below_mm);
  visit("act-above", request.act_above);
  visit("particles", request.particles);
  visit("resampling", request.resampling);
  visit("augmented", request.augmented);
  visit("seed", request.seed);
  visit("frames", request.frames);
  visit("touches", request.touches);
  visit("each-frame", request.each_frame);
  visit("trace", request.trace);
}

/// [option] the text of each option that visit_options() knows and that differs from the default.
std::map<std::string, std::string> option_texts(const Request& request);
/// The request with the options of such texts. @throws Error on an option or text that is not known
Request request_with(const std::map<std::string, std::string>& texts);

}  // namespace palpate
