#include "io/recording_survey.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "model/angle_unit.hpp"
#include "model/elements_that.hpp"
#include "model/stream_time.hpp"
#include "palpate/contact.hpp"
#include "palpate/touch_detector.hpp"

namespace palpate {

namespace {

constexpr std::uint32_t sign = 0x80000000;

// Numbers that the rows held at a time have at most, unless one row has more: 4 MiB.
constexpr std::uint64_t block = 1 << 19;

class Survey {
 public:
  explicit Survey(const std::filesystem::path& path) : file_(path) {}

  RecordingSurvey run() {
    result_.head = file_.head();
    if (head_.pressure_unit == "kPa") {
      result_.threshold = ContactClassifier{}.threshold;
    }
    result_.pressure.elements.resize(e_);
    take_places(0, head_.elements_mm);
    Recording rows;
    // A row has e pressures, the places of e elements where they change, a pose, two times and a
    // count of lost frames.
    const std::uint64_t at_once = std::max<std::uint64_t>(1, block / (3 * e_ + 6));
    for (std::uint64_t first = 0; first < file_.head().rows; first += at_once) {
      file_.read(first, std::min(at_once, file_.head().rows - first), rows);
      take_places(first, rows.elements_mm);
      for (std::size_t i = 0; i < rows.size(); ++i) {
        take_row(first + i, rows, i);
      }
    }
    result_.spacing = spacing_of(places_mm_);
    if (result_.spacing) {
      for (std::size_t& element : result_.spacing->closest) {
        element = placed_[element];
      }
    }
    std::ranges::sort(touches_);
    const auto repeated = std::unique(touches_.begin(), touches_.end());
    result_.repeated = static_cast<std::uint64_t>(touches_.end() - repeated);
    return std::move(result_);
  }

 private:
  void take_row(std::uint64_t row, const Recording& rows, std::size_t i) {
    const bool felt = take_pressures(row, std::span(rows.pressure).subspan(i * e_, e_));
    const Pose& pose = rows.T_robot_sensor[i];
    take_pose(pose);
    if (felt && head_.rows != "frames") {
      std::string touch(reinterpret_cast<const char*>(&rows.pressure[i * e_]), e_ * sizeof(double));
      touch.append(reinterpret_cast<const char*>(&pose), sizeof pose);
      touches_.push_back(std::hash<std::string>()(touch));
    }
    if (!rows.time_s.empty()) {
      take_time(row, rows.time_s[i]);
    }
    if (!rows.lost_before.empty()) {
      result_.lost = result_.lost.value_or(0);
      count_lost(*result_.lost, rows.lost_before[i]);
    }
  }

  bool is_alive(std::uint64_t row, std::size_t element) const {
    const std::vector<std::uint8_t>& valid = head_.valid;
    return valid.empty() || valid[(valid.size() > e_ ? row * e_ : 0) + element] != 0;
  }

  /// Returns whether the row is in contact.
  bool take_pressures(std::uint64_t row, std::span<const double> readings) {
    std::optional<double> strongest;  // pressure above the baseline
    std::size_t strongest_element = 0;
    for (std::size_t element = 0; element < e_; ++element) {
      if (!is_alive(row, element)) {
        continue;
      }
      const std::vector<double>& baseline = head_.baseline;
      const double pressure = readings[element] - (baseline.empty() ? 0.0 : baseline[element]);
      take_reading(element, readings[element], pressure);
      if (!std::isnan(readings[element]) && (!strongest || pressure > *strongest)) {
        strongest = pressure;
        strongest_element = element;
      }
    }
    if (!strongest || (result_.threshold && !(*strongest > *result_.threshold))) {
      return false;
    }
    ++result_.pressure.in_contact;
    ++result_.pressure.elements[strongest_element].strongest;
    return true;
  }

  void take_reading(std::size_t of_element, double reading, double pressure) {
    PressureSurvey& all = result_.pressure;
    ElementSurvey& element = all.elements[of_element];
    ++element.alive;
    if (std::isnan(reading)) {
      ++all.unknown;
      return;
    }
    ++element.known;
    element.contacts += result_.threshold && pressure > *result_.threshold ? 1 : 0;
    all.readings.add(reading);
    include(all.range, reading);
  }

  void take_pose(const Pose& T_robot_sensor) {
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

  /// Takes the places of the elements from this row on.
  void take_places(std::uint64_t row, std::span<const glm::dvec2> places_mm) {
    for (std::size_t k = 0; k < places_mm.size(); ++k) {
      const glm::dvec2& place_mm = places_mm[k];
      if (!is_alive(row + k / e_, k % e_)) {
        continue;
      }
      if (!result_.array) {
        result_.array = {{place_mm.x, place_mm.x}, {place_mm.y, place_mm.y}};
      }
      result_.array->x_mm.include(place_mm.x);
      result_.array->y_mm.include(place_mm.y);
      if (row + k / e_ == 0) {
        places_mm_.push_back(place_mm);
        placed_.push_back(k);
      }
    }
  }

  void take_time(std::uint64_t row, double time_s) {
    const double before_s = last_s_.value_or(time_s);
    if (time_s < before_s && result_.times_back++ == 0) {
      result_.first_back = row;
    }
    result_.long_steps += time_s - before_s > TouchDetectorOptions{}.largest_gap_s ? 1 : 0;
    result_.elapsed_s = time_.advance(time_s);
    last_s_ = time_s;
  }

  RecordingFile file_;
  const Recording& head_ = file_.head().recording;
  std::size_t e_ = file_.head().elements;
  RecordingSurvey result_;
  std::vector<std::size_t> touches_;   ///< hashes of the touches in contact
  std::vector<glm::dvec2> places_mm_;  ///< of the living elements in the first row
  std::vector<std::size_t> placed_;    ///< their indices in the array
  StreamTime time_;
  std::optional<double> last_s_;
};

// With fewer rows, an element that is in contact in all of them says nothing.
constexpr std::uint64_t least_rows = 20;

class RecordingFindings {
 public:
  explicit RecordingFindings(const RecordingSurvey& survey) : s_(survey), p_(survey.pressure) {}

  std::vector<std::string> all() {
    look_at_array();
    look_at_poses();
    if (s_.repeated > 0) {
      say("{} of {} touches equal an earlier one to the digit, and count as one with it.",
          s_.repeated, s_.head.rows);
    }
    look_at_times();
    look_at_pressures();
    look_at_elements();
    return std::move(found_);
  }

 private:
  template <typename... Parts>
  void say(fmt::format_string<const Parts&...> sentence, const Parts&... parts) {
    std::string text = fmt::format(sentence, parts...);
    if (text.starts_with("element")) {
      text.front() = 'E';
    }
    found_.push_back(std::move(text));
  }

  std::vector<std::size_t> elements_where(
      const std::function<bool(const ElementSurvey&)>& holds) const {
    std::vector<std::size_t> elements;
    for (std::size_t i = 0; i < p_.elements.size(); ++i) {
      if (holds(p_.elements[i])) {
        elements.push_back(i);
      }
    }
    return elements;
  }

  void look_at_array() {
    if (!s_.array) {
      say("All elements are marked dead in 'valid'.");
      return;
    }
    const RecordingSurvey::Array& array = *s_.array;
    // No array is made so small.
    constexpr double least_pitch_mm = 0.01;
    constexpr double least_array_mm = 0.5;
    if (s_.spacing) {
      const ElementSpacing& spacing = *s_.spacing;
      const double array_mm = std::hypot(array.x_mm.span(), array.y_mm.span());
      if (array_mm < least_array_mm) {
        say("The array is {:.3g} mm long; 'elements' holds mm: are these metres?", array_mm);
      } else if (spacing.nearest_mm.least < least_pitch_mm) {
        say("Elements {} and {} lie {:.3g} mm apart, at the same place.", spacing.closest[0],
            spacing.closest[1], spacing.nearest_mm.least);
      }
    }
    constexpr double farthest_mm = 1000.0;
    const double reach_mm =
        std::max(array.x_mm.largest_magnitude(), array.y_mm.largest_magnitude());
    if (reach_mm > farthest_mm) {
      say("Elements lie up to {:.4g} mm from the origin of the sensor frame; 'elements' holds mm: "
          "are these micrometres, or places in the robot frame?",
          reach_mm);
    }
  }

  void look_at_poses() {
    const bool frames = s_.head.recording.rows == "frames";
    if (frames && s_.with_pose == 0) {
      say("No frame has a pose, which touches need for a map or for recognition.");
    } else if (frames && 2 * s_.with_pose < s_.head.rows) {
      say("{} of {} frames have no pose.", s_.head.rows - s_.with_pose, s_.head.rows);
    }
    if (!s_.poses) {
      return;
    }
    if (seem_metres(*s_.poses)) {
      say("All poses lie within {:.3g} x {:.3g} mm although the array is touched at many places; "
          "'sensor_pose' holds mm: are these metres?",
          s_.poses->x_mm.span(), s_.poses->y_mm.span());
    }
    const Extremes& theta_rad = s_.poses->theta_rad;
    if (seem_degrees(theta_rad.least, theta_rad.most)) {
      say("The angle of a pose is {:.4g}; 'sensor_pose' holds radians: are these degrees?",
          theta_rad.largest_magnitude());
    }
  }

  /// Whether poses in mm would leave the sensor where it is, and poses in metres would not.
  bool seem_metres(const RecordingSurvey::Poses& poses) const {
    constexpr double still_mm = 1.0;
    constexpr double jitter_mm = 0.002;  // a robot that stands still
    constexpr double reach_m = 3.0;      // of a robot
    const double moved = std::max(poses.x_mm.span(), poses.y_mm.span());
    const double reach = std::max(poses.x_mm.largest_magnitude(), poses.y_mm.largest_magnitude());
    if (moved >= still_mm || moved < jitter_mm || reach > reach_m) {
      return false;
    }
    // A sensor that presses the same place again and again mostly feels it with one element.
    constexpr std::uint64_t least_touches = 5;
    std::uint64_t strongest_count = 0;
    for (const ElementSurvey& element : p_.elements) {
      strongest_count = std::max(strongest_count, element.strongest);
    }
    return p_.in_contact >= least_touches && 2 * strongest_count < p_.in_contact;
  }

  void look_at_times() {
    if (s_.times_back > 0) {
      say("Time runs backwards at {} row{}, first at row {}.", s_.times_back,
          s_.times_back == 1 ? "" : "s", s_.first_back);
    }
    if (s_.head.recording.rows == "frames" && 2 * s_.long_steps > s_.head.rows) {
      say("Most frames come more than 0.5 s apart, too late to find a touch; 'time' holds seconds: "
          "are these milliseconds?");
    }
  }

  void look_at_pressures() {
    if (!p_.range) {
      return;
    }
    const std::string& unit = s_.head.recording.pressure_unit;
    if (s_.threshold && p_.in_contact == 0) {
      say("No element is ever in contact: no reading is more than {} {} above {}; is "
          "'pressure_unit' right?",
          *s_.threshold, unit, s_.head.recording.baseline.empty() ? "0" : "the baseline");
    }
    // 10 MPa. Contacts seldom give fewer than 1 % of the readings, glitches hardly ever as many.
    constexpr double most_kpa = 1e4;
    if (unit == "kPa" && p_.readings.quantile(0.99) > most_kpa) {
      say("One in a hundred readings is above {} kPa; are these pascals or raw readings?",
          most_kpa);
    }
  }

  void look_at_elements() {
    const auto unknown =
        elements_where([](const ElementSurvey& e) { return e.alive > 0 && e.known == 0; });
    if (!unknown.empty()) {
      say("{} no known reading in any row.", elements_that(unknown, "has", "have"));
    }
    const std::vector<std::size_t> held = elements_where(
        [](const ElementSurvey& e) { return e.known >= least_rows && e.contacts == e.known; });
    // Without a baseline, the readings of an untouched array may be of any size.
    if (s_.head.recording.rows == "frames" && !s_.head.recording.baseline.empty() &&
        !held.empty()) {
      say("{} more than {} {} above the baseline in every frame.",
          elements_that(held, "reads", "read"), s_.threshold.value_or(0.0),
          s_.head.recording.pressure_unit);
    }
  }

  const RecordingSurvey& s_;
  const PressureSurvey& p_;
  std::vector<std::string> found_;
};

}  // namespace

ReadingHistogram::ReadingHistogram() : counts_(1 << 16, 0) {}

// The bits of floats, read as whole numbers, have the floats' order where the sign bit is flipped
// and the other bits of negative numbers are flipped too.
std::size_t ReadingHistogram::bin_of(double reading) {
  constexpr double largest = std::numeric_limits<float>::max();
  const auto number = static_cast<float>(std::clamp(reading, -largest, largest));
  const auto bits = std::bit_cast<std::uint32_t>(number + 0.0F);  // 0 for -0
  return ((bits & sign) != 0 ? ~bits : bits | sign) >> 16;
}

double ReadingHistogram::edge_of(std::size_t bin) {
  const auto key = static_cast<std::uint32_t>(bin) << 16;
  return std::bit_cast<float>((key & sign) != 0 ? key ^ sign : ~key & 0xFFFF0000);
}

double ReadingHistogram::quantile(double part) const {
  const std::uint64_t all = std::accumulate(counts_.begin(), counts_.end(), std::uint64_t{0});
  const double below = std::max(1.0, std::ceil(part * static_cast<double>(all)));
  std::uint64_t passed = 0;
  for (std::size_t bin = 0; bin < counts_.size(); ++bin) {
    passed += counts_[bin];
    if (static_cast<double>(passed) >= below) {
      return edge_of(bin);
    }
  }
  return edge_of(counts_.size() - 1);
}

RecordingSurvey survey_recording(const std::filesystem::path& path) { return Survey(path).run(); }

std::vector<std::string> findings_of(const RecordingSurvey& survey) {
  return RecordingFindings(survey).all();
}

}  // namespace palpate
