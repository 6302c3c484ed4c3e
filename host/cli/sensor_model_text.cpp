#include "cli/sensor_model_text.hpp"

#include <fmt/format.h>

#include "cli/options.hpp"

namespace palpate::cli {

namespace {

std::string table_text(const LearnedTable& table) {
  return fmt::format("{} levels over {}; {} object(s) with numbers of their own", table.levels(),
                     table.layer.of == MapLayer::log_odds ? "log odds" : "mean levels",
                     table.objects.size());
}

/// "0.8 x 0.8 mm x 22.5 deg"
std::string steps_text(const BinSteps& steps) {
  return fmt::format("{:.3g} x {:.3g} mm x {:.3g} deg", steps.x_mm, steps.y_mm,
                     degrees(steps.theta_rad));
}

}  // namespace

std::string sensor_model_text(const LearnedSensor& sensor) {
  const std::string unit = sensor.pressure_unit == "kPa" ? " kPa" : "";
  std::string text;
  const auto add = [&](const char* name, const std::string& words) {
    text += fmt::format("  {:<17} {}\n", name, words);
  };
  add("pressures", sensor.pressure_unit == "kPa" ? "kPa" : "raw");
  add("noise", fmt::format("{:.4g}{}", sensor.noise, unit));
  add("threshold", fmt::format("{:.4g}{}, ratio {:.4g}", sensor.classifier.threshold, unit,
                               sensor.classifier.ratio));
  add("gamma",
      fmt::format("{:.4g}{}", sensor.gamma, sensor.table ? ", not used beside the table" : ""));
  add("maps",
      fmt::format("prior {:.4g}, spread {:.4g} mm{}", sensor.prior, sensor.spread_mm,
                  sensor.psf_mm ? fmt::format(", point spread {:.4g} mm", *sensor.psf_mm) : ""));
  if (!sensor.touch_sd.none()) {
    add("touch sd",
        fmt::format("{:.4g} mm, {:.4g} deg", sensor.touch_sd.mm, degrees(sensor.touch_sd.rad)));
  }
  add("likelihood", sensor.table ? "table of " + table_text(*sensor.table) : "Eq. 7");
  add("temperature", sensor.temperature_growth > 0.0
                         ? fmt::format("{:.4g}, and {:.4g} more for every further touch",
                                       sensor.temperature, sensor.temperature_growth)
                         : fmt::format("{:.4g}", sensor.temperature));
  if (sensor.bins) {
    add("learned on bins", steps_text(*sensor.bins));
  }
  if (sensor.features) {
    add("press features", fmt::format("weight {:.4g}, of {} object(s)", sensor.features->weight,
                                      sensor.features->objects.size()));
  }
  if (sensor.familiarity) {
    add("familiarity", fmt::format("1 / (1 + exp(-({:.4g} + {:.4g} explained + {:.4g} lead)))",
                                   sensor.familiarity->offset, sensor.familiarity->explained_slope,
                                   sensor.familiarity->lead_slope));
  }
  if (sensor.fit_scale) {
    add("fit scale", fmt::format("z of learned objects {:.4g} +- {:.4g}", sensor.fit_scale->mean,
                                 sensor.fit_scale->sd));
  }
  return text;
}

}  // namespace palpate::cli
