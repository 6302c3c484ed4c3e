#pragma once

#include <span>
#include <vector>

#include "interface.h"
#include "palpate/contact.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// The known elements of some touches, in the robot frame and relative to the lattice's pivot,
/// ordered so that equal reading classes of a touch stand together.
struct ContactEvidence {
  std::vector<glm::dvec2> from_pivot_mm;
  std::vector<shaders::Segment> segments;

  bool operator==(const ContactEvidence& other) const;
};

/// Classifies the touches' elements (Eq. 3) and leaves out those that are Unknown. No segment is
/// longer than `segment_elements`, what one dispatch takes.
ContactEvidence gather_evidence(std::span<const Touch> touches, const ContactClassifier& classifier,
                                const glm::dvec2& pivot_mm, std::size_t segment_elements);

/// The same for an array that reads No Contact everywhere.
ContactEvidence gather_no_contact(const Touch& touch, const glm::dvec2& pivot_mm,
                                  std::size_t segment_elements);

/// What a touch adds to that: the elements that are not in No Contact, by the ratio of their
/// likelihood to that of No Contact.
ContactEvidence gather_differences(const Touch& touch, const ContactClassifier& classifier,
                                   const glm::dvec2& pivot_mm, std::size_t segment_elements);

/// Splits an element's coordinate into whole cells and the rest. One beyond 2^29 cells, or that is
/// no number, counts as off every map: its cell becomes so large that the sum with any cell of
/// split_axis() is outside, yet within int32.
shaders::Split split(double coordinate_cells);
/// The same for what an element's coordinate is added to: a place of the lattice.
shaders::Split split_axis(double coordinate_cells);

/// Every element rotated by every theta of the lattice, in cells, [theta, element].
std::vector<shaders::RotatedElement> rotate_evidence(std::span<const glm::dvec2> from_pivot_mm,
                                                     const Axis& theta_rad, double cell_mm);

}  // namespace palpate
