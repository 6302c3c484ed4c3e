#include "io/recording_survey.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "model/stream_time.hpp"
#include "palpate/contact.hpp"
#include "palpate/touch_detector.hpp"

namespace palpate {

namespace {

constexpr std::uint32_t sign = 0x80000000;

/// A digest of numbers in order, by one more number (the finaliser of SplitMix64).
std::uint64_t digest_with(std::uint64_t digest, double number) {
  digest = (digest ^ std::bit_cast<std::uint64_t>(number)) + 0x9E3779B97F4A7C15;
  digest = (digest ^ (digest >> 30)) * 0xBF58476D1CE4E5B9;
  digest = (digest ^ (digest >> 27)) * 0x94D049BB133111EB;
  return digest ^ (digest >> 31);
}

class Survey {
 public:
  explicit Survey(const std::filesystem::path& path) : path_(path) {}

  RecordingSurvey run() {
    const auto each = [this](const auto& values) {
      for (const auto& value : values) {
        take(value);
      }
    };
    scan_recording(path_, {.head = [&](const RecordingHead& head) { begin(head); },
                           .pressure = [&](auto values) { take_pressures(values); },
                           .T_robot_sensor = each,
                           .elements_mm = each,
                           .time_s = each,
                           .device_time_s = [](std::span<const double>) {},
                           .lost_before =
                               [&](auto counts) {
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
    result_.repeated = repeated_touches();
    return std::move(result_);
  }

 private:
  /// RecordingSurvey::repeated
  std::uint64_t repeated_touches() const {
    std::vector<std::uint64_t> digests;
    for (std::size_t i = 0; i < std::min(pressed_.size(), posed_.size()); ++i) {
      if (pressed_[i] != 0) {
        digests.push_back(pressed_[i] ^ posed_[i]);
      }
    }
    std::ranges::sort(digests);
    return digests.size() -
           static_cast<std::size_t>(std::unique(digests.begin(), digests.end()) - digests.begin());
  }

  bool of_touches() const { return result_.head.recording.rows != "frames"; }

  void begin(const RecordingHead& head) {
    result_.head = head;
    if (head.recording.pressure_unit == "kPa") {
      result_.threshold = ContactClassifier{}.threshold;
    }
    result_.pressure.elements.resize(head.elements);
  }

  void take_pressures(std::span<const double> pressures) {
    const std::vector<std::uint8_t>& valid = result_.head.recording.valid;
    const std::size_t e = result_.head.elements;
    const bool valid_by_row = valid.size() > e;
    for (const double pressure : pressures) {
      if (valid.empty() || valid[(valid_by_row ? pressure_row_ * e : 0) + element_] != 0) {
        take_reading(pressure);
      }
      pressures_ = digest_with(pressures_, pressure);
      if (++element_ == e) {
        end_row();
      }
    }
  }

  void take_reading(double reading) {
    PressureSurvey& all = result_.pressure;
    ElementSurvey& element = all.elements[element_];
    ++element.alive;
    if (std::isnan(reading)) {
      ++all.unknown;
      return;
    }
    element.changes += element.known > 0 && reading != element.last ? 1 : 0;
    ++element.known;
    element.zeros += reading == 0.0 ? 1 : 0;
    element.last = reading;
    all.readings.add(reading);
    if (!all.range || reading > all.range->most) {
      all.at_most = 0;
      all.times_at_most = 0;
    }
    widen(all.range, reading);
    if (reading == all.range->most) {
      const std::uint64_t apart = result_.head.recording.rows == "frames" ? 2 : 1;
      if (all.at_most == 0 || pressure_row_ >= last_at_most_ + apart) {
        ++all.times_at_most;
      }
      ++all.at_most;
      last_at_most_ = pressure_row_;
    }
    const std::vector<double>& baseline = result_.head.recording.baseline;
    const double pressure = baseline.empty() ? reading : reading - baseline[element_];
    element.contacts += in_contact(pressure) && result_.threshold ? 1 : 0;
    if (!strongest_ || pressure > *strongest_) {
      strongest_ = pressure;
      strongest_element_ = element_;
    }
  }

  bool in_contact(double pressure) const {
    return !result_.threshold || pressure > *result_.threshold;
  }

  void end_row() {
    const bool felt = strongest_ && in_contact(*strongest_);
    if (of_touches()) {
      pressed_.push_back(felt ? pressures_ : 0);
    }
    pressures_ = 1;
    if (felt) {
      ++result_.pressure.in_contact;
      ++result_.pressure.elements[strongest_element_].strongest;
    }
    strongest_.reset();
    element_ = 0;
    ++pressure_row_;
  }

  void take(const Pose& T_robot_sensor) {
    const auto& [t, theta_rad] = T_robot_sensor;
    if (of_touches()) {
      posed_.push_back(digest_with(digest_with(digest_with(0, t.x), t.y), theta_rad));
    }
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

  void take(double time_s) {
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
  std::uint64_t pressure_row_ = 0;      ///< row of the next pressure
  std::size_t element_ = 0;             ///< its element
  std::optional<double> strongest_;     ///< largest pressure above the baseline in this row
  std::size_t strongest_element_ = 0;   ///< the element that reads it
  std::uint64_t last_at_most_ = 0;      ///< last row with the largest reading
  std::uint64_t pressures_ = 1;         ///< digest of this row's pressures so far
  std::vector<std::uint64_t> pressed_;  ///< [touch] digest of the pressures; 0 without contact
  std::vector<std::uint64_t> posed_;    ///< [touch] digest of the pose
  std::vector<glm::dvec2> places_mm_;   ///< of the living elements in the first row
  std::vector<std::size_t> placed_;     ///< their indices in the array
  std::uint64_t place_ = 0;             ///< index of the next place
  StreamTime time_;
  std::optional<double> last_s_;
  std::uint64_t row_ = 0;  ///< row of the next time
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
