#include "estimation/bounded/known_elements.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "model/contact_readings.hpp"

namespace palpate {

namespace {

struct KnownElement {
  Reading reading;
  glm::dvec2 from_pivot_mm;
};

bool before(const KnownElement& a, const KnownElement& b) {
  return std::tie(a.reading, a.from_pivot_mm.x, a.from_pivot_mm.y) <
         std::tie(b.reading, b.from_pivot_mm.x, b.from_pivot_mm.y);
}

/// @param elements in order
KnownElements in_runs(std::span<const KnownElement> elements) {
  KnownElements known;
  known.from_pivot_mm.reserve(elements.size());
  for (const KnownElement& element : elements) {
    if (known.runs.empty() || known.runs.back().reading != element.reading) {
      known.runs.push_back(
          {element.reading, known.from_pivot_mm.size(), known.from_pivot_mm.size()});
    }
    known.from_pivot_mm.push_back(element.from_pivot_mm);
    ++known.runs.back().end;
  }
  return known;
}

void append(const KnownElements& known, std::vector<KnownElement>& elements) {
  for (const ReadingRun& run : known.runs) {
    for (std::size_t i = run.begin; i < run.end; ++i) {
      elements.push_back({run.reading, known.from_pivot_mm[i]});
    }
  }
}

/// The elements that have any reading but this one.
KnownElements all_but(Reading reading, const ArrayReadings& array) {
  std::vector<KnownElement> elements;
  for (std::size_t i = 0; i < array.readings.size(); ++i) {
    if (array.readings[i] != reading) {
      elements.push_back({array.readings[i], array.from_pivot_mm[i]});
    }
  }
  std::sort(elements.begin(), elements.end(), before);
  return in_runs(elements);
}

}  // namespace

KnownElements known_elements(const ArrayReadings& array) {
  return all_but(Reading::unknown, array);
}

KnownElements changed_elements(const ArrayReadings& array) {
  return all_but(Reading::no_contact, array);
}

KnownElements merged(std::span<const KnownElements> lists) {
  std::vector<KnownElement> elements;
  for (const KnownElements& list : lists) {
    const auto merged = static_cast<std::ptrdiff_t>(elements.size());
    append(list, elements);
    std::inplace_merge(elements.begin(), elements.begin() + merged, elements.end(), before);
  }
  return in_runs(elements);
}

void KeptTouches::add(std::span<const Touch> touches, const ContactModel& model,
                      const glm::dvec2& pivot_mm) {
  const std::size_t before = ends_.size();
  try {
    for (const Touch& touch : touches) {
      add(touch, model, pivot_mm);
    }
  } catch (...) {
    shrink(before);
    throw;
  }
}

void KeptTouches::add(const Touch& touch, const ContactModel& model, const glm::dvec2& pivot_mm) {
  of_touch_ = classify(touch, model, std::move(of_touch_));
  const std::size_t n = of_touch_.size();
  if (ends_.capacity() == 0) {
    constexpr std::size_t of_element = sizeof(glm::dvec2) + sizeof(Reading);
    const std::size_t touches = std::clamp<std::size_t>(
        most_bytes / (of_element * std::max<std::size_t>(n, 1)), 1, room_for);
    from_pivot_mm_.reserve(touches * n);
    readings_.reserve(touches * n);
    ends_.reserve(room_for);
    rectangles_.reserve(room_for);
  }
  for (const glm::dvec2& element_mm : touch.elements_mm) {
    from_pivot_mm_.push_back(touch.T_robot_sensor * element_mm - pivot_mm);
  }
  readings_.insert(readings_.end(), of_touch_.begin(), of_touch_.end());
  rectangles_.push_back(array_rectangle(touch, pivot_mm));
  ends_.push_back(readings_.size());
}

std::vector<ArrayReadings> KeptTouches::all() const {
  std::vector<ArrayReadings> touches;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < ends_.size(); ++i) {
    const auto from = static_cast<std::ptrdiff_t>(begin);
    const auto to = static_cast<std::ptrdiff_t>(ends_[i]);
    touches.push_back(
        {.from_pivot_mm = {from_pivot_mm_.begin() + from, from_pivot_mm_.begin() + to},
         .readings = {readings_.begin() + from, readings_.begin() + to},
         .rectangle = rectangles_[i]});
    begin = ends_[i];
  }
  return touches;
}

void KeptTouches::clear() { shrink(0); }

void KeptTouches::shrink(std::size_t touches) {
  const std::size_t elements = touches == 0 ? 0 : ends_[touches - 1];
  from_pivot_mm_.resize(elements);
  readings_.resize(elements);
  rectangles_.resize(touches);
  ends_.resize(touches);
}

}  // namespace palpate
