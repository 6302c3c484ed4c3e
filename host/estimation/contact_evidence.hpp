#pragma once

#include <array>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "model/touch_evidence.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/lattice.hpp"
#include "shaders/interface.h"

namespace palpate {

/// Number of elements of every reading.
using ReadingCounts = std::array<std::uint64_t, most_reading_levels + 1>;

/// Elements of some touches for a device, in the robot frame and relative to the lattice's pivot,
/// ordered so that equal readings of a touch stand together. Searches by bounds have the same
/// elements as KnownElements, ordered over all touches.
struct ContactEvidence {
  std::vector<glm::dvec2> from_pivot_mm;
  std::vector<shaders::Segment> segments;
  ReadingCounts counts{};  ///< of the whole touches, elements that stand in no segment included
  /// Number of elements of the whole touches.
  std::size_t elements() const { return std::reduce(counts.begin(), counts.end()); }
};

/// Classifies the touches' elements (Eq. 3) and gathers those that are not Unknown. No segment is
/// longer than `segment_elements`, what one dispatch takes.
ContactEvidence gather_evidence(std::span<const Touch> touches, const ContactModel& model,
                                const glm::dvec2& pivot_mm, std::size_t segment_elements);

/// Gathers evidence as gather_evidence() does, again and again in the same memory: touches of no
/// more elements than before allocate nothing, whatever they read. What it returns stays until the
/// next call.
class EvidenceGatherer {
 public:
  /// @param each whether each touch is gathered by itself, [touch], or else all together
  std::span<const ContactEvidence> gather(std::span<const TouchEvidence> touches, bool each,
                                          const glm::dvec2& pivot_mm, std::size_t segment_elements);

 private:
  std::vector<ContactEvidence> evidence_;
};

/// Splits an element's coordinate into whole cells and the rest. One beyond 2^29 cells, or that is
/// no number, counts as off every map: its cell becomes so large that the sum with any cell of
/// split_axis() is outside, yet within int32.
shaders::Split split(double coordinate_cells);
/// Splits the coordinate of a place of the lattice, to which an element's is added.
shaders::Split split_axis(double coordinate_cells);

/// Every element rotated by every theta of the lattice, in cells, [theta, element].
/// @param reuse memory for the result
std::vector<shaders::RotatedElement> rotate_evidence(
    std::span<const glm::dvec2> from_pivot_mm, const Axis& theta_rad, double cell_mm,
    std::vector<shaders::RotatedElement> reuse = {});

/// Touches contradict all hypotheses where a map of nothing but the prior explains them better than
/// the best pose of any object does, by more than this many nats. exp(-700) is among the smallest
/// numbers that float64 holds at full precision.
inline constexpr double contradiction_nats = 700.0;

/// Log-likelihood in nats of a reading on a map of nothing but the prior (Eq. 7). Where a table
/// holds numbers of their own for every object, this is the log of the mean of the objects'
/// likelihoods.
double prior_log_likelihood(Reading reading, const ContactModel& model);
/// Log-likelihood in nats of all readings on a map of nothing but the prior, at whatever pose.
double prior_log_likelihood(const ReadingCounts& counts, const ContactModel& model);
/// Log-likelihood in nats of the readings of all evidence on such a map.
double prior_log_likelihood(std::span<const ContactEvidence> evidence, const ContactModel& model);

}  // namespace palpate
