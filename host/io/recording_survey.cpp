#include "io/recording_survey.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "io/available_memory.hpp"
#include "model/lost_count.hpp"
#include "model/stream_time.hpp"
#include "palpate/contact.hpp"
#include "palpate/touch_detector.hpp"

namespace palpate {

namespace {

class Survey {
 public:
  explicit Survey(const std::filesystem::path& path) : path_(path) {}

  RecordingSurvey run() {
    scan_recording(path_, {.head = [&](const RecordingHead& head) { begin(head); },
                           .pressure =
                               [&](std::span<const double> values) {
                                 result_.pressure.add(result_.head.recording, values);
                               },
                           .T_robot_sensor =
                               [&](std::span<const Pose> poses) {
                                 for (const Pose& pose : poses) {
                                   take(pose);
                                 }
                               },
                           .elements_mm =
                               [&](std::span<const glm::dvec2> places) {
                                 for (const glm::dvec2& place : places) {
                                   take(place);
                                 }
                               },
                           .time_s =
                               [&](std::span<const double> times) {
                                 for (const double time_s : times) {
                                   take_time(time_s);
                                 }
                               },
                           .device_time_s = [](std::span<const double>) {},
                           .lost_before =
                               [&](std::span<const std::uint64_t> counts) {
                                 result_.lost = result_.lost.value_or(0);
                                 for (const std::uint64_t count : counts) {
                                   count_lost(*result_.lost, count);
                                 }
                               }});
    result_.spacing = spacing_of(places_mm_);
    if (result_.spacing) {
      for (std::size_t& element : result_.spacing->closest) {
        element = placed_[element];
      }
    }
    return std::move(result_);
  }

 private:
  void begin(const RecordingHead& head) {
    // Per element: what is surveyed of it, its place, and what spacing_of() holds.
    constexpr std::uint64_t bytes =
        sizeof(ElementSurvey) + sizeof(glm::dvec2) + 2 * sizeof(std::size_t);
    require_memory(path_, fmt::format("a survey of {} elements", head.elements),
                   head.elements * bytes);
    result_.head = head;
    if (head.recording.pressure_unit == "kPa") {
      result_.threshold = ContactClassifier{}.threshold;
    }
    result_.pressure.begin(head.elements, result_.threshold);
  }

  void take(const Pose& T_robot_sensor) {
    const auto& [t, theta_rad] = T_robot_sensor;
    if (std::isnan(theta_rad)) {
      return;
    }
    ++result_.with_pose;
    if (!result_.poses) {
      result_.poses = {{t.x, t.x}, {t.y, t.y}, {theta_rad, theta_rad}};
    }
    result_.poses->x_mm.include(t.x);
    result_.poses->y_mm.include(t.y);
    result_.poses->theta_rad.include(theta_rad);
  }

  void take(const glm::dvec2& place_mm) {
    const std::uint64_t k = place_++;
    const std::vector<std::uint8_t>& valid = result_.head.recording.valid;
    const std::uint64_t e = result_.head.elements;
    if (!valid.empty() && valid[valid.size() == e ? k % e : k] == 0) {
      return;
    }
    if (!result_.array) {
      result_.array = {{place_mm.x, place_mm.x}, {place_mm.y, place_mm.y}};
    }
    result_.array->x_mm.include(place_mm.x);
    result_.array->y_mm.include(place_mm.y);
    if (k < e) {
      places_mm_.push_back(place_mm);
      placed_.push_back(k);
    }
  }

  void take_time(double time_s) {
    const double before_s = last_s_.value_or(time_s);
    if (time_s < before_s && result_.times_back++ == 0) {
      result_.first_back = row_;
    }
    result_.long_steps += time_s - before_s > TouchDetectorOptions{}.largest_gap_s ? 1 : 0;
    result_.elapsed_s = time_.advance(time_s);
    last_s_ = time_s;
    ++row_;
  }

  const std::filesystem::path& path_;
  RecordingSurvey result_;
  std::vector<glm::dvec2> places_mm_;  ///< of the living elements in the first row
  std::vector<std::size_t> placed_;    ///< their indices in the array
  std::uint64_t place_ = 0;            ///< index of the next place
  StreamTime time_;
  std::optional<double> last_s_;
  std::uint64_t row_ = 0;  ///< of the next time
};

}  // namespace

RecordingSurvey survey_recording(const std::filesystem::path& path) { return Survey(path).run(); }

}  // namespace palpate
