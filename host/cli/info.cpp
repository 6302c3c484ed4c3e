#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include "cli/commands.hpp"
#include "cli/options.hpp"
#include "io/file_summary.hpp"
#include "io/recording_state.hpp"
#include "io/recording_survey.hpp"
#include "model/printable.hpp"
#include "palpate/files.hpp"
#include "palpate/learned_sensor.hpp"

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

/// What a sensor model says, a line for each part that it has.
std::string sensor_model_text(const LearnedSensor& sensor) {
  const std::string unit = sensor.pressure_unit == "kPa" ? " kPa" : "";
  std::string text;
  const auto add = [&](const char* name, const std::string& words) {
    text += fmt::format("  {:<17} {}\n", name, words);
  };
  if (!sensor.maps.empty()) {
    std::vector<std::string> files;
    for (const auto& [file, digest] : sensor.maps) {
      files.push_back(printable(file));
    }
    add("learned for", fmt::format("{}", fmt::join(files, ", ")));
  }
  add("pressures", sensor.pressure_unit == "kPa" ? "kPa" : "raw");
  add("noise", fmt::format("{:.4g}{}", sensor.noise, unit));
  add("threshold", fmt::format("{:.4g}{}, ratio {:.4g}", sensor.classifier.threshold, unit,
                               sensor.classifier.ratio));
  add("gamma",
      fmt::format("{:.4g}{}", sensor.gamma, sensor.table ? ", not used beside the table" : ""));
  add("maps", fmt::format("prior {:.4g}, spread {:.4g} mm", sensor.prior, sensor.spread_mm));
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
  if (const auto& scale = sensor.fit_scale) {
    add("fit scale",
        fmt::format("z of learned objects {:.4g} +- {:.4g}{}{}{}{}", scale->mean, scale->sd,
                    scale->alone
                        ? fmt::format(", of a single touch where it fits best {:.4g} +- {:.4g}",
                                      scale->alone->mean, scale->alone->sd)
                        : "",
                    scale->stranger_sd
                        ? fmt::format(", of strangers +- {:.4g} more on it for every further touch",
                                      *scale->stranger_sd)
                        : "",
                    scale->stranger_alone
                        ? fmt::format(", of a single touch of strangers {:.4g} +- {:.4g} on it",
                                      scale->stranger_alone->mean, scale->stranger_alone->sd)
                        : "",
                    scale->array ? fmt::format(", by {:.0f} elements {:.3g} mm apart",
                                               scale->array->elements, scale->array->spacing_mm)
                                 : ""));
  }
  if (sensor.pose_scale) {
    add("pose scale",
        fmt::format("covariances times {:.4g}, and {:.4g} mm of the map along each axis",
                    sensor.pose_scale->factor, sensor.pose_scale->map_sd_mm));
  }
  return text;
}

/// Says whether the recording is closed, so that other programs can open it, and if not, why.
std::string closed_of(const std::string& path, const Recording& r) {
  if (r.closed) {
    return "yes";
  }
  switch (recorder_of(path)) {
    case Recorder::there:
      return "no: it is being recorded";
    case Recorder::gone:
      return fmt::format("no: it was cut off; palpate info --close {} lets other programs open it",
                         path);
    case Recorder::unknown:
      break;
  }
  return "no: it is being recorded, or was cut off";
}

std::string range_of(const Extremes& range) {
  return fmt::format("{:.4g} to {:.4g}", range.least, range.most);
}

void print_array(const RecordingSurvey& s) {
  fmt::print("  elements          {}{}\n", s.head.elements,
             s.head.array_changes ? ", positions change per touch" : "");
  if (!s.array) {
    return;
  }
  const auto& [x_mm, y_mm] = *s.array;
  fmt::print("  array             {:.4g} x {:.4g} mm: x {}, y {} mm\n", x_mm.span(), y_mm.span(),
             range_of(x_mm), range_of(y_mm));
  if (s.spacing) {
    const Extremes& nearest_mm = s.spacing->nearest_mm;
    const std::string pitch = fmt::format("{:.3g}", nearest_mm.least);
    const std::string widest = fmt::format("{:.3g}", nearest_mm.most);
    fmt::print("  pitch             {}{} mm from an element to its nearest neighbour\n", pitch,
               widest == pitch ? "" : " to " + widest);
  }
}

void print_pressures(const RecordingSurvey& s) {
  const Recording& r = s.head.recording;
  const PressureSurvey& pressure = s.pressure;
  if (const std::optional<Extremes>& range = pressure.range) {
    fmt::print("  pressure          {:.3g} to {:.3g} {}, median {:.3g}, 99th percentile {:.3g}\n",
               range->least, range->most, r.pressure_unit, pressure.readings.quantile(0.5),
               pressure.readings.quantile(0.99));
  }
  if (s.threshold) {
    fmt::print("  in contact        {} {}, more than {} {} above {}\n", pressure.in_contact, r.rows,
               *s.threshold, r.pressure_unit, r.baseline.empty() ? "0" : "the baseline");
  } else {
    fmt::print("  in contact        not known: raw pressure has no default threshold\n");
  }
  if (pressure.unknown > 0) {
    fmt::print("  unknown readings  {} of {}\n", pressure.unknown, s.head.rows * s.head.elements);
  }
  if (!r.valid.empty()) {
    fmt::print("  dead readings     {} of {}\n", std::count(r.valid.begin(), r.valid.end(), 0),
               r.valid.size());
  }
}

void print_poses(const RecordingSurvey& s) {
  if (s.head.recording.rows == "frames") {
    fmt::print("  with a pose       {} frames\n", s.with_pose);
  }
  if (s.poses) {
    const auto& [x_mm, y_mm, theta_rad] = *s.poses;
    fmt::print("  poses             x {} mm, y {} mm\n", range_of(x_mm), range_of(y_mm));
    fmt::print("                    theta {} rad, {:.1f} to {:.1f} deg\n", range_of(theta_rad),
               degrees(theta_rad.least), degrees(theta_rad.most));
  }
}

/// Prints what only a recording of frames has.
void print_stream(const std::string& path, const RecordingSurvey& s) {
  const Recording& r = s.head.recording;
  if (s.elapsed_s && *s.elapsed_s > 0.0) {
    fmt::print("  rate              {:.1f} Hz\n",
               static_cast<double>(s.head.rows - 1) / *s.elapsed_s);
  }
  if (s.lost) {
    fmt::print("  lost              {} frames\n", *s.lost);
  }
  if (r.baseline.empty()) {
    fmt::print("  baseline          none\n");
  } else {
    const auto [least, most] = std::minmax_element(r.baseline.begin(), r.baseline.end());
    fmt::print("  baseline          {:.3g} to {:.3g} {}\n", *least, *most, r.pressure_unit);
  }
  if (!r.sensor.empty()) {
    fmt::print("  sensor            {}{}\n", r.sensor,
               r.serial.empty() ? "" : ", serial " + r.serial);
  }
  fmt::print("  closed            {}\n", closed_of(path, r));
}

void print_recording(const std::string& path) {
  const RecordingSurvey s = survey_recording(path);
  const Recording& r = s.head.recording;
  fmt::print("{}: recording of {}\n", path, r.object.empty() ? "an unknown object" : r.object);
  fmt::print("  {}           {}\n", r.rows, s.head.rows);
  print_array(s);
  print_pressures(s);
  print_poses(s);
  if (s.elapsed_s) {
    fmt::print("  duration          {:.3f} s\n", *s.elapsed_s);
  }
  if (r.rows == "frames") {
    print_stream(path, s);
  }
  if (r.truth) {
    const Pose T = inverse(r.truth->T_object_robot);
    fmt::print(
        "  truth             {} at x {:.3f} mm, y {:.3f} mm, theta {:.2f} deg in the robot "
        "frame\n",
        r.truth->object, T.translation_mm.x, T.translation_mm.y, degrees(wrap_angle(T.theta_rad)));
  }
  if (const std::vector<std::string> suspicions = suspicions_of(s); !suspicions.empty()) {
    fmt::print("Suspicious:\n");
    for (const std::string& suspicion : suspicions) {
      fmt::print("  {}\n", suspicion);
    }
  }
}

void print_map(const std::string& path) {
  const MapSummary s = summarize_map(path);
  const OccupancyGrid& m = s.head;
  fmt::print("{}: map of {}\n", path, m.label);
  fmt::print("  cells             {} x {} of {} mm, {:.1f} x {:.1f} mm\n", m.nx, m.ny, m.cell_mm,
             m.nx * m.cell_mm, m.ny * m.cell_mm);
  fmt::print("  origin            {:.3f}, {:.3f} mm, centre of cell (0, 0)\n", m.origin_mm.x,
             m.origin_mm.y);
  const Pose& frame = m.T_learned_robot_object;
  fmt::print("  frame             {:.3f}, {:.3f} mm, {:.2f} deg in the {}\n",
             frame.translation_mm.x, frame.translation_mm.y, degrees(frame.theta_rad),
             m.drawn ? "drawing's frame" : "robot frame of the touches");
  if (m.spread_mm) {
    fmt::print("  spread            {} mm, standard deviation of the inverse sensor model\n",
               *m.spread_mm);
  }
  fmt::print("  prior             {:.4f}, log odds {:.3f}\n", m.prior, m.prior_log_odds());
  fmt::print("  log odds          {:.3f} to {:.3f} nats\n", s.log_odds.least, s.log_odds.most);
  fmt::print("  occupied          {} cells, {:.1f} mm2\n", s.occupied,
             static_cast<double>(s.occupied) * m.cell_mm * m.cell_mm);
  const auto symmetry_text = [](int n) { return n == 0 ? "full" : fmt::format("{}", n); };
  fmt::print("  symmetry          {}\n", symmetry_text(m.symmetry));
  if (m.mirror) {
    fmt::print("  mirror            the object may lie on its other side\n");
  }
  if (m.suggested_symmetry) {
    fmt::print("  suggested         {}, the symmetry that the map shows\n",
               symmetry_text(*m.suggested_symmetry));
  }
}

void print_posterior(const std::string& path) {
  const PosteriorSummary s = summarize_posterior(path);
  const Posterior& p = s.head;
  const PoseLattice& lattice = p.lattice;
  fmt::print("{}: posterior over {}\n", path, fmt::join(p.objects, ", "));
  fmt::print("  bins              {} x {} x {} (x, y, theta) per object\n", lattice.x_mm.count,
             lattice.y_mm.count, lattice.theta_rad.count);
  if (p.rest_mass_bound) {
    fmt::print("  evaluated         {} bins; all others hold at most {:.1g} of the belief\n",
               p.index.size(), *p.rest_mass_bound);
  }
  fmt::print("  x, y              {} to {} mm, {} to {} mm\n", lattice.x_mm.lower,
             lattice.x_mm.upper, lattice.y_mm.lower, lattice.y_mm.upper);
  fmt::print("  theta             {:.1f} to {:.1f} deg\n", degrees(lattice.theta_rad.lower),
             degrees(lattice.theta_rad.upper));
  fmt::print("  pivot             {}, {} mm\n", lattice.pivot_mm.x, lattice.pivot_mm.y);
  for (std::size_t i = 0; i < p.objects.size(); ++i) {
    const auto& [log_likelihood, bin] = s.peaks[i];
    if (p.rest_mass_bound && std::isinf(log_likelihood)) {
      fmt::print("  {:16}  no bin was evaluated\n", p.objects[i]);
      continue;
    }
    const Pose T = lattice.T_object_robot(bin);
    fmt::print("  {:16}  largest {:.3f} nats at x {:.2f} mm, y {:.2f} mm, theta {:.1f} deg\n",
               p.objects[i], log_likelihood, T.translation_mm.x, T.translation_mm.y,
               degrees(T.theta_rad));
  }
}

/// Sensor models are the only files in YAML.
bool is_yaml(const std::filesystem::path& path) {
  return path.extension() == ".yaml" || path.extension() == ".yml";
}

void print_info(const std::string& path, bool close) {
  if (is_yaml(path) && !close) {
    const LearnedSensor sensor = read_sensor_model(path);
    fmt::print("{}: sensor model\n{}", path, sensor_model_text(sensor));
    return;
  }
  const std::string format = read_format(path);
  if (close) {
    if (format != "palpate.recording") {
      refuse(path, "format '{}' needs no closing; give --close a recording", format);
    }
    close_recording(path);
  }
  if (format == "palpate.recording") {
    print_recording(path);
  } else if (format == "palpate.map") {
    print_map(path);
  } else if (format == "palpate.posterior") {
    print_posterior(path);
  } else {
    refuse(path, "attribute 'format' = '{}' is unknown; give a recording, a map or a posterior",
           format);
  }
}

}  // namespace

void add_info(CLI::App& app) {
  auto* command = app.add_subcommand("info",
                                     "Show what a recording, a map, a posterior or a sensor model "
                                     "holds, and what is suspicious in "
                                     "a recording");
  struct Options {
    std::string path;
    bool close = false;
  };
  const auto options = std::make_shared<Options>();
  command
      ->add_option("FILE", options->path,
                   "Recording, map or posterior (HDF5), or sensor model (YAML)")
      ->required();
  command->add_flag(
      "--close", options->close,
      "First close a recording that was cut off, so that other programs open it too (before, h5py "
      "needs swmr=True). This changes the file; it keeps all rows that are whole. A recording that "
      "is still being made is refused");
  command->callback([options] { print_info(options->path, options->close); });
}

}  // namespace palpate::cli
