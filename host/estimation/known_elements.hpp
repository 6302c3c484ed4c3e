#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "model/touch_evidence.hpp"
#include "palpate/bounded_posterior.hpp"
#include "palpate/contact_model.hpp"
#include "shaders/interface.h"

namespace palpate {

class UndisplacedBins;

/// Elements of one reading: [begin, end) of a list.
struct ReadingRun {
  Reading reading{};
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// The elements of some touches that are not Unknown, in the robot frame and relative to the
/// lattice's pivot, in runs of equal readings.
struct KnownElements {
  std::vector<glm::dvec2> from_pivot_mm;
  std::vector<ReadingRun> runs;

  /// What is bounded and evaluated by itself: all of these elements together, or each displaced
  /// touch.
  std::span<const KnownElements> items() const {
    return touches.empty() ? std::span(this, 1) : std::span<const KnownElements>(touches);
  }

  // Displaced touches, whose sensors may have stood elsewhere (touch_sd), are averaged each by
  // itself: their elements do not multiply with those of others.
  std::vector<KnownElements> touches = {};  ///< each by itself; empty where none is displaced
  glm::dvec2 sensor_from_pivot_mm = {};     ///< of one touch: the sensor's origin
  /// Where set, keeps what was evaluated of this one touch. Copies share it.
  std::shared_ptr<UndisplacedBins> undisplaced_bins = {};
};

/// The elements of a touch for a search. Elements multiply (Eq. 13), so that neither touches nor
/// their order count: there is one run of each reading, ascending, its elements ordered by place.
/// @param options whose lattice has the pivot, and whose touch_sd says whether touches are
/// displaced
KnownElements known_elements(const TouchEvidence& touch, const BoundedOptions& options);

/// Indices of touches in an order that does not depend on when they came.
std::vector<std::size_t> sorted_touches(std::span<const KnownElements> touches);

/// The elements of all, in runs as those of one touch. Displaced touches stay in the order of the
/// lists.
KnownElements merged(std::span<const KnownElements> lists);

/// The elements of touches for a device, touch by touch, each in runs of equal readings. No run is
/// longer than `longest_run`, what one dispatch takes. They stand in the memory of `reuse`: touches
/// of no more elements than before allocate nothing, whatever they read, and from_pivot_mm has room
/// for every element of the touches.
KnownElements gathered(std::span<const TouchEvidence> touches, const glm::dvec2& pivot_mm,
                       std::size_t longest_run, KnownElements reuse = {});

/// A run as kernels read it, in a list that begins at element `first`.
inline shaders::Segment segment_of(const ReadingRun& run, std::size_t first = 0) {
  return {.begin = static_cast<shaders::uint>(run.begin - first),
          .end = static_cast<shaders::uint>(run.end - first),
          .reading = static_cast<shaders::uint>(run.reading)};
}

/// Touches contradict all hypotheses where a map of nothing but the prior explains them better than
/// the best pose of any object does, by more than this many nats. exp(-700) is among the smallest
/// numbers that float64 holds at full precision.
inline constexpr double contradiction_nats = 700.0;

/// The log-likelihood of the elements on a map of nothing but the prior (Eq. 7), in nats. Where a
/// table holds numbers of their own for every object, that of a reading is the log of the mean of
/// the objects' likelihoods.
double prior_log_likelihood(const KnownElements& elements, const ContactModel& contact);
/// The log-likelihood of the elements on such a map by the numbers of each of so many objects, in
/// nats, [object].
std::vector<double> prior_log_likelihoods(const KnownElements& elements,
                                          const ContactModel& contact, std::size_t objects);

/// Touches in the order in which they came. The first one makes room for some more of its size, so
/// that keeping these allocates no memory.
class KeptTouches {
 public:
  /// So many touches of the first one's size have room; fewer where they would take more than
  /// `most_bytes`.
  static constexpr std::size_t room_for = 64;
  static constexpr std::size_t most_bytes = std::size_t{1} << 22;

  void add(std::span<const TouchEvidence> touches);
  /// Classifies the touches' elements (Eq. 3) and keeps them.
  /// @throws Error on a touch that is not sound, and keeps none of these
  void add(std::span<const Touch> touches, const ContactModel& contact);
  std::size_t size() const { return count_; }
  /// Until the next call.
  std::span<const TouchEvidence> all() const { return std::span(touches_).first(count_); }
  /// Forgets them, and keeps the room.
  void clear() { count_ = 0; }

 private:
  /// For the first touches, of so many elements.
  void make_room(std::size_t elements);

  std::vector<TouchEvidence> touches_;  ///< those from count_ on are room
  std::size_t count_ = 0;
};

}  // namespace palpate
