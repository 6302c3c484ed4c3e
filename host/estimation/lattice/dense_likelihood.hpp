#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "estimation/contact_evidence.hpp"
#include "estimation/contact_kernel.hpp"
#include "estimation/lattice/dense_belief.hpp"
#include "estimation/lattice/map_table.hpp"
#include "gpu/command_stream.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/lattice.hpp"
#include "palpate/pose_histogram.hpp"

namespace palpate {

/// The log-likelihood of touches at every bin of the lattice, for several maps (Eq. 7).
class DenseLikelihood {
 public:
  /// Elements that a dispatch takes at best: a multiple of the factors of a product, unless the
  /// device's tables hold fewer.
  /// @throws Error where they do not hold one element at every theta
  static std::size_t batch_for(const gpu::Context& context, const PoseLattice& lattice,
                               std::size_t objects);
  /// Records the upload of the maps, in the order of the belief's objects, and a first, empty run
  /// of every kernel: drivers compile them then, and no touch has to wait for that. Beyond each map
  /// lies the model's prior. @throws Error where a map is larger than what kernels read
  DenseLikelihood(gpu::Context& context, gpu::CommandStream& stream, const DenseBelief& belief,
                  std::span<const Hypothesis> hypotheses, const PoseLattice& lattice,
                  const ContactModel& model);

  /// Most elements that one segment of the evidence may hold.
  std::size_t segment_elements() const { return batch_elements_; }

  /// Adds the evidence to the belief. Runs the stream from time to time, so that no submission
  /// keeps a device busy for long, and reports the fraction done.
  void accumulate(const ContactEvidence& evidence, const DenseBelief& belief,
                  const std::function<void(double)>& progress);

  /// The path of every cell size among the maps, and why it was chosen.
  std::vector<std::string> paths() const;

  std::uint64_t device_bytes() const;

 private:
  /// Objects that a dispatch takes together.
  struct Group : MapGroup {
    LikelihoodPath path;
    MapTable maps;
  };
  /// The objects of a group that a slab holds: a range of group.objects.
  struct Range {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
  };

  static Range within(const Group& group, const Slab& slab);
  /// Products of bins and elements.
  static double work_of(const Range& range, const Slab& slab, std::size_t elements) {
    return static_cast<double>(range.count * slab.bins()) * static_cast<double>(elements);
  }
  /// Records one run of the group's kernel over its objects in a slab.
  void dispatch(const Group& group, const Range& range, const Slab& slab, std::size_t segments,
                std::size_t elements);
  /// Makes room for this many elements in the tables.
  void reserve(std::size_t elements);

  gpu::Context& context_;
  gpu::CommandStream& stream_;
  PoseLattice lattice_;
  std::size_t objects_;
  ContactTable contact_;
  std::vector<Group> groups_;
  std::size_t batch_elements_ = 0;  ///< most elements in the tables
  gpu::Buffer elements_;
  gpu::Buffer segments_;
  std::vector<shaders::Segment> batch_;           ///< what goes to segments_
  std::vector<shaders::RotatedElement> rotated_;  ///< what goes to elements_
};

/// The log-likelihood of a touch that may come next, at every bin. It takes as much memory as the
/// belief, from the first touch that is prepared.
class PreparedTouch {
 public:
  /// @param room for one more belief on the device, and within the limit that the options set
  PreparedTouch(gpu::CommandStream& stream, bool room) : stream_(stream), room_(room) {}

  bool has_room() const { return room_; }
  /// Takes the memory. False where the device has none left: nothing is prepared from then on.
  bool make_room(const DenseBelief& belief);
  /// Evaluates this evidence in the place of what was prepared before.
  void evaluate(ContactEvidence evidence, DenseLikelihood& likelihood);
  bool holds(const ContactEvidence& evidence) const { return evidence_ == evidence; }
  /// Adds the log-likelihood of the evidence that it holds to the belief (Eq. 13).
  void accumulate(DenseBelief& belief, const std::function<void(double)>& progress) const;

  std::uint64_t device_bytes() const {
    return log_likelihood_ ? log_likelihood_->device_bytes() : 0;
  }

 private:
  gpu::CommandStream& stream_;
  bool room_;
  std::optional<ContactEvidence> evidence_;  ///< none while its log-likelihood is not sound
  std::optional<DenseBelief> log_likelihood_;
};

/// A touch as a still array takes it in.
struct StillTouch {
  const TouchEvidence* touch = nullptr;
  bool by_differences = false;  ///< the evidence holds only what differs from No Contact everywhere
  ContactEvidence evidence;
};

/// An array that stays in one place from touch to touch. The log-likelihood of an array that reads
/// No Contact everywhere is evaluated once for each place. A touch adds this log-likelihood and the
/// elements that read something else.
class StillArray {
 public:
  /// @param lattice outlives this object; its pivot may move
  explicit StillArray(const PoseLattice& lattice) : lattice_(lattice) {}

  /// Gathers every touch by its differences where at least half of its elements read No Contact,
  /// or else as a whole.
  /// @returns what stays until the next call, and as long as the touches do
  std::span<const StillTouch> gather(std::span<const TouchEvidence> touches,
                                     std::size_t segment_elements);

  /// Adds the touches to the belief one after the other, with the fraction done after each (Eq.
  /// 13).
  void accumulate(std::span<const StillTouch> touches, DenseLikelihood& likelihood,
                  const DenseBelief& belief, const std::function<void(double)>& progress);

  std::uint64_t device_bytes() const { return no_contact_ ? no_contact_->device_bytes() : 0; }

 private:
  /// Evaluates No Contact everywhere where the array was not before.
  const DenseBelief& no_contact_at(const TouchEvidence& touch, DenseLikelihood& likelihood,
                                   const DenseBelief& belief);

  const PoseLattice& lattice_;
  std::optional<DenseBelief> no_contact_;  ///< log-likelihood of No Contact everywhere
  ContactEvidence evaluated_;              ///< that it holds
  // Memory that updates share.
  std::vector<StillTouch> gathered_;  ///< of the most touches so far
  std::vector<Reading> readings_;     ///< all of them No Contact
  ContactEvidence everywhere_;
};

}  // namespace palpate
