#include "recognition/result_json.hpp"

#include <algorithm>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "recognition/record_json.hpp"

namespace palpate {

namespace {

using Json = nlohmann::ordered_json;

Json to_json(const Interval& interval) { return {interval.low, interval.high}; }

Json unknown_to_json(const Evaluation& evaluation) {
  const Scores& unknown = *evaluation.unknown;
  Json json{{"records", unknown.records},
            {"called_none", unknown.right},
            {"share_called_none", unknown.accuracy()},
            {"share_interval", to_json(unknown.interval())}};
  if (const auto& against = evaluation.known_against_unknown) {
    json["area_under_curve"] = {{"score", name_of(against->score)},
                                {"known", against->known},
                                {"unknown", against->unknown},
                                {"area", against->area},
                                {"standard_error", against->standard_error}};
  }
  return json;
}

Json to_json(const Median& median) { return {{"records", median.count}, {"median", median.value}}; }

}  // namespace

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
                               {"recall", scores.recall()},
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
  const Pose& pose = touch.T_robot_sensor;
  const TouchGain::StandardError& error = touch.gain.standard_error;
  return {{"index", touch.index},
          {"x_mm", pose.translation_mm.x},
          {"y_mm", pose.translation_mm.y},
          {"theta_rad", pose.theta_rad},
          {"gain",
           {{"identity", touch.gain.identity},
            {"pose", touch.gain.pose},
            {"both", touch.gain.both()},
            {"standard_error",
             {{"identity", error.identity}, {"pose", error.pose}, {"both", error.both}}}}}};
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
  std::vector<std::string> warnings = warnings_of(plan);
  std::ranges::transform(warnings, warnings.begin(), words);
  if (!warnings.empty()) {
    json["warnings"] = warnings;
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

}  // namespace palpate
