#include <algorithm>
#include <cmath>
#include <filesystem>
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

/// Prints a line of what a file holds.
template <typename... Values>
void print_row(std::string_view name, fmt::format_string<const Values&...> words,
               const Values&... values) {
  fmt::print("  {:<17} {}\n", name, fmt::format(words, values...));
}

void print_sensor_model(const std::string& path) {
  const LearnedSensor sensor = read_sensor_model(path);
  fmt::print("{}: sensor model\n", path);
  const std::string unit = sensor.pressure_unit == "kPa" ? " kPa" : "";
  if (!sensor.maps.empty()) {
    std::vector<std::string> files;
    for (const auto& [file, digest] : sensor.maps) {
      files.push_back(printable(file));
    }
    print_row("learned for", "{}", fmt::format("{}", fmt::join(files, ", ")));
  }
  print_row("pressures", "{}", sensor.pressure_unit == "kPa" ? "kPa" : "raw");
  print_row("noise", "{:.4g}{}", sensor.noise, unit);
  print_row("threshold", "{:.4g}{}, ratio {:.4g}", sensor.classifier.threshold, unit,
            sensor.classifier.ratio);
  print_row("gamma", "{:.4g}{}", sensor.gamma, sensor.table ? ", not used beside the table" : "");
  print_row("maps", "prior {:.4g}, spread {:.4g} mm", sensor.prior, sensor.spread_mm);
  if (!sensor.touch_sd.none()) {
    print_row("touch sd", "{:.4g} mm, {:.4g} deg", sensor.touch_sd.mm,
              degrees(sensor.touch_sd.rad));
  }
  if (const auto& table = sensor.table) {
    print_row("likelihood", "table of {} levels over {}; {} object(s) with numbers of their own",
              table->levels(), table->layer.of == MapLayer::log_odds ? "log odds" : "mean levels",
              table->objects.size());
  } else {
    print_row("likelihood", "Eq. 7");
  }
  print_row("temperature", "{}",
            sensor.temperature_growth > 0.0
                ? fmt::format("{:.4g}, and {:.4g} more for every further touch", sensor.temperature,
                              sensor.temperature_growth)
                : fmt::format("{:.4g}", sensor.temperature));
  if (sensor.bins) {
    print_row("learned on bins", "{:.3g} x {:.3g} mm x {:.3g} deg", sensor.bins->x_mm,
              sensor.bins->y_mm, degrees(sensor.bins->theta_rad));
  }
  if (sensor.features) {
    print_row("press features", "weight {:.4g}, of {} object(s)", sensor.features->weight,
              sensor.features->objects.size());
  }
  if (const auto& scale = sensor.fit_scale) {
    print_row("fit scale", "z of learned objects {:.4g} +- {:.4g}", scale->mean, scale->sd);
  }
  if (sensor.pose_scale) {
    print_row("pose scale", "covariances times {:.4g}, and {:.4g} mm of the map along each axis",
              sensor.pose_scale->factor, sensor.pose_scale->map_sd_mm);
  }
}

/// Says whether the recording is closed, so that other programs can open it, and if not, why.
std::string closed_of(const std::string& path, const Recording& r) {
  if (r.closed) {
    return "yes";
  }
  const Recorder recorder = recorder_of(path);
  return recorder == Recorder::there ? "no: it is being recorded"
         : recorder == Recorder::gone
             ? fmt::format(
                   "no: it was cut off; palpate info --close {} lets other programs open it", path)
             : "no: it is being recorded, or was cut off";
}

std::string range_of(const Extremes& range) {
  return fmt::format("{:.4g} to {:.4g}", range.least, range.most);
}

void print_array(const RecordingSurvey& s) {
  print_row("elements", "{}{}", s.head.elements,
            s.head.array_changes ? ", positions change per touch" : "");
  if (!s.array) {
    return;
  }
  const auto& [x_mm, y_mm] = *s.array;
  print_row("array", "{:.4g} x {:.4g} mm: x {}, y {} mm", x_mm.span(), y_mm.span(), range_of(x_mm),
            range_of(y_mm));
  if (s.spacing) {
    const Extremes& nearest_mm = s.spacing->nearest_mm;
    const std::string pitch = fmt::format("{:.3g}", nearest_mm.least);
    const std::string widest = fmt::format("{:.3g}", nearest_mm.most);
    print_row("pitch", "{}{} mm from an element to its nearest neighbour", pitch,
              widest == pitch ? "" : " to " + widest);
  }
}

void print_pressures(const RecordingSurvey& s) {
  const Recording& r = s.head.recording;
  const PressureSurvey& pressure = s.pressure;
  if (const std::optional<Extremes>& range = pressure.range) {
    print_row("pressure", "{:.3g} to {:.3g} {}, median {:.3g}, 99th percentile {:.3g}",
              range->least, range->most, r.pressure_unit, pressure.readings.quantile(0.5),
              pressure.readings.quantile(0.99));
  }
  if (s.threshold) {
    print_row("in contact", "{} {}, more than {} {} above {}", pressure.in_contact, r.rows,
              *s.threshold, r.pressure_unit, r.baseline.empty() ? "0" : "the baseline");
  } else {
    print_row("in contact", "not known: raw pressure has no default threshold");
  }
  if (pressure.unknown > 0) {
    print_row("unknown readings", "{} of {}", pressure.unknown, s.head.rows * s.head.elements);
  }
  if (!r.valid.empty()) {
    print_row("dead readings", "{} of {}", std::count(r.valid.begin(), r.valid.end(), 0),
              r.valid.size());
  }
}

void print_poses(const RecordingSurvey& s) {
  if (s.head.recording.rows == "frames") {
    print_row("with a pose", "{} frames", s.with_pose);
  }
  if (s.poses) {
    const auto& [x_mm, y_mm, theta_rad] = *s.poses;
    print_row("poses", "x {} mm, y {} mm", range_of(x_mm), range_of(y_mm));
    print_row("", "theta {} rad, {:.1f} to {:.1f} deg", range_of(theta_rad),
              degrees(theta_rad.least), degrees(theta_rad.most));
  }
}

/// Prints what only a recording of frames has.
void print_stream(const std::string& path, const RecordingSurvey& s) {
  const Recording& r = s.head.recording;
  if (s.elapsed_s && *s.elapsed_s > 0.0) {
    print_row("rate", "{:.1f} Hz", static_cast<double>(s.head.rows - 1) / *s.elapsed_s);
  }
  if (s.lost) {
    print_row("lost", "{} frames", *s.lost);
  }
  if (r.baseline.empty()) {
    print_row("baseline", "none");
  } else {
    const auto [least, most] = std::minmax_element(r.baseline.begin(), r.baseline.end());
    print_row("baseline", "{:.3g} to {:.3g} {}", *least, *most, r.pressure_unit);
  }
  if (!r.sensor.empty()) {
    print_row("sensor", "{}{}", r.sensor, r.serial.empty() ? "" : ", serial " + r.serial);
  }
  print_row("closed", "{}", closed_of(path, r));
}

void print_recording(const std::string& path) {
  const RecordingSurvey s = survey_recording(path);
  const Recording& r = s.head.recording;
  fmt::print("{}: recording of {}\n", path, r.object.empty() ? "an unknown object" : r.object);
  print_row(r.rows, "{}", s.head.rows);
  print_array(s);
  print_pressures(s);
  print_poses(s);
  if (s.elapsed_s) {
    print_row("duration", "{:.3f} s", *s.elapsed_s);
  }
  if (r.rows == "frames") {
    print_stream(path, s);
  }
  if (r.truth) {
    const Pose T = inverse(r.truth->T_object_robot);
    print_row("truth", "{} at x {:.3f} mm, y {:.3f} mm, theta {:.2f} deg in the robot frame",
              r.truth->object, T.translation_mm.x, T.translation_mm.y,
              degrees(wrap_angle(T.theta_rad)));
  }
  if (const std::vector<std::string> findings = findings_of(s); !findings.empty()) {
    fmt::print("Suspicious:\n");
    for (const std::string& finding : findings) {
      fmt::print("  {}\n", finding);
    }
  }
}

void print_map(const std::string& path) {
  const MapSummary s = summarize_map(path);
  const OccupancyGrid& m = s.head;
  fmt::print("{}: map of {}\n", path, m.label);
  print_row("cells", "{} x {} of {} mm, {:.1f} x {:.1f} mm", m.nx, m.ny, m.cell_mm,
            m.nx * m.cell_mm, m.ny * m.cell_mm);
  print_row("origin", "{:.3f}, {:.3f} mm, centre of cell (0, 0)", m.origin_mm.x, m.origin_mm.y);
  const Pose& frame = m.T_learned_robot_object;
  print_row("frame", "{:.3f}, {:.3f} mm, {:.2f} deg in the {}", frame.translation_mm.x,
            frame.translation_mm.y, degrees(frame.theta_rad),
            m.drawn ? "drawing's frame" : "robot frame of the touches");
  if (m.spread_mm) {
    print_row("spread", "{} mm, standard deviation of the inverse sensor model", *m.spread_mm);
  }
  print_row("prior", "{:.4f}, log odds {:.3f}", m.prior, m.prior_log_odds());
  print_row("log odds", "{:.3f} to {:.3f} nats", s.log_odds.least, s.log_odds.most);
  print_row("occupied", "{} cells, {:.1f} mm2", s.occupied,
            static_cast<double>(s.occupied) * m.cell_mm * m.cell_mm);
  const auto symmetry_text = [](int n) { return n == 0 ? "full" : fmt::format("{}", n); };
  print_row("symmetry", "{}", symmetry_text(m.symmetry));
  if (m.mirror) {
    print_row("mirror", "the object may lie on its other side");
  }
  if (m.suggested_symmetry) {
    print_row("suggested", "{}, the symmetry that the map shows",
              symmetry_text(*m.suggested_symmetry));
  }
}

void print_posterior(const std::string& path) {
  const PosteriorSummary s = summarize_posterior(path);
  const Posterior& p = s.head;
  const PoseLattice& lattice = p.lattice;
  fmt::print("{}: posterior over {}\n", path, fmt::join(p.objects, ", "));
  print_row("bins", "{} x {} x {} (x, y, theta) per object", lattice.x_mm.count, lattice.y_mm.count,
            lattice.theta_rad.count);
  if (p.rest_mass_bound) {
    print_row("evaluated", "{} bins; all others hold at most {:.1g} of the belief", p.index.size(),
              *p.rest_mass_bound);
  }
  print_row("x, y", "{} to {} mm, {} to {} mm", lattice.x_mm.lower, lattice.x_mm.upper,
            lattice.y_mm.lower, lattice.y_mm.upper);
  print_row("theta", "{:.1f} to {:.1f} deg", degrees(lattice.theta_rad.lower),
            degrees(lattice.theta_rad.upper));
  print_row("pivot", "{}, {} mm", lattice.pivot_mm.x, lattice.pivot_mm.y);
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

struct InfoArguments {
  std::string path;
  bool close = false;
};

void print_info(const InfoArguments& options) {
  const auto& [path, close] = options;
  const std::filesystem::path extension = std::filesystem::path(path).extension();
  if (!close && (extension == ".yaml" || extension == ".yml")) {
    print_sensor_model(path);
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
  const auto [command, options] =
      add_command<InfoArguments>(app, "info",
                                 "Show what a recording, a map, a posterior or a sensor model "
                                 "holds, and what is suspicious in a recording",
                                 print_info);
  add_required(*command, "FILE", options->path,
               "Recording, map or posterior (HDF5), or sensor model (YAML)");
  command->add_flag("--close", options->close,
                    "First close a recording that was cut off, so that other programs open it too "
                    "(before, h5py needs swmr=True). This changes the file; it keeps all rows that "
                    "are whole. A recording that is still being made is refused");
}

}  // namespace palpate::cli
