#include "recognition/touch_plan.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "io/input_file.hpp"
#include "io/pose_table.hpp"
#include "io/recording_rules.hpp"
#include "model/bounding_box.hpp"
#include "options/option.hpp"
#include "palpate/files.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/touch.hpp"
#include "recognition/label_probability.hpp"

namespace palpate {

namespace {

constexpr std::array goal_words{"identity", "pose", "both"};  ///< [PlanGoal]

/// The poses of a file: of a recording's touches, or the rows of a table.
std::vector<Pose> read_candidates(const std::filesystem::path& path,
                                  const std::function<void(const std::string&)>& tell) {
  const std::string extension = path.extension().string();
  if (extension == ".h5" || extension == ".hdf5") {
    Recording recording = read_recording(path);
    require_rows_of_touches(recording);
    return std::move(recording.T_robot_sensor);
  }
  const PoseTable table = read_poses(path, {.header_line = {}, .may_name_poses = false}, false);
  if (!table.spatial.empty()) {
    refuse(path, "has poses in space; give x, y and theta in the plane of the touches");
  }
  if (!table.assumed_units.empty()) {
    tell(fmt::format("{}: {}; name the columns x_mm, y_mm, theta_deg for others", path.string(),
                     table.assumed_units));
  }
  return table.T_robot_sensor;
}

/// Entropy of the labels in nats, "(none)" left out.
double label_entropy(std::span<const double> identity, const RecognitionTask& task) {
  double total = 0.0;
  for (std::size_t i = 0; i < identity.size(); ++i) {
    total += task.labels[i] == none_label ? 0.0 : identity[i];
  }
  double entropy = 0.0;
  for (std::size_t i = 0; i < identity.size(); ++i) {
    if (task.labels[i] != none_label && identity[i] > 0.0) {
      entropy -= identity[i] / total * std::log(identity[i] / total);
    }
  }
  return entropy;
}

}  // namespace

PlanGoal parse_goal(std::string_view option, const std::string& text) {
  const auto word = std::ranges::find(goal_words, text);
  if (word == goal_words.end()) {
    refuse_option(option, text, "not known; use identity, pose or both");
  }
  return static_cast<PlanGoal>(word - goal_words.begin());
}

std::string goal_word(PlanGoal goal) { return goal_words[static_cast<std::size_t>(goal)]; }

double gain_for(const TouchGain& gain, PlanGoal goal) {
  return goal == PlanGoal::identity ? gain.identity
         : goal == PlanGoal::pose   ? gain.pose
                                    : gain.both();
}

std::vector<glm::dvec2> living_elements(const Touch& touch) {
  std::vector<glm::dvec2> living;
  for (std::size_t e = 0; e < touch.elements_mm.size(); ++e) {
    if (touch.valid.empty() || touch.valid[e] != 0) {
      living.push_back(touch.elements_mm[e]);
    }
  }
  return living;
}

std::vector<PlannedTouch> rank_touches(const Recogniser& recogniser, const RecognitionTask& task,
                                       std::span<const Pose> T_robot_sensor,
                                       std::span<const glm::dvec2> elements_mm, PlanGoal goal,
                                       const PlanOptions& options) {
  PlanOptions by_label = options;
  by_label.label_of = task.label_of;
  const std::vector<TouchGain> gains =
      recogniser.filter().expected_gain(T_robot_sensor, elements_mm, by_label);
  std::vector<PlannedTouch> ranked;
  for (std::size_t i = 0; i < gains.size(); ++i) {
    ranked.push_back({i, T_robot_sensor[i], gains[i]});
  }
  std::ranges::stable_sort(ranked, std::ranges::greater{}, [&](const PlannedTouch& touch) {
    const double gain = gain_for(touch.gain, goal);
    return std::pair(gain < least_gain_nats ? 0.0 : gain, touch.gain.both());
  });
  return ranked;
}

std::vector<Pose> candidate_grid(std::span<const PoseSample> samples, const RecognitionTask& task,
                                 std::span<const glm::dvec2> elements_mm, double theta_rad) {
  constexpr std::size_t most_places = 75;
  constexpr std::size_t fewest_places = 25;
  constexpr double most_columns = 100.0;  // no grid of more can be searched
  constexpr int angles = 4;
  const glm::dvec2 extent = bounding_box(elements_mm).extent();
  const double side_mm = std::min(extent.x, extent.y);
  std::vector<BoundingBox> boxes;  // [hypothesis] in the object frame, wider by half an array
  for (const Hypothesis& hypothesis : task.hypotheses) {
    boxes.push_back(occupied_box(hypothesis.map));
    boxes.back().lower -= side_mm / 2.0;
    boxes.back().upper += side_mm / 2.0;
  }
  BoundingBox around;  // all samples' boxes, in the robot frame
  for (const PoseSample& sample : samples) {
    const auto& [lower, upper] = boxes[static_cast<std::size_t>(sample.object)];
    const Pose T_robot_object = inverse(sample.T_object_robot);
    for (const double x : {lower.x, upper.x}) {
      for (const double y : {lower.y, upper.y}) {
        around.take_in(T_robot_object * glm::dvec2(x, y));
      }
    }
  }
  const auto is_touched = [&](const glm::dvec2& p_robot) {
    const auto hits = std::ranges::count_if(samples, [&](const PoseSample& sample) {
      const glm::dvec2 p = sample.T_object_robot * p_robot;
      const BoundingBox& box = boxes[static_cast<std::size_t>(sample.object)];
      return p.x >= box.lower.x && p.x <= box.upper.x && p.y >= box.lower.y && p.y <= box.upper.y;
    });
    return 10 * static_cast<std::size_t>(hits) >= samples.size();
  };
  const auto places_of = [&](double step_mm) {
    std::vector<glm::dvec2> found;
    const glm::ivec2 half(around.extent() / (2.0 * step_mm));
    for (int j = -half.y; j <= half.y; ++j) {
      for (int i = -half.x; i <= half.x; ++i) {
        const glm::dvec2 place = around.middle() + step_mm * glm::dvec2(i, j);
        if (is_touched(place)) {
          found.push_back(place);
        }
      }
    }
    return found;
  };
  const double least_step_mm = std::max(around.extent().x, around.extent().y) / most_columns;
  // An array of one row has no smaller side.
  double step_mm = std::max(side_mm / 2.0, least_step_mm);
  std::vector<glm::dvec2> places = places_of(step_mm);
  while (places.size() < fewest_places && 0.8 * step_mm > least_step_mm) {
    step_mm *= 0.8;
    places = places_of(step_mm);
  }
  while (places.size() > most_places) {
    step_mm *= 1.1;
    places = places_of(step_mm);
  }
  if (places.empty()) {  // the belief is so wide that no place is touched in a tenth of it
    for (const PoseSample& sample : samples.subspan(0, std::min(samples.size(), most_places))) {
      const OccupancyGrid& map = task.hypotheses[static_cast<std::size_t>(sample.object)].map;
      places.push_back(inverse(sample.T_object_robot) * occupied_box(map).middle());
    }
  }
  const glm::dvec2 centre = array_centre_mm(elements_mm);
  std::vector<Pose> candidates;
  for (const glm::dvec2& place : places) {
    for (int k = 0; k < angles; ++k) {
      const double theta =
          wrap_angle(theta_rad + k * std::numbers::pi / angles, 2.0 * std::numbers::pi);
      candidates.push_back({place - rotate(theta, centre), theta});
    }
  }
  return candidates;
}

void require_reachable(const std::string& source, std::span<const Pose> candidates) {
  constexpr std::size_t most_candidates = 1'000'000;
  if (candidates.empty()) {
    refuse(source, "holds no pose; write one for each candidate touch");
  }
  if (candidates.size() > most_candidates) {
    refuse(source, "holds {} poses; give at most {}", candidates.size(), most_candidates);
  }
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Pose& pose = candidates[i];
    if (!(std::abs(pose.translation_mm.x) <= farthest_mm &&
          std::abs(pose.translation_mm.y) <= farthest_mm && std::isfinite(pose.theta_rad))) {
      refuse(source, "pose {} (counted from 0) is unknown or out of reach; give x, y and theta", i);
    }
  }
}

PlanRequest plan_request(const std::string& goal, const std::string& candidates,
                         std::size_t samples, std::uint64_t seed,
                         const std::function<void(const std::string&)>& tell) {
  constexpr std::size_t most_samples = 4096;
  PlanRequest request{.goal = parse_goal("goal", goal),
                      .options = {.samples = samples, .seed = seed}};
  if (samples < 2 || samples > most_samples) {
    refuse_option("samples", samples, "give 2 to {}", most_samples);
  }
  if (candidates != candidate_grid_word) {
    request.candidates = read_candidates(candidates, tell);
    require_reachable(candidates, request.candidates);
  }
  return request;
}

void require_plannable(const RecognitionTask& task) {
  if (!traits_of(task.filter).bins) {
    refuse_option("filter", "particles",
                  "{}; use `filter bounded` or `filter histogram`, or leave it out", plan_needs);
  }
}

Plan plan_touch(Recogniser& recogniser, const RecognitionTask& task, const Query& unknown,
                const PlanRequest& request, const std::function<void(double)>& progress) {
  if (unknown.touches.empty()) {
    refuse(unknown.recording, "has no touches; give a recording with at least one");
  }
  Plan plan{.goal = request.goal,
            .elements_mm = living_elements(unknown.touches.front()),
            .seed = request.options.seed};
  if (plan.elements_mm.empty()) {
    refuse(unknown.recording, "valid: every element is dead; a touch would tell nothing");
  }
  plan.record = recognise(recogniser, task, unknown, false, progress);
  plan.record.require_steps();
  const auto start = std::chrono::steady_clock::now();
  const Filter& belief = recogniser.filter();
  plan.samples = belief.sample(request.options.samples, request.options.seed);
  const std::vector<Pose> candidates =
      request.candidates.empty() ? candidate_grid(plan.samples, task, plan.elements_mm,
                                                  unknown.touches.front().T_robot_sensor.theta_rad)
                                 : request.candidates;
  plan.ranked =
      rank_touches(recogniser, task, candidates, plan.elements_mm, request.goal, request.options);
  plan.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  // Gains are of the belief before temperature and features.
  plan.identity_nats = label_entropy(sums_by_label(belief.estimate({}), task), task);
  plan.both_nats = belief.entropy().value();
  return plan;
}

std::string limit_words(const Plan& plan) {
  constexpr double near_nats = 0.5;
  const double gain = gain_for(plan.ranked.front().gain, plan.goal);
  const auto samples = plan.samples.size();
  const double most_nats = std::log(static_cast<double>(samples));
  if (gain > most_nats - near_nats) {
    return fmt::format(
        "{} samples cannot show more than {:.2f} nats, and the best gain is near that: the first "
        "candidates may not be in order; give more `samples`",
        samples, most_nats);
  }
  const TouchGain unknown{.identity = plan.identity_nats,
                          .pose = plan.both_nats - plan.identity_nats};
  if (gain <= gain_for(unknown, plan.goal) + least_gain_nats) {
    return "";
  }
  return plan.goal == PlanGoal::identity
             ? fmt::format(
                   "the best gain is above what is unknown: {} samples stand for the belief only "
                   "roughly; give more `samples`",
                   samples)
             : "the best gain is above what is unknown, which is counted in bins: the touch tells "
               "also where in its bin the pose is";
}

}  // namespace palpate
