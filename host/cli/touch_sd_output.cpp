#include "cli/touch_sd_output.hpp"

#include <fmt/format.h>

#include "cli/options.hpp"
#include "cli/text_table.hpp"

namespace palpate::cli {

namespace {

std::string flags_of(const TouchSdFit& fit) {
  return fmt::format("--touch-sd-mm {:.3g} --touch-sd-deg {:.3g}", fit.sd.mm, degrees(fit.sd.rad));
}

std::string number_of(std::size_t count, const char* one, const char* more) {
  return fmt::format("{} {}", count, count == 1 ? one : more);
}

}  // namespace

void refuse_beside_fit(std::span<const OtherFlag> flags, const RecognitionTask& task) {
  for (const OtherFlag& flag : flags) {
    if (flag.given) {
      refuse(flag.name, "has no meaning with --fit-touch-sd; leave one of them out");
    }
  }
  require_fittable(task);
}

std::string touch_sd_text(const TouchSdFit& fit) {
  TextTable table({{"touch-sd"}, {"value", true}, {"std. error", true}});
  const auto add = [&](const char* what, double sd, double error, const char* unit) {
    table.add({what, sd == 0.0 ? "exact" : fmt::format("{:.3f} {}", sd, unit),
               sd == 0.0 ? "" : fmt::format("{:.3f} {}", error, unit)});
  };
  add("along x and y", fit.sd.mm, fit.standard_error.mm, "mm");
  add("angle", degrees(fit.sd.rad), degrees(fit.standard_error.rad), "deg");
  std::string text = table.text({});
  text += fmt::format("{}, {}; log evidence {:.1f} nats above that of exact poses\n",
                      number_of(fit.unknowns, "unknown", "unknowns"),
                      number_of(fit.touches, "touch", "touches"), fit.evidence_gain);
  if (fit.sd.mm == 0.0 || fit.sd.rad == 0.0) {
    text += fmt::format(
        "exact: below about {:.2g} mm, or {:.2g} deg, which cannot be told from 0 with these maps "
        "and this array\n",
        fit.resolution.mm, degrees(fit.resolution.rad));
  }
  for (const std::string& warning : fit.warnings) {
    text += "warning: " + warning + "\n";
  }
  return text + flags_of(fit) + "\n";
}

nlohmann::ordered_json to_json(const TouchSdFit& fit, const std::string& device) {
  nlohmann::ordered_json json{
      {"touch_sd", {{"mm", fit.sd.mm}, {"deg", degrees(fit.sd.rad)}}},
      {"standard_error", {{"mm", fit.standard_error.mm}, {"deg", degrees(fit.standard_error.rad)}}},
      {"exact", {{"mm", fit.sd.mm == 0.0}, {"deg", fit.sd.rad == 0.0}}},
      {"log_evidence_gain", fit.evidence_gain},
      {"unknowns", fit.unknowns},
      {"touches", fit.touches},
      {"flags", flags_of(fit)},
      {"device", device}};
  if (!fit.warnings.empty()) {
    json["warnings"] = fit.warnings;
  }
  return json;
}

}  // namespace palpate::cli
