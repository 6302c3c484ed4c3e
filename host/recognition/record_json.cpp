#include "recognition/record_json.hpp"

#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "recognition/live_recognition.hpp"

namespace palpate {

namespace {

using Json = nlohmann::ordered_json;

/// [x, y, theta], theta in [-pi, pi).
Json to_json(const Pose& pose) {
  return {pose.translation_mm.x, pose.translation_mm.y,
          wrap_angle(pose.theta_rad, 2.0 * std::numbers::pi)};
}

/// x_mm, y_mm and theta_rad, as they are.
Json named(const Pose& pose) {
  return {{"x_mm", pose.translation_mm.x},
          {"y_mm", pose.translation_mm.y},
          {"theta_rad", pose.theta_rad}};
}

/// [3][3]
Json to_json(const std::array<double, 9>& covariance) {
  auto rows = Json::array();
  for (std::size_t row = 0; row < 3; ++row) {
    const double* values = &covariance[3 * row];
    rows.push_back({values[0], values[1], values[2]});
  }
  return rows;
}

Json to_json(const RecognitionStep& step, const RefinedPose& refined) {
  Json json{{"T_robot_object", to_json(step.T_robot_object())}, {"sd", *step.sd()}};
  json.update(named(refined.T_object_robot));
  json["covariance"] = to_json(refined.covariance);
  return json;
}

Json to_json(const BeliefMode& mode, const RecognitionTask& task) {
  const Hypothesis& hypothesis = task.hypotheses[static_cast<std::size_t>(mode.object)];
  Json json{{"object", hypothesis.map.label},
            {"probability", mode.probability},
            {"T_robot_object", to_json(mode.pose.T_robot_object)},
            {"covariance", to_json(mode.pose.covariance)}};
  if (hypothesis.map.mirror) {
    json["mirrored"] = hypothesis.mirrored;
  }
  return json;
}

Json to_json(std::optional<double> error_mm) { return error_mm ? Json(*error_mm) : nullptr; }

/// Adds what a bounded posterior proves of its estimate.
void add_certificate(Json& json, const RecognitionStep& step, const RecognitionTask& task) {
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

Json to_json(const Interval& interval) { return {interval.low, interval.high}; }

Json unknown_to_json(const Evaluation& evaluation) {
  const Scores& unknown = *evaluation.unknown;
  Json json{{"records", unknown.records},
            {"called_none", unknown.right},
            {"share_called_none", unknown.accuracy()},
            {"share_interval", to_json(unknown.interval())}};
  if (const auto& against = evaluation.known_against_unknown) {
    json["area_under_curve"] = {{"score", against->score},
                                {"known", against->known},
                                {"unknown", against->unknown},
                                {"area", against->area},
                                {"standard_error", against->standard_error}};
  }
  return json;
}

Json to_json(const Median& median) { return {{"records", median.count}, {"median", median.value}}; }

/// The truth as it was given.
Json truth_to_json(const PartialTruth& truth) {
  Json json{{"object", truth.label}};
  if (truth.T_object_robot) {
    json["T_robot_object"] = to_json(inverse(*truth.T_object_robot));
  }
  return json;
}

}  // namespace

std::string verdict_text(Verdict verdict) {
  return verdict == Verdict::fits       ? "fits"
         : verdict == Verdict::doubtful ? "doubtful"
                                        : "does not fit";
}

Json to_json(const RecognitionStep& step, const RecognitionTask& task, OptionWords words) {
  Json json;
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
                  {"map", task.map_paths[mode.object]}};
  json["mode"].update(named(mode.T_object_robot));
  json["mode"]["log_likelihood"] = mode.log_likelihood;
  const Hypothesis& hypothesis = task.hypotheses[static_cast<std::size_t>(mode.object)];
  if (hypothesis.map.mirror) {
    json["mode"]["mirrored"] = hypothesis.mirrored;
  }
  json["T_robot_object"] = to_json(step.mode_T_robot_object());
  if (!step.decision.because.empty()) {
    if (step.refined) {
      json["refined"]["share"] = step.places.share;
    }
    json["modes"] = Json::array();
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
    Json& fits = json["touch_fit"] = Json::array();
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

Json to_json(const RecognitionRecord& record, const RecognitionTask& task,
             const std::optional<std::string>& device, bool with_trace, OptionWords words) {
  Json json{{"recording", record.recording}};
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
  if (!task.sensor.file.empty()) {
    json["sensor_model"] = task.sensor.file;
  }
  if (device) {
    json["seconds"] = record.seconds;
    json["device"] = *device;
  }
  if (with_trace) {
    auto trace = Json::array();
    for (const RecognitionStep& step : record.trace) {
      trace.push_back(to_json(step, task, words));
    }
    json["trace"] = trace;
  }
  return json;
}

Json to_json(const Scores& scores) {
  Json json{{"records", scores.records},     {"right", scores.right},
            {"accuracy", scores.accuracy()}, {"accuracy_interval", to_json(scores.interval())},
            {"log_loss", scores.log_loss},   {"calibration_error", scores.calibration_error},
            {"reliability", Json::array()}};
  for (const ReliabilityBin& bin : scores.bins) {
    Json row{{"lower", bin.lower}, {"upper", bin.upper}, {"records", bin.records}};
    if (bin.records > 0) {
      row["mean_confidence"] = bin.mean_confidence;
      row["accuracy"] = bin.accuracy();
      row["accuracy_interval"] = to_json(bin.interval());
    }
    json["reliability"].push_back(row);
  }
  return json;
}

Json to_json(const Evaluation& evaluation, const JudgedResults& results) {
  Json json = to_json(evaluation.all);
  json["without_truth"] = results.without_truth;
  json["failed"] = results.failed;
  if (evaluation.known) {
    json["known_classes"] = to_json(*evaluation.known);
  }
  if (evaluation.unknown) {
    json["unknown_classes"] = unknown_to_json(evaluation);
  }
  json["classes"] = Json::array();
  json["confusion"] = {
      {"rows", Json::array()}, {"columns", evaluation.answers}, {"counts", Json::array()}};
  for (const ClassScores& scores : evaluation.classes) {
    json["classes"].push_back({{"class", scores.label},
                               {"known", scores.known},
                               {"records", scores.records},
                               {"right", scores.right},
                               {"recall", scores.accuracy()},
                               {"recall_interval", to_json(scores.interval())}});
    json["confusion"]["rows"].push_back(scores.label);
    json["confusion"]["counts"].push_back(scores.taken);
  }
  if (evaluation.error_mm) {
    json["error_mm"] = to_json(*evaluation.error_mm);
  }
  if (evaluation.refined_error_mm) {
    json["refined_error_mm"] = to_json(*evaluation.refined_error_mm);
  }
  return json;
}

Json to_json(const PlannedTouch& touch) {
  const TouchGain::StandardError& error = touch.gain.standard_error;
  Json json{{"index", touch.index}};
  json.update(named(touch.T_robot_sensor));
  json["gain"] = {{"identity", touch.gain.identity},
                  {"pose", touch.gain.pose},
                  {"both", touch.gain.both()},
                  {"standard_error",
                   {{"identity", error.identity}, {"pose", error.pose}, {"both", error.both}}}};
  return json;
}

Json to_json(const Plan& plan, const RecognitionTask& task, const std::string& device,
             OptionWords words) {
  Json json{{"recording", plan.record.recording},
            {"touches", plan.record.touches},
            {"goal", goal_word(plan.goal)},
            {"believed", to_json(plan.record.last(), task, words)}};
  json["believed"]["entropy"] = {{"identity", plan.identity_nats},
                                 {"pose", plan.both_nats - plan.identity_nats},
                                 {"both", plan.both_nats}};
  json["candidates"] = Json::array();
  for (const PlannedTouch& touch : plan.ranked) {
    json["candidates"].push_back(to_json(touch));
  }
  if (json["believed"].contains("warnings")) {
    json["warnings"] = json["believed"]["warnings"];
  }
  if (const std::string limit = limit_words(plan); !limit.empty()) {
    json["warnings"].push_back(words(limit));
  }
  json["samples"] = plan.samples.size();
  json["seed"] = plan.seed;
  json["seconds"] = plan.seconds;
  json["device"] = device;
  return json;
}

Json to_json(const SetupFinding& finding, OptionWords words) {
  Json json{{"what", finding.what}, {"nats", finding.nats}, {"words", words(finding.words)}};
  if (!finding.options.empty()) {
    json["flag"] = words(fmt::format("`{}`", fmt::join(finding.options, "` `")));
  }
  if (finding.array_offset) {
    const Pose& offset = *finding.array_offset;
    json["array_offset"] = {offset.translation_mm.x, offset.translation_mm.y, offset.theta_rad};
    json["sd"] = *finding.sd;
  }
  return json;
}

Json to_json(const LiveTouch& touch, const RecognitionTask& task) {
  Json json{{"time", 0.5 * (touch.touch.begin_s + touch.touch.end_s)},
            {"unknown", touch.unknown},
            {"touch", touch.index},
            {"pose", named(*touch.touch.T_robot_sensor)}};
  json.update(to_json(touch.step, task));
  if (!touch.step.truth.label.empty()) {
    json["truth"] = truth_to_json(touch.step.truth);
  }
  json["latency_ms"] = touch.latency_ms;
  json["frames_lost"] = touch.frames_lost;
  if (!touch.left_out.empty()) {
    json["left_out"] = touch.left_out;
  }
  return json;
}

std::string plan_line(const LiveTouch& touch) {
  Json json{
      {"unknown", touch.unknown}, {"touch", touch.index}, {"next", to_json(touch.next.value())}};
  json["next"].erase("index");  // of a grid that nobody else knows
  return text_of(json);
}

std::string text_of(const Json& json, int indent) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace palpate
