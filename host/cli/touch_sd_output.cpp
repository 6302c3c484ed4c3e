#include "cli/touch_sd_output.hpp"

#include <algorithm>

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
  if (!traits_of(task.filter).every_bin) {
    refuse("--fit-touch-sd", "particles cannot fit it; use --filter histogram");
  }
  if (!task.touch_sd().none()) {
    refuse("--fit-touch-sd",
           "finds what --touch-sd-mm and --touch-sd-deg, the scene's touch_sd or the sensor model "
           "say already; leave those out");
  }
  if (!task.slip_sd().none()) {
    refuse("--fit-touch-sd",
           "takes objects to rest between touches; leave out --slip-sd-mm and --slip-sd-deg, or "
           "the scene's slip_sd");
  }
  if (task.contact().table) {
    refuse("--fit-touch-sd", "learns a model of the sensor of its own; leave out the sensor model");
  }
  if (task.labels.back() == none_label) {
    refuse("--fit-touch-sd",
           "takes every unknown to be one of the maps' objects; leave out --none, or the scene's "
           "none");
  }
}

std::vector<TouchedObject> touched_objects(std::span<const Recording> recordings,
                                           std::span<const Unknown> unknowns,
                                           const RecognitionTask& task) {
  std::vector<TouchedObject> objects;
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    const std::string& label = recordings[i].object;
    const bool known = std::ranges::find(task.labels, label) != task.labels.end();
    objects.push_back({unknowns[i].recording, unknowns[i].touches, known ? label : ""});
  }
  return objects;
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
