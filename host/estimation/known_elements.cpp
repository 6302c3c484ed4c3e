#include "estimation/known_elements.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "estimation/log_sum.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

static_assert(shaders::NO_CONTACT == static_cast<shaders::uint>(Reading::no_contact) &&
              shaders::IN_CONTACT == static_cast<shaders::uint>(Reading::in_contact) &&
              shaders::UNKNOWN == static_cast<shaders::uint>(Reading::unknown));

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

/// An order of touches that does not depend on when they came.
bool touched_before(const KnownElements& a, const KnownElements& b) {
  const auto place = [](const glm::dvec2& mm) { return std::pair(mm.x, mm.y); };
  const auto key = [](const ReadingRun& run) { return std::tuple(run.reading, run.end); };
  if (a.sensor_from_pivot_mm != b.sensor_from_pivot_mm) {
    return place(a.sensor_from_pivot_mm) < place(b.sensor_from_pivot_mm);
  }
  if (!std::ranges::equal(a.runs, b.runs, {}, key, key)) {
    return std::ranges::lexicographical_compare(a.runs, b.runs, {}, key, key);
  }
  return std::ranges::lexicographical_compare(a.from_pivot_mm, b.from_pivot_mm, {}, place, place);
}

/// Of one reading.
double prior_log_likelihood(Reading reading, const ContactModel& contact) {
  const MapSample prior{.log_odds = log_odds_from_probability(contact.prior.value())};
  const std::size_t sets = contact.table ? contact.table->sets() : 1;
  LogSum sum;
  for (std::size_t set = 0; set < sets; ++set) {
    sum.add(contact.log_likelihood(reading, prior, set));
  }
  return sum.log() - std::log(static_cast<double>(sets));
}

}  // namespace

std::vector<std::size_t> sorted_touches(std::span<const KnownElements> touches) {
  std::vector<std::size_t> order(touches.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(
      order, [&](std::size_t i, std::size_t j) { return touched_before(touches[i], touches[j]); });
  return order;
}

KnownElements known_elements(const TouchEvidence& touch, const BoundedOptions& options) {
  const Pose& T_robot_sensor = touch.T_robot_sensor;
  const glm::dvec2& pivot_mm = options.lattice.pivot_mm;
  std::vector<KnownElement> elements;
  for (std::size_t i = 0; i < touch.readings.size(); ++i) {
    if (touch.readings[i] != Reading::unknown) {
      elements.push_back({touch.readings[i], T_robot_sensor * touch.elements_mm[i] - pivot_mm});
    }
  }
  std::sort(elements.begin(), elements.end(), before);
  KnownElements known = in_runs(elements);
  if (!options.touch_sd.none() && !known.runs.empty()) {
    KnownElements displaced = known;
    displaced.sensor_from_pivot_mm = T_robot_sensor.translation_mm - pivot_mm;
    known.touches.push_back(std::move(displaced));
  }
  return known;
}

KnownElements merged(std::span<const KnownElements> lists) {
  std::vector<KnownElement> elements;
  for (const KnownElements& list : lists) {
    const auto merged = static_cast<std::ptrdiff_t>(elements.size());
    append(list, elements);
    std::inplace_merge(elements.begin(), elements.begin() + merged, elements.end(), before);
  }
  KnownElements all = in_runs(elements);
  for (const KnownElements& list : lists) {
    all.touches.insert(all.touches.end(), list.touches.begin(), list.touches.end());
  }
  return all;
}

KnownElements gathered(std::span<const TouchEvidence> touches, const glm::dvec2& pivot_mm,
                       std::size_t longest_run, KnownElements reuse) {
  std::size_t elements = 0;
  for (const TouchEvidence& touch : touches) {
    elements += touch.readings.size();
  }
  KnownElements known = std::move(reuse);
  known.from_pivot_mm.clear();
  known.from_pivot_mm.reserve(elements);
  known.runs.clear();
  // A run for every reading of a touch, and for every part of one that is too long.
  known.runs.reserve(touches.size() * most_reading_levels + elements / longest_run);
  for (const TouchEvidence& touch : touches) {
    for (std::size_t level = 0; level < most_reading_levels; ++level) {
      const auto reading = static_cast<Reading>(level);
      const std::size_t first = known.from_pivot_mm.size();
      for (std::size_t e = 0; e < touch.readings.size(); ++e) {
        if (touch.readings[e] == reading) {
          known.from_pivot_mm.push_back(touch.T_robot_sensor * touch.elements_mm[e] - pivot_mm);
        }
      }
      const std::size_t end = known.from_pivot_mm.size();
      for (std::size_t begin = first; begin < end; begin += longest_run) {
        known.runs.push_back({reading, begin, std::min(begin + longest_run, end)});
      }
    }
  }
  return known;
}

double prior_log_likelihood(const KnownElements& elements, const ContactModel& contact) {
  std::array<std::size_t, most_reading_levels> counts{};
  for (const ReadingRun& run : elements.runs) {
    counts[static_cast<std::size_t>(run.reading)] += run.end - run.begin;
  }
  double sum = 0.0;
  for (std::size_t level = 0; level < counts.size(); ++level) {
    if (counts[level] > 0) {
      sum += static_cast<double>(counts[level]) *
             prior_log_likelihood(static_cast<Reading>(level), contact);
    }
  }
  return sum;
}

std::vector<double> prior_log_likelihoods(const KnownElements& elements,
                                          const ContactModel& contact, std::size_t objects) {
  const MapSample prior{log_odds_from_probability(*contact.prior)};
  std::vector<double> sums(objects);
  for (std::size_t i = 0; i < objects; ++i) {
    for (const ReadingRun& run : elements.runs) {
      sums[i] +=
          static_cast<double>(run.end - run.begin) * contact.log_likelihood(run.reading, prior, i);
    }
  }
  return sums;
}

void KeptTouches::add(std::span<const TouchEvidence> touches) {
  make_room(touches.empty() ? 0 : touches.front().elements_mm.size());
  touches_.resize(std::max(touches_.size(), count_ + touches.size()));
  std::ranges::copy(touches, touches_.begin() + static_cast<std::ptrdiff_t>(count_));
  count_ += touches.size();
}

void KeptTouches::add(std::span<const Touch> touches, const ContactModel& contact) {
  make_room(touches.empty() ? 0 : touches.front().elements_mm.size());
  count_ += evidence_of(touches, contact, touches_, count_).size();
}

void KeptTouches::make_room(std::size_t elements) {
  if (!touches_.empty() || elements == 0) {
    return;
  }
  const std::size_t bytes = (sizeof(glm::dvec2) + sizeof(Reading) + 1) * elements;
  touches_.resize(std::clamp<std::size_t>(most_bytes / bytes, 1, room_for));
  for (TouchEvidence& touch : touches_) {
    touch.elements_mm.reserve(elements);
    touch.readings.reserve(elements);
    touch.lives.reserve(elements);
  }
}

}  // namespace palpate
