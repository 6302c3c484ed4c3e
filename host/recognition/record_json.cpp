#include "recognition/record_json.hpp"

#include <numbers>

namespace palpate {

namespace {

/// [x, y, theta], theta in [-pi, pi).
nlohmann::ordered_json to_json(const Pose& pose) {
  return {pose.translation_mm.x, pose.translation_mm.y,
          wrap_angle(pose.theta_rad, 2.0 * std::numbers::pi)};
}

/// [3][3]
nlohmann::ordered_json to_json(const std::array<double, 9>& covariance) {
  auto rows = nlohmann::ordered_json::array();
  for (std::size_t row = 0; row < 3; ++row) {
    const double* values = &covariance[3 * row];
    rows.push_back({values[0], values[1], values[2]});
  }
  return rows;
}

nlohmann::ordered_json to_json(const RecognitionStep& step, const RefinedPose& refined) {
  return {{"T_robot_object", to_json(step.T_robot_object())},
          {"sd", *step.sd()},
          {"x_mm", refined.T_object_robot.translation_mm.x},
          {"y_mm", refined.T_object_robot.translation_mm.y},
          {"theta_rad", refined.T_object_robot.theta_rad},
          {"covariance", to_json(refined.covariance)}};
}

nlohmann::ordered_json to_json(const BeliefMode& mode, const RecognitionTask& task) {
  const Hypothesis& hypothesis = task.hypotheses[static_cast<std::size_t>(mode.object)];
  nlohmann::ordered_json json{{"object", hypothesis.map.label},
                              {"probability", mode.probability},
                              {"T_robot_object", to_json(mode.pose.T_robot_object)},
                              {"covariance", to_json(mode.pose.covariance)}};
  if (hypothesis.map.mirror) {
    json["mirrored"] = hypothesis.mirrored;
  }
  return json;
}

nlohmann::ordered_json to_json(std::optional<double> error_mm) {
  return error_mm ? nlohmann::ordered_json(*error_mm) : nullptr;
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

std::string verdict_text(Verdict verdict) {
  switch (verdict) {
    case Verdict::fits:
      return "fits";
    case Verdict::doubtful:
      return "doubtful";
    case Verdict::does_not_fit:
      break;
  }
  return "does not fit";
}

nlohmann::ordered_json truth_to_json(const PartialTruth& truth) {
  nlohmann::ordered_json json{{"object", truth.label}};
  if (truth.T_object_robot) {
    json["T_robot_object"] = to_json(inverse(*truth.T_object_robot));
  }
  return json;
}

nlohmann::ordered_json to_json(const RecognitionStep& step, const RecognitionTask& task,
                               OptionWords words) {
  nlohmann::ordered_json json;
  if (!step.decision.because.empty()) {
    json["decision"] = {{"act", step.decision.act}, {"because", step.decision.because}};
    if (step.places.within_mm) {
      json["decision"]["within_mm"] = *step.places.within_mm;
    }
  }
  json["best"] = task.labels[step.best];
  if (step.refined) {
    json["refined"] = to_json(step, *step.refined);
  }
  for (std::size_t i = 0; i < task.labels.size(); ++i) {
    json["identity"][task.labels[i]] = step.identity[i];
  }
  if (task.labels.back() == none_label) {
    json["none"] = step.identity.back();
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
  if (!step.decision.because.empty()) {
    if (step.refined) {
      json["refined"]["share"] = step.places.share;
    }
    json["modes"] = nlohmann::ordered_json::array();
    for (const BeliefMode& each : step.places.modes) {
      json["modes"].push_back(to_json(each, task));
    }
  }
  if (step.symmetry != 1) {
    json["symmetry"] = step.symmetry;
  }
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
  if (!step.touch_fit.empty()) {
    nlohmann::ordered_json& fits = json["touch_fit"] = nlohmann::ordered_json::array();
    for (const std::optional<double>& z : step.touch_fit) {
      fits.push_back(to_json(z));
    }
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
  if (!task.sensor_model.empty()) {
    json["sensor_model"] = task.sensor_model;
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

}  // namespace palpate
