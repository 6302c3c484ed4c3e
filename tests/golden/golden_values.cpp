#include "golden_values.hpp"

#include <array>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "reference/reference.hpp"

namespace palpate {

namespace {

using nlohmann::json;

json to_json(const std::vector<double>& values) {
  json array = json::array();
  for (const double value : values) {
    array.push_back(rounded(value));
  }
  return array;
}

json to_json(const glm::dvec2& p) { return {rounded(p.x), rounded(p.y)}; }

json to_json(const Pose& pose) {
  return {rounded(pose.translation_mm.x), rounded(pose.translation_mm.y), rounded(pose.theta_rad)};
}

json to_json(const Axis& axis) { return {rounded(axis.lower), rounded(axis.upper), axis.count}; }

glm::dvec2 point_from(const json& j) { return {j[0].get<double>(), j[1].get<double>()}; }

Pose pose_from(const json& j) { return {point_from(j), j[2].get<double>()}; }

Axis axis_from(const json& j) { return {j[0].get<double>(), j[1].get<double>(), j[2].get<int>()}; }

json to_json(const Recording& recording) {
  json j{{"pressure_kpa", to_json(recording.pressure)}};
  for (const glm::dvec2& element : recording.elements_mm) {
    j["elements_mm"].push_back(to_json(element));
  }
  for (const Pose& pose : recording.T_robot_sensor) {
    j["T_robot_sensor"].push_back(to_json(pose));
  }
  if (recording.truth) {
    j["true_object"] = recording.truth->object;
    j["true_T_object_robot"] = to_json(recording.truth->T_object_robot);
  }
  return j;
}

Recording recording_from(const json& j) {
  Recording recording;
  recording.pressure = j.at("pressure_kpa").get<std::vector<double>>();
  for (const json& element : j.at("elements_mm")) {
    recording.elements_mm.push_back(point_from(element));
  }
  for (const json& pose : j.at("T_robot_sensor")) {
    recording.T_robot_sensor.push_back(pose_from(pose));
  }
  if (j.contains("true_object")) {
    recording.truth = Truth{j.at("true_object"), pose_from(j.at("true_T_object_robot"))};
  }
  return recording;
}

json to_json(const GoldenValues::Object& object) {
  const OccupancyGrid& map = object.map;
  return {{"label", map.label},
          {"symmetry", map.symmetry},
          {"training", to_json(object.training)},
          {"cell_mm", map.cell_mm},
          {"origin_mm", to_json(map.origin_mm)},
          {"nx", map.nx},
          {"ny", map.ny},
          {"log_odds", to_json(object.log_odds)}};
}

GoldenValues::Object object_from(const json& j, double prior) {
  GoldenValues::Object object;
  object.training = recording_from(j.at("training"));
  object.log_odds = j.at("log_odds").get<std::vector<double>>();
  object.map = {.label = j.at("label"),
                .cell_mm = j.at("cell_mm"),
                .origin_mm = point_from(j.at("origin_mm")),
                .prior = prior,
                .symmetry = j.at("symmetry"),
                .nx = j.at("nx"),
                .ny = j.at("ny"),
                .log_odds = {object.log_odds.begin(), object.log_odds.end()}};
  return object;
}

json to_json(const GoldenValues::Unknown& unknown) {
  json j{{"touches", to_json(unknown.touches)}, {"error_mm", rounded(unknown.error_mm)}};
  for (const GoldenValues::Step& step : unknown.trace) {
    j["trace"].push_back({{"identity", to_json(step.identity)},
                          {"max_log_likelihood", rounded(step.max_log_likelihood)}});
  }
  for (const std::vector<double>& bins : unknown.log_likelihood) {
    j["log_likelihood"].push_back(to_json(bins));
  }
  return j;
}

GoldenValues::Unknown unknown_from(const json& j) {
  GoldenValues::Unknown unknown;
  unknown.touches = recording_from(j.at("touches"));
  unknown.error_mm = j.at("error_mm");
  for (const json& step : j.at("trace")) {
    unknown.trace.push_back(
        {step.at("identity").get<std::vector<double>>(), step.at("max_log_likelihood")});
  }
  unknown.log_likelihood = j.at("log_likelihood").get<std::vector<std::vector<double>>>();
  return unknown;
}

}  // namespace

double rounded(double value) { return std::stod(fmt::format("{:.10g}", value)); }

void compute_expected(GoldenValues& golden) {
  const HistogramOptions& options = golden.histogram_options;
  for (GoldenValues::Object& object : golden.objects) {
    object.log_odds =
        reference::log_odds_map(object.training.touches(0, object.training.size()), object.map,
                                golden.map_options.classifier, golden.map_options.sensor);
    for (double& log_odds : object.log_odds) {
      log_odds = rounded(log_odds);
    }
    object.map.log_odds.assign(object.log_odds.begin(), object.log_odds.end());
  }
  for (GoldenValues::Unknown& unknown : golden.unknowns) {
    const std::size_t objects = golden.objects.size();
    reference::Posterior posterior{
        .lattice = options.lattice,
        .log_likelihood = {objects, std::vector<double>(options.lattice.bins(), 0.0)},
        .weight = std::vector<double>(objects, 1.0)};
    unknown.trace.clear();
    reference::Mode mode;
    for (const Touch& touch : unknown.touches.touches(0, unknown.touches.size())) {
      for (std::size_t object = 0; object < objects; ++object) {
        const std::vector<double> logs = reference::log_likelihoods(
            {&touch, 1}, options.lattice, golden.objects[object].map, options.contact);
        for (std::size_t bin = 0; bin < logs.size(); ++bin) {
          posterior.log_likelihood[object][bin] += logs[bin];
        }
      }
      mode = reference::mode(posterior);
      unknown.trace.push_back(
          {reference::identity(posterior), posterior.log_likelihood[mode.object][mode.bin]});
    }
    unknown.log_likelihood = posterior.log_likelihood;
    unknown.error_mm = reference::pose_error_mm(golden.objects[mode.object].map,
                                                reference::bin_pose(options.lattice, mode.bin),
                                                unknown.touches.truth->T_object_robot);
  }
}

std::vector<Hypothesis> hypotheses(const GoldenValues& golden) {
  std::vector<Hypothesis> result;
  for (const GoldenValues::Object& object : golden.objects) {
    result.push_back({object.map, 1.0});
  }
  return result;
}

GoldenValues read_golden(const std::filesystem::path& path) {
  std::ifstream file(path);
  const json j = json::parse(file);
  GoldenValues golden;
  golden.map_options = {
      .cell_mm = j.at("cell_mm"),
      .sensor = {.spread_mm = j.at("spread_mm"), .peak = j.at("peak"), .prior = j.at("prior")},
      .classifier = {.threshold = j.at("threshold_kpa"), .ratio = j.at("ratio")}};
  golden.histogram_options = {.lattice = {.x_mm = axis_from(j.at("x_mm")),
                                          .y_mm = axis_from(j.at("y_mm")),
                                          .theta_rad = axis_from(j.at("theta_rad")),
                                          .pivot_mm = point_from(j.at("pivot_mm"))},
                              .contact = {.classifier = golden.map_options.classifier,
                                          .gamma = j.at("gamma"),
                                          .prior = golden.map_options.sensor.prior}};
  for (const json& object : j.at("objects")) {
    golden.objects.push_back(object_from(object, golden.map_options.sensor.prior));
  }
  for (const json& unknown : j.at("unknowns")) {
    golden.unknowns.push_back(unknown_from(unknown));
  }
  return golden;
}

void write_golden(const std::filesystem::path& path, const GoldenValues& golden) {
  const MapOptions& map = golden.map_options;
  const HistogramOptions& histogram = golden.histogram_options;
  json j{{"cell_mm", map.cell_mm},
         {"spread_mm", map.sensor.spread_mm},
         {"peak", map.sensor.peak},
         {"prior", map.sensor.prior},
         {"threshold_kpa", map.classifier.threshold},
         {"ratio", map.classifier.ratio},
         {"gamma", histogram.contact.gamma},
         {"x_mm", to_json(histogram.lattice.x_mm)},
         {"y_mm", to_json(histogram.lattice.y_mm)},
         {"theta_rad", to_json(histogram.lattice.theta_rad)},
         {"pivot_mm", to_json(histogram.lattice.pivot_mm)}};
  for (const GoldenValues::Object& object : golden.objects) {
    j["objects"].push_back(to_json(object));
  }
  for (const GoldenValues::Unknown& unknown : golden.unknowns) {
    j["unknowns"].push_back(to_json(unknown));
  }
  std::ofstream file(path);
  file << j << '\n';
}

}  // namespace palpate
