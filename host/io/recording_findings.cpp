#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "io/recording_survey.hpp"
#include "model/angle_unit.hpp"

namespace palpate {

namespace {

/// Names elements by index, such as "element 3 reads", "elements 3, 5 and 7 more read"; at most 8
/// of them.
/// @param one, more the verb for one element and for more elements
std::string elements_that(std::span<const std::size_t> indices, std::string_view one,
                          std::string_view more) {
  constexpr std::size_t most_named = 8;
  const std::size_t named = std::min(indices.size(), most_named);
  std::string text = fmt::format("{} {}", indices.size() == 1 ? "element" : "elements",
                                 fmt::join(indices.first(named), ", "));
  if (named < indices.size()) {
    text += fmt::format(" and {} more", indices.size() - named);
  }
  return fmt::format("{} {}", text, indices.size() == 1 ? one : more);
}

// With fewer rows, an element that reads the same in all of them says nothing.
constexpr std::uint64_t least_rows = 20;

// A sound element is suspected with a chance of one in a million, in nats.
constexpr double sure_nats = 14.0;

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
    look_for_saturation(unit);
  }

  /// A sensor that saturates reads its largest value again and again, and more often than any of
  /// the values just below it.
  void look_for_saturation(const std::string& unit) {
    constexpr std::uint64_t least_times = 5;
    constexpr std::uint64_t least_bins = 8;  // fewer: a switch, or noise of a few steps
    constexpr double much = 4.0;
    const double highest = p_.range->most;
    const double near = highest - 0.25 * (highest - p_.readings.quantile(0.5));
    const std::uint64_t bins = p_.readings.occupied(near, highest);
    const auto others = static_cast<double>(p_.readings.count(near, highest) - p_.at_most);
    if (p_.times_at_most >= least_times && bins >= least_bins &&
        static_cast<double>(p_.at_most) > much * others / static_cast<double>(bins)) {
      say("{} readings are exactly the largest, {:.4g} {}: the sensor saturates there.", p_.at_most,
          highest, unit);
    }
  }

  void look_at_elements() {
    const auto unknown =
        elements_where([](const ElementSurvey& e) { return e.alive > 0 && e.known == 0; });
    if (!unknown.empty()) {
      say("{} no known reading in any row.", elements_that(unknown, "has", "have"));
    }
    look_for_constant_elements();
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

  void look_for_constant_elements() {
    std::vector<double> changes;  // of the other elements: part of their readings
    double zeros = 0.5;           // largest part of another element's readings that are 0
    for (const ElementSurvey& e : p_.elements) {
      if (e.changes > 0) {
        changes.push_back(static_cast<double>(e.changes) / static_cast<double>(e.known));
        zeros = std::max(zeros, static_cast<double>(e.zeros) / static_cast<double>(e.known));
      }
    }
    if (changes.empty()) {
      if (s_.head.rows >= least_rows && p_.range) {
        say("No element's reading ever changes.");
      }
      return;
    }
    const auto middle = changes.begin() + static_cast<std::ptrdiff_t>(changes.size() / 2);
    std::nth_element(changes.begin(), middle, changes.end());
    // Where readings seldom change, as in a stream without noise, an untouched element may not
    // change at all.
    if (*middle <= 0.5) {
      return;
    }
    // An untouched element may read 0 in a row as often as the other elements do.
    const std::vector<std::size_t> constant = elements_where([&](const ElementSurvey& e) {
      return e.constant() &&
             static_cast<double>(e.known) * -std::log(e.last == 0.0 ? zeros : 0.5) > sure_nats;
    });
    if (!constant.empty()) {
      const double first = p_.elements[constant.front()].last;
      const bool same = std::all_of(constant.begin(), constant.end(),
                                    [&](std::size_t i) { return p_.elements[i].last == first; });
      say("{} {} in every row while the others change; mark broken elements dead in 'valid'.",
          elements_that(constant, "reads", "read"),
          same ? fmt::format("{:.4g} {}", first, s_.head.recording.pressure_unit)
               : "a constant value each");
    }
  }

  const RecordingSurvey& s_;
  const PressureSurvey& p_;
  std::vector<std::string> found_;
};

}  // namespace

std::vector<std::string> findings_of(const RecordingSurvey& survey) {
  return RecordingFindings(survey).all();
}

}  // namespace palpate
