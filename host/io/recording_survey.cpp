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
      take_reading(row, element, readings[element], pressure);
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

  void take_reading(std::uint64_t row, std::size_t of_element, double reading, double pressure) {
    PressureSurvey& all = result_.pressure;
    ElementSurvey& element = all.elements[of_element];
    ++element.alive;
    if (std::isnan(reading)) {
      ++all.unknown;
      return;
    }
    element.changes += element.known > 0 && reading != element.last ? 1 : 0;
    ++element.known;
    element.zeros += reading == 0.0 ? 1 : 0;
    element.last = reading;
    element.contacts += result_.threshold && pressure > *result_.threshold ? 1 : 0;
    all.readings.add(reading);
    if (!all.range || reading > all.range->most) {
      all.at_most = 0;
      all.times_at_most = 0;
    }
    include(all.range, reading);
    if (reading == all.range->most) {
      const std::uint64_t apart = head_.rows == "frames" ? 2 : 1;
      if (all.at_most == 0 || row >= last_at_most_ + apart) {
        ++all.times_at_most;
      }
      ++all.at_most;
      last_at_most_ = row;
    }
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
  std::uint64_t last_at_most_ = 0;     ///< last row with the largest reading
  std::vector<std::size_t> touches_;   ///< hashes of the touches in contact
  std::vector<glm::dvec2> places_mm_;  ///< of the living elements in the first row
  std::vector<std::size_t> placed_;    ///< their indices in the array
  StreamTime time_;
  std::optional<double> last_s_;
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

std::uint64_t ReadingHistogram::count(double low, double high) const {
  std::uint64_t sum = 0;
  for (std::size_t bin = bin_of(low); bin <= bin_of(high); ++bin) {
    sum += counts_[bin];
  }
  return sum;
}

std::uint64_t ReadingHistogram::occupied(double low, double high) const {
  std::uint64_t bins = 0;
  for (std::size_t bin = bin_of(low); bin <= bin_of(high); ++bin) {
    bins += counts_[bin] > 0 ? 1 : 0;
  }
  return bins;
}

RecordingSurvey survey_recording(const std::filesystem::path& path) { return Survey(path).run(); }

}  // namespace palpate
