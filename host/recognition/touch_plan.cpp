#include "recognition/touch_plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "model/bounding_box.hpp"
#include "model/interpolated_map.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/touch.hpp"

namespace palpate {

namespace {

constexpr std::size_t most_places = 75;
constexpr std::size_t fewest_places = 25;
constexpr int angles = 4;

/// Where the array's centre touches the object in at least a tenth of the samples.
class Reach {
 public:
  Reach(std::span<const PoseSample> samples, const RecognitionTask& task, double half_array_mm)
      : samples_(samples) {
    std::vector<BoundingBox> boxes;
    for (const Hypothesis& hypothesis : task.hypotheses) {
      boxes.push_back(occupied_box(hypothesis.map));
      boxes.back().lower -= half_array_mm;
      boxes.back().upper += half_array_mm;
    }
    for (const PoseSample& sample : samples) {
      const BoundingBox& box = boxes[static_cast<std::size_t>(sample.object)];
      box_of_.push_back(box);
      const Pose T_robot_object = inverse(sample.T_object_robot);
      for (const double x : {box.lower.x, box.upper.x}) {
        for (const double y : {box.lower.y, box.upper.y}) {
          around_.take_in(T_robot_object * glm::dvec2(x, y));
        }
      }
    }
  }

  bool contains(const glm::dvec2& p_robot) const {
    std::size_t hits = 0;
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const glm::dvec2 p = samples_[i].T_object_robot * p_robot;
      const BoundingBox& box = box_of_[i];
      hits += p.x >= box.lower.x && p.x <= box.upper.x && p.y >= box.lower.y && p.y <= box.upper.y
                  ? 1
                  : 0;
    }
    return 10 * hits >= samples_.size();
  }

  /// Places of a square grid about the middle.
  std::vector<glm::dvec2> places(double step_mm) const {
    std::vector<glm::dvec2> found;
    const glm::dvec2 middle = around_.middle();
    const glm::dvec2 half = around_.extent() / (2.0 * step_mm);
    const int columns = static_cast<int>(std::floor(half.x));
    const int rows = static_cast<int>(std::floor(half.y));
    for (int j = -rows; j <= rows; ++j) {
      for (int i = -columns; i <= columns; ++i) {
        const glm::dvec2 place = middle + step_mm * glm::dvec2(i, j);
        if (contains(place)) {
          found.push_back(place);
        }
      }
    }
    return found;
  }

  /// No step below this makes more places than a grid can be searched for.
  double least_step_mm() const {
    constexpr double most_columns = 100.0;
    return std::max(around_.extent().x, around_.extent().y) / most_columns;
  }

 private:
  std::span<const PoseSample> samples_;
  std::vector<BoundingBox> box_of_;  ///< [sample] in the object frame, wider by half an array
  BoundingBox around_;               ///< all of them, in the robot frame
};

}  // namespace

double gain_for(const TouchGain& gain, PlanGoal goal) {
  return goal == PlanGoal::identity ? gain.identity
         : goal == PlanGoal::pose   ? gain.pose
                                    : gain.both();
}

std::vector<PlannedTouch> rank_touches(const PoseHistogram& histogram, const RecognitionTask& task,
                                       std::span<const Pose> T_robot_sensor,
                                       std::span<const glm::dvec2> elements_mm, PlanGoal goal,
                                       const PlanOptions& options) {
  PlanOptions by_label = options;
  by_label.label_of = task.label_of;
  const std::vector<TouchGain> gains =
      histogram.expected_gain(T_robot_sensor, elements_mm, by_label);
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
  const glm::dvec2 extent = bounding_box(elements_mm).extent();
  const double side_mm = std::min(extent.x, extent.y);
  const Reach reach(samples, task, side_mm / 2.0);
  // An array of one row has no smaller side.
  double step_mm = std::max(side_mm / 2.0, reach.least_step_mm());
  std::vector<glm::dvec2> places = reach.places(step_mm);
  while (places.size() < fewest_places && 0.8 * step_mm > reach.least_step_mm()) {
    step_mm *= 0.8;
    places = reach.places(step_mm);
  }
  while (places.size() > most_places) {
    step_mm *= 1.1;
    places = reach.places(step_mm);
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

OccupancyField expected_occupancy(std::span<const PoseSample> samples, const RecognitionTask& task,
                                  const glm::dvec2& lower_mm, const glm::dvec2& upper_mm,
                                  int cells) {
  const glm::dvec2 extent = upper_mm - lower_mm;
  OccupancyField field{
      .lower_mm = lower_mm, .cell_mm = std::max(extent.x, extent.y) / cells, .probability = {}};
  field.nx = std::max(1, static_cast<int>(std::lround(extent.x / field.cell_mm)));
  field.ny = std::max(1, static_cast<int>(std::lround(extent.y / field.cell_mm)));
  field.probability.assign(static_cast<std::size_t>(field.nx) * field.ny, 0.0);
  for (const PoseSample& sample : samples) {
    const Hypothesis& hypothesis = task.hypotheses[static_cast<std::size_t>(sample.object)];
    const OccupancyGrid& map = hypothesis.map;
    const InterpolatedMap interpolated(
        map, hypothesis.layer ? map.prior : task.contact().prior.value_or(map.prior));
    for (int j = 0; j < field.ny; ++j) {
      for (int i = 0; i < field.nx; ++i) {
        const glm::dvec2 place = lower_mm + field.cell_mm * glm::dvec2(i + 0.5, j + 0.5);
        field.probability[static_cast<std::size_t>(j) * field.nx + i] +=
            probability_from_log_odds(interpolated.log_odds(sample.T_object_robot * place)) /
            static_cast<double>(samples.size());
      }
    }
  }
  return field;
}

}  // namespace palpate
