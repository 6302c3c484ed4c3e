#include "estimation/contact_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "palpate/occupancy_grid.hpp"

namespace palpate {

static_assert(shaders::NO_CONTACT == static_cast<shaders::uint>(Reading::no_contact) &&
              shaders::IN_CONTACT == static_cast<shaders::uint>(Reading::in_contact) &&
              shaders::UNKNOWN == static_cast<shaders::uint>(Reading::unknown));

namespace {

// Cells that are told apart, and what stands for those beyond. Clamped to the same bound, an
// element and a bin that are both beyond would meet on the map. So they never do: these differ from
// each other, and from what is told apart, by some 2^28 cells, the side of no map that a device
// holds.
constexpr int farthest_cell = 1 << 29;
constexpr int element_beyond = (1 << 30) - 1;
constexpr int axis_beyond = 3 << 28;

shaders::Split split(double coordinate_cells, int beyond) {
  if (!(std::abs(coordinate_cells) < farthest_cell)) {
    return {std::signbit(coordinate_cells) ? -beyond : beyond, 0.0F};
  }
  const double cell = std::floor(coordinate_cells);
  return {static_cast<int>(cell), static_cast<float>(coordinate_cells - cell)};
}

/// Empties the evidence, and makes room for all that touches of so many elements may add to it.
void clear(ContactEvidence& evidence, std::size_t touches, std::size_t elements,
           std::size_t segment_elements) {
  evidence.from_pivot_mm.clear();
  evidence.from_pivot_mm.reserve(elements);
  evidence.segments.clear();
  // A segment for every reading of a touch, and for every part of one that is too long.
  evidence.segments.reserve(touches * most_reading_levels + elements / segment_elements);
  evidence.counts = {};
}

/// Adds the touch's elements that are not Unknown, as segments of one reading each.
void append(ContactEvidence& evidence, const TouchEvidence& touch, const glm::dvec2& pivot_mm,
            std::size_t segment_elements) {
  const std::vector<Reading>& readings = touch.readings;
  ReadingCounts counts{};
  for (const Reading reading : readings) {
    ++counts[static_cast<std::size_t>(reading)];
  }
  for (std::size_t level = 0; level < counts.size(); ++level) {
    evidence.counts[level] += counts[level];
    const auto reading = static_cast<Reading>(level);
    if (counts[level] == 0 || reading == Reading::unknown) {
      continue;
    }
    const std::size_t first = evidence.from_pivot_mm.size();
    for (std::size_t i = 0; i < readings.size(); ++i) {
      if (readings[i] == reading) {
        evidence.from_pivot_mm.push_back(touch.T_robot_sensor * touch.elements_mm[i] - pivot_mm);
      }
    }
    const std::size_t end = evidence.from_pivot_mm.size();
    for (std::size_t begin = first; begin < end; begin += segment_elements) {
      evidence.segments.push_back(
          {.begin = static_cast<shaders::uint>(begin),
           .end = static_cast<shaders::uint>(std::min(begin + segment_elements, end)),
           .reading = static_cast<shaders::uint>(reading)});
    }
  }
}

/// Gathers all that is not Unknown in the place of what the evidence held.
void gather_into(ContactEvidence& evidence, std::span<const TouchEvidence> touches,
                 const glm::dvec2& pivot_mm, std::size_t segment_elements) {
  std::size_t elements = 0;
  for (const TouchEvidence& touch : touches) {
    elements += touch.readings.size();
  }
  clear(evidence, touches.size(), elements, segment_elements);
  for (const TouchEvidence& touch : touches) {
    append(evidence, touch, pivot_mm, segment_elements);
  }
}

}  // namespace

ContactEvidence gather_evidence(std::span<const Touch> touches, const ContactModel& model,
                                const glm::dvec2& pivot_mm, std::size_t segment_elements) {
  ContactEvidence evidence;
  gather_into(evidence, evidence_of(touches, model), pivot_mm, segment_elements);
  return evidence;
}

std::span<const ContactEvidence> EvidenceGatherer::gather(std::span<const TouchEvidence> touches,
                                                          bool each, const glm::dvec2& pivot_mm,
                                                          std::size_t segment_elements) {
  const std::size_t parts = each ? touches.size() : 1;
  evidence_.resize(std::max(evidence_.size(), parts));
  for (std::size_t i = 0; i < parts; ++i) {
    gather_into(evidence_[i], each ? touches.subspan(i, 1) : touches, pivot_mm, segment_elements);
  }
  return std::span(evidence_).first(parts);
}

shaders::Split split(double coordinate_cells) { return split(coordinate_cells, element_beyond); }

shaders::Split split_axis(double coordinate_cells) { return split(coordinate_cells, axis_beyond); }

std::vector<shaders::RotatedElement> rotate_evidence(std::span<const glm::dvec2> from_pivot_mm,
                                                     const Axis& theta_rad, double cell_mm,
                                                     std::vector<shaders::RotatedElement> reuse) {
  std::vector<shaders::RotatedElement> rotated = std::move(reuse);
  rotated.clear();
  rotated.reserve(from_pivot_mm.size() * static_cast<std::size_t>(theta_rad.count));
  for (int t = 0; t < theta_rad.count; ++t) {
    const double c = std::cos(theta_rad.centre(t)) / cell_mm;
    const double s = std::sin(theta_rad.centre(t)) / cell_mm;
    for (const glm::dvec2& p : from_pivot_mm) {
      rotated.push_back({split(c * p.x - s * p.y), split(s * p.x + c * p.y)});
    }
  }
  return rotated;
}

double prior_log_likelihood(Reading reading, const ContactModel& model) {
  const MapSample prior{.log_odds = log_odds_from_probability(model.prior.value())};
  const std::size_t sets = model.table ? model.table->sets() : 1;
  double most = -std::numeric_limits<double>::infinity();
  for (std::size_t set = 0; set < sets; ++set) {
    most = std::max(most, model.log_likelihood(reading, prior, set));
  }
  double sum = 0.0;
  for (std::size_t set = 0; set < sets; ++set) {
    sum += std::exp(model.log_likelihood(reading, prior, set) - most);
  }
  return most + std::log(sum / static_cast<double>(sets));
}

double prior_log_likelihood(const ReadingCounts& counts, const ContactModel& model) {
  double sum = 0.0;
  for (std::size_t reading = 0; reading < counts.size(); ++reading) {
    if (counts[reading] > 0) {
      sum += static_cast<double>(counts[reading]) *
             prior_log_likelihood(static_cast<Reading>(reading), model);
    }
  }
  return sum;
}

double prior_log_likelihood(std::span<const ContactEvidence> evidence, const ContactModel& model) {
  ReadingCounts counts{};
  for (const ContactEvidence& part : evidence) {
    std::ranges::transform(counts, part.counts, counts.begin(), std::plus());
  }
  return prior_log_likelihood(counts, model);
}

}  // namespace palpate
