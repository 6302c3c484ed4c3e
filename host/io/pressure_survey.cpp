#include "io/pressure_survey.hpp"

#include <cmath>

namespace palpate {

void PressureSurvey::begin(std::size_t elements, std::optional<double> threshold) {
  threshold_ = threshold;
  elements_.resize(elements);
}

void PressureSurvey::add(const Recording& head, std::span<const double> pressures) {
  const std::vector<std::uint8_t>& valid = head.valid;
  const std::size_t e = elements_.size();
  const bool valid_by_row = valid.size() > e;
  for (const double pressure : pressures) {
    if (valid.empty() || valid[(valid_by_row ? row_ * e : 0) + element_] != 0) {
      take(head, pressure);
    }
    if (++element_ == e) {
      end_row();
    }
  }
}

void PressureSurvey::take(const Recording& head, double reading) {
  ElementSurvey& element = elements_[element_];
  ++element.alive;
  if (std::isnan(reading)) {
    ++unknown_;
    return;
  }
  element.changes += element.known > 0 && reading != element.last ? 1 : 0;
  ++element.known;
  element.zeros += reading == 0.0 ? 1 : 0;
  element.last = reading;
  readings_.add(reading);
  if (!range_ || reading > range_->most) {
    at_most_ = 0;
    times_at_most_ = 0;
  }
  widen(range_, reading);
  if (reading == range_->most) {
    const std::uint64_t apart = head.rows == "frames" ? 2 : 1;
    if (at_most_ == 0 || row_ >= last_at_most_ + apart) {
      ++times_at_most_;
    }
    ++at_most_;
    last_at_most_ = row_;
  }
  const std::vector<double>& baseline = head.baseline;
  const double pressure = baseline.empty() ? reading : reading - baseline[element_];
  element.contacts += threshold_ && pressure > *threshold_ ? 1 : 0;
  if (!strongest_ || pressure > *strongest_) {
    strongest_ = pressure;
    strongest_element_ = element_;
  }
}

void PressureSurvey::end_row() {
  if (strongest_ && (!threshold_ || *strongest_ > *threshold_)) {
    ++in_contact_;
    ++elements_[strongest_element_].strongest;
  }
  strongest_.reset();
  element_ = 0;
  ++row_;
}

}  // namespace palpate
