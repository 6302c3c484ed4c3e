#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "estimation/bounded/touch_overlap.hpp"
#include "palpate/contact_model.hpp"

namespace palpate {

/// Elements of one reading: [begin, end) of a list.
struct ReadingRun {
  Reading reading{};
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// The elements of some touches that are not Unknown, in the robot frame and relative to the
/// lattice's pivot. Elements multiply (Eq. 13), so that neither touches nor their order count:
/// equal readings stand together, by their places.
struct KnownElements {
  std::vector<glm::dvec2> from_pivot_mm;
  std::vector<ReadingRun> runs;  ///< ascending by reading

  bool empty() const { return from_pivot_mm.empty(); }
};

/// All elements of a touch in the array's order, Unknown ones too: in the robot frame and relative
/// to the lattice's pivot.
struct ArrayReadings {
  std::vector<glm::dvec2> from_pivot_mm;
  std::vector<Reading> readings;
  ArrayRectangle rectangle{};
};

/// The elements that are not Unknown.
KnownElements known_elements(const ArrayReadings& array);
/// The elements that are not in No Contact, Unknown ones as one more reading.
KnownElements changed_elements(const ArrayReadings& array);

/// The elements of all.
KnownElements merged(std::span<const KnownElements> lists);

}  // namespace palpate
