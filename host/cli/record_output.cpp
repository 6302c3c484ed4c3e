#include "cli/record_output.hpp"

#include <algorithm>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/options.hpp"
#include "cli/step_words.hpp"

namespace palpate::cli {

namespace {

/// [x, y, theta], theta in [-pi, pi).
nlohmann::ordered_json to_json(const Pose& pose) {
  return {pose.translation_mm.x, pose.translation_mm.y,
          wrap_angle(pose.theta_rad, 2.0 * std::numbers::pi)};
}

nlohmann::ordered_json to_json(const RecognitionStep& step, const RefinedPose& refined) {
  auto rows = nlohmann::ordered_json::array();
  for (std::size_t row = 0; row < 3; ++row) {
    const double* values = &refined.covariance[3 * row];
    rows.push_back({values[0], values[1], values[2]});
  }
  return {{"T_robot_object", to_json(step.T_robot_object())},
          {"sd", *step.sd()},
          {"x_mm", refined.T_object_robot.translation_mm.x},
          {"y_mm", refined.T_object_robot.translation_mm.y},
          {"theta_rad", refined.T_object_robot.theta_rad},
          {"covariance", rows}};
}

nlohmann::ordered_json to_json(std::optional<double> error_mm) {
  return error_mm ? nlohmann::ordered_json(*error_mm) : nullptr;
}

/// Why the task has its filter, as a line of its own; "" where there is no more to say.
std::string reason_of_filter(const RecognitionTask& task) {
  const std::int64_t bins = task.bins_in_all();
  if (task.auto_filter) {
    return fmt::format("\n        chosen by --filter auto: {} bins in all, {} {}", bins,
                       bins > most_histogram_bins ? "more than" : "at most", most_histogram_bins);
  }
  return task.filter_asked_for_by.empty()
             ? ""
             : fmt::format("\n        asked for by {}", task.filter_asked_for_by);
}

/// Adds what a bounded posterior proves of its estimate.
void add_certificate(nlohmann::ordered_json& json, const RecognitionStep& step,
                     const RecognitionTask& task) {
  const Certificate& certificate = *step.certificate;
  json["dropped_mass"] = certificate.dropped_mass;
  for (std::size_t i = 0; i < task.labels.size(); ++i) {
    json["identity_bounds"][task.labels[i]] = {step.identity_bounds[i].low,
                                               step.identity_bounds[i].high};
  }
  json["mode_certain"] = certificate.mode_certain;
  json["bins_evaluated"] = certificate.bins_evaluated;
  json["blocks_bounded"] = certificate.blocks_bounded;
}

}  // namespace

std::string setup_words(const Device& device, const RecognitionTask& task) {
  const auto* particles = std::get_if<ParticleOptions>(&task.filter);
  const PoseLattice& lattice = task.lattice();
  const auto mirrored =
      static_cast<std::size_t>(std::ranges::count_if(task.hypotheses, &Hypothesis::mirrored));
  const std::size_t maps = task.hypotheses.size() - mirrored;
  return fmt::format("{} map{}{}, {} on {}", maps, maps == 1 ? "" : "s",
                     mirrored > 0 ? fmt::format(" and {} mirrored", mirrored) : "",
                     particles != nullptr
                         ? fmt::format("{} particles", particles->particles)
                         : fmt::format("{} x {} x {} bins each{},", lattice.x_mm.count,
                                       lattice.y_mm.count, lattice.theta_rad.count,
                                       traits_of(task.filter).certificate ? " by bounds" : ""),
                     device.name());
}

void print_engine(const Device* device, const Recogniser& recogniser, const RecognitionTask& task) {
  const PoseLattice& lattice = task.lattice();
  const auto words = [](const char* name, const Axis& axis, double unit, const char* unit_name) {
    return fmt::format("{} {:g} to {:g} {}, {} bins in steps of {:.4g}", name, axis.lower * unit,
                       axis.upper * unit, unit_name, axis.count, axis.step() * unit);
  };
  std::string filter;
  if (const auto* particles = std::get_if<ParticleOptions>(&task.filter)) {
    filter =
        fmt::format("{} particles, {} resampling{}, seed {}", particles->particles,
                    particles->resampling == Resampling::multinomial ? "multinomial" : "systematic",
                    particles->augmented ? ", random particles added" : "", particles->seed);
  } else if (const auto* bounded = std::get_if<BoundedOptions>(&task.filter)) {
    filter = fmt::format(
        "bounded, {}; {:.1f} MiB of the host's memory\n        tolerance {:g}", recogniser.path(),
        static_cast<double>(recogniser.host_bytes()) / (1 << 20), bounded->tolerance);
    filter += bounded->budget_s ? fmt::format(", budget {:g} ms", 1e3 * *bounded->budget_s) : "";
    if (bounded->evidence_nats) {
      filter += fmt::format(", evidence within {:g} nats", *bounded->evidence_nats);
      filter += bounded->evidence_growth > 0.0
                    ? fmt::format(", {:g} more with every further touch",
                                  *bounded->evidence_nats * bounded->evidence_growth)
                    : "";
    }
  } else {
    filter = "histogram in " + recogniser.path();
  }
  filter += reason_of_filter(task);
  fmt::print(stderr,
             "device: {}\nfilter: {}\nlattice: {}\n         {}\n"
             "         {}\n         pivot {}\n",
             device == nullptr
                 ? "none"
                 : fmt::format("{}, {:.1f} MiB of its memory", device->name(),
                               static_cast<double>(recogniser.device_bytes()) / (1 << 20)),
             filter, words("x", lattice.x_mm, 1.0, "mm"), words("y", lattice.y_mm, 1.0, "mm"),
             words("theta", lattice.theta_rad, degrees(1.0), "deg"),
             task.auto_pivot ? "at the array's centre at the first touch in contact"
                             : fmt::format("{:g}, {:g} mm in the robot frame", lattice.pivot_mm.x,
                                           lattice.pivot_mm.y));
}

nlohmann::ordered_json truth_to_json(const GroundTruth& truth) {
  nlohmann::ordered_json json{{"object", truth.label}};
  if (truth.T_object_robot) {
    json["T_robot_object"] = to_json(inverse(*truth.T_object_robot));
  }
  return json;
}

nlohmann::ordered_json to_json(const RecognitionStep& step, const RecognitionTask& task,
                               OptionWords words) {
  nlohmann::ordered_json json{{"best", task.labels[step.best]}};
  if (step.refined) {
    json["refined"] = to_json(step, *step.refined);
  }
  for (std::size_t i = 0; i < task.labels.size(); ++i) {
    json["identity"][task.labels[i]] = step.identity[i];
  }
  if (task.labels.back() == none_label) {
    json["none"] = step.identity.back();
  }
  if (step.known) {
    json["known"] = *step.known;
  }
  const Mode& mode = step.mode;
  json["mode"] = {{"object", task.labels[task.label_of[mode.object]]},
                  {"map", task.map_paths[mode.object]},
                  {"x_mm", mode.T_object_robot.translation_mm.x},
                  {"y_mm", mode.T_object_robot.translation_mm.y},
                  {"theta_rad", mode.T_object_robot.theta_rad},
                  {"log_likelihood", mode.log_likelihood}};
  const Hypothesis& hypothesis = task.hypotheses[static_cast<std::size_t>(mode.object)];
  if (hypothesis.map.mirror) {
    json["mode"]["mirrored"] = hypothesis.mirrored;
  }
  json["T_robot_object"] = to_json(step.mode_T_robot_object());
  if (step.right) {
    json["right"] = *step.right;
    json["error_mm"] = to_json(step.error_mm);
    if (step.refined) {
      json["refined_error_mm"] = to_json(step.refined_error_mm);
    }
  }
  if (step.fit) {
    json["fit"] = {{"z", step.fit->z}, {"verdict", verdict_text(step.fit->verdict)}};
  }
  if (step.surprise) {
    json["surprise"] = *step.surprise;
  }
  if (step.certificate) {
    add_certificate(json, step, task);
  }
  for (const std::string& warning : step.warnings) {
    json["warnings"].push_back(words(warning));
  }
  if (step.contradicted) {
    json["contradicted"] = true;
  }
  if (step.effective_sample_size) {
    json["effective_sample_size"] = *step.effective_sample_size;
  }
  return json;
}

nlohmann::ordered_json to_json(const RecognitionRecord& record, const RecognitionTask& task,
                               const std::optional<std::string>& device, bool with_trace,
                               OptionWords words) {
  nlohmann::ordered_json json{{"recording", record.recording}};
  if (record.frame) {
    json["frame"] = *record.frame;
  }
  json["touches"] = record.touches;
  if (!record.error.empty()) {
    if (!record.true_label.empty()) {
      json["truth"] = truth_to_json({record.true_label, {}});
    }
    json["error"] = words(record.error);
    return json;
  }
  json.update(to_json(record.last(), task, words));
  if (!record.true_label.empty()) {
    json["truth"] = truth_to_json(record.last().truth);
  }
  if (device) {
    json["seconds"] = record.seconds;
    json["device"] = *device;
  }
  if (with_trace) {
    auto trace = nlohmann::ordered_json::array();
    for (const RecognitionStep& step : record.trace) {
      trace.push_back(to_json(step, task, words));
    }
    json["trace"] = trace;
  }
  return json;
}

std::string text_of(const nlohmann::ordered_json& json, int indent) {
  return json.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace palpate::cli
