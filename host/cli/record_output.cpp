#include "record_output.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "options.hpp"

namespace palpate::cli {

namespace {

nlohmann::ordered_json to_json(const RefinedPose& refined) {
  auto rows = nlohmann::ordered_json::array();
  for (std::size_t row = 0; row < 3; ++row) {
    const double* values = &refined.covariance[3 * row];
    rows.push_back({values[0], values[1], values[2]});
  }
  return {{"x_mm", refined.T_object_robot.translation_mm.x},
          {"y_mm", refined.T_object_robot.translation_mm.y},
          {"theta_rad", refined.T_object_robot.theta_rad},
          {"covariance", rows}};
}

nlohmann::ordered_json to_json(std::optional<double> error_mm) {
  return error_mm ? nlohmann::ordered_json(*error_mm) : nullptr;
}

/// Prints what the labels that were not always right were taken for, most often first.
void print_confusions(const std::vector<RecognitionRecord>& records, const RecognitionTask& task) {
  struct Row {
    int all = 0;
    int right = 0;
    std::map<std::string, int> wrong;
  };
  std::map<std::string, Row> rows;
  for (const RecognitionRecord& record : records) {
    if (const auto right = record.last().right) {
      Row& row = rows[record.true_label];
      ++row.all;
      ++(*right ? row.right : row.wrong[task.labels[record.last().best]]);
    }
  }
  if (std::all_of(rows.begin(), rows.end(),
                  [](const auto& row) { return row.second.right == row.second.all; })) {
    return;
  }
  fmt::print("\n{:<16} {:>9}  taken for\n", "object", "right");
  for (const auto& [label, row] : rows) {
    std::vector<std::pair<int, std::string>> wrong;
    for (const auto& [other, count] : row.wrong) {
      wrong.emplace_back(-count, other);
    }
    std::sort(wrong.begin(), wrong.end());
    std::string list;
    for (const auto& [count, other] : wrong) {
      list += fmt::format("{}{} {}", list.empty() ? "" : ", ", -count, other);
    }
    fmt::print("{:<16} {:>4} of {:<2}  {}\n", label, row.right, row.all, list);
  }
}

}  // namespace

std::string error_text(std::optional<double> error_mm) {
  return error_mm ? fmt::format("{:.2f}", *error_mm) : "-";
}

std::string filter_words(const Recogniser& recogniser, const RecognitionTask& task) {
  if (const auto* particles = std::get_if<ParticleOptions>(&task.filter)) {
    return fmt::format(
        "{} particles, {} resampling{}, seed {}", particles->particles,
        particles->resampling == Resampling::multinomial ? "multinomial" : "systematic",
        particles->augmented ? ", random particles added" : "", particles->seed);
  }
  const PoseLattice& lattice = task.lattice();
  return fmt::format("{} x {} x {} bins each, in {}", lattice.x_mm.count, lattice.y_mm.count,
                     lattice.theta_rad.count, fmt::join(recogniser.histogram()->paths(), "; "));
}

nlohmann::ordered_json to_json(const RecognitionStep& step, const RecognitionTask& task) {
  nlohmann::ordered_json identity;
  for (std::size_t i = 0; i < task.labels.size(); ++i) {
    identity[task.labels[i]] = step.identity[i];
  }
  const Mode& mode = step.mode;
  const Pose T_robot_object = inverse(mode.T_object_robot);
  nlohmann::ordered_json json{{"best", task.labels[step.best]},
                              {"identity", identity},
                              {"mode",
                               {{"object", task.labels[task.label_of[mode.object]]},
                                {"map", task.map_paths[mode.object]},
                                {"x_mm", mode.T_object_robot.translation_mm.x},
                                {"y_mm", mode.T_object_robot.translation_mm.y},
                                {"theta_rad", mode.T_object_robot.theta_rad},
                                {"log_likelihood", mode.log_likelihood}}}};
  if (step.refined) {
    json["refined"] = to_json(*step.refined);
  }
  json["T_robot_object"] = {T_robot_object.translation_mm.x, T_robot_object.translation_mm.y,
                            wrap_angle(T_robot_object.theta_rad, 2.0 * std::numbers::pi)};
  if (step.right) {
    json["right"] = *step.right;
    json["error_mm"] = to_json(step.error_mm);
    if (step.refined) {
      json["refined_error_mm"] = to_json(step.refined_error_mm);
    }
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
                               const std::string& device, bool with_trace) {
  nlohmann::ordered_json json{{"recording", record.recording}};
  if (record.frame) {
    json["frame"] = *record.frame;
  }
  json["touches"] = record.touches;
  json.update(to_json(record.last(), task));
  json["seconds"] = record.seconds;
  json["device"] = device;
  if (with_trace) {
    auto trace = nlohmann::ordered_json::array();
    for (const RecognitionStep& step : record.trace) {
      trace.push_back(to_json(step, task));
    }
    json["trace"] = trace;
  }
  return json;
}

std::string name_of(const RecognitionRecord& record) {
  const std::string file = std::filesystem::path(record.recording).filename().string();
  return record.frame ? fmt::format("{} frame {}", file, *record.frame) : file;
}

void print_trace(const RecognitionRecord& record, const RecognitionTask& task) {
  const bool particles = record.last().effective_sample_size.has_value();
  fmt::print("{}\n  touch  best       probability     x mm     y mm  theta deg  error mm  {}\n",
             name_of(record), particles ? "effective particles" : " refined");
  for (std::size_t i = 0; i < record.trace.size(); ++i) {
    const RecognitionStep& step = record.trace[i];
    const Pose& T = step.mode.T_object_robot;
    const std::string last = particles ? fmt::format("{:>19.1f}", *step.effective_sample_size)
                                       : fmt::format("{:>8}", error_text(step.refined_error_mm));
    fmt::print("  {:>5}  {:<10} {:>11.6f} {:>8.2f} {:>8.2f} {:>10.1f}  {:>8} {}{}\n", i + 1,
               task.labels[step.best], step.identity[step.best], T.translation_mm.x,
               T.translation_mm.y, degrees(T.theta_rad), error_text(step.error_mm), last,
               step.contradicted ? "  contradicted" : "");
  }
}

void print_table(const std::vector<RecognitionRecord>& records, const RecognitionTask& task) {
  std::size_t width = 9;
  for (const RecognitionRecord& record : records) {
    width = std::max(width, name_of(record).size());
  }
  fmt::print(
      "{:<{}}  touches  best       probability     x mm     y mm  theta deg  truth      "
      "error mm  refined\n",
      "recording", width);
  int known = 0;
  int right = 0;
  int located = 0;
  double error_sum = 0.0;
  double refined_sum = 0.0;
  for (const RecognitionRecord& record : records) {
    const RecognitionStep& step = record.last();
    const Pose& T = step.mode.T_object_robot;
    fmt::print("{:<{}}  {:>7}  {:<10} {:>11.6f} {:>8.2f} {:>8.2f} {:>10.1f}  {:<10} {:>8} {:>8}\n",
               name_of(record), width, record.touches, task.labels[step.best],
               step.identity[step.best], T.translation_mm.x, T.translation_mm.y,
               degrees(T.theta_rad), record.true_label.empty() ? "-" : record.true_label,
               error_text(step.error_mm), error_text(step.refined_error_mm));
    known += step.right ? 1 : 0;
    right += step.right.value_or(false) ? 1 : 0;
    located += step.error_mm ? 1 : 0;
    error_sum += step.error_mm.value_or(0.0);
    refined_sum += step.refined_error_mm.value_or(0.0);
  }
  for (const RecognitionRecord& record : records) {
    if (record.last().contradicted) {
      fmt::print(
          "{}: contradicted: no map explains these touches at any pose tried; the object may be "
          "unknown, its pose outside the region, or gamma too small\n",
          name_of(record));
    }
  }
  if (known > 0) {
    fmt::print("{} of {} right ({:.1f} %)", right, known, 100.0 * right / known);
    if (located > 0) {
      fmt::print(", mean pose error {:.2f} mm", error_sum / located);
      if (records.front().last().refined) {
        fmt::print(", refined {:.2f} mm", refined_sum / located);
      }
    }
    fmt::print("\n");
    print_confusions(records, task);
  }
}

}  // namespace palpate::cli
