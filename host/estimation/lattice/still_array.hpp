#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "estimation/contact_evidence.hpp"
#include "estimation/lattice/dense_belief.hpp"
#include "estimation/lattice/dense_likelihood.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// A touch as an array at rest takes it in.
struct StillTouch {
  Touch touch;
  bool by_differences = false;  ///< the evidence holds only what differs from No Contact everywhere
  ContactEvidence evidence;
};

/// An array that stays in one place from touch to touch. The log-likelihood of an array that reads
/// No Contact everywhere is evaluated once for each place. A touch adds this log-likelihood and the
/// elements that read something else.
class StillArray {
 public:
  /// @param lattice outlives this object; its pivot may move
  StillArray(const ContactModel& contact, const PoseLattice& lattice)
      : contact_(contact), lattice_(lattice) {}

  /// Gathers every touch by its differences where at least half of its elements read No Contact,
  /// or else as a whole.
  /// @returns what stays until the next call
  /// @throws Error on a touch that is not sound
  std::span<const StillTouch> gather(std::span<const Touch> touches, std::size_t segment_elements);

  /// Adds the touches to the belief one after the other, with the fraction done after each (Eq.
  /// 13).
  void accumulate(std::span<const StillTouch> touches, DenseLikelihood& likelihood,
                  const DenseBelief& belief, const std::function<void(double)>& progress);

  std::uint64_t device_bytes() const { return no_contact_ ? no_contact_->device_bytes() : 0; }

 private:
  /// Evaluates No Contact everywhere where the array was not before.
  const DenseBelief& no_contact_at(const Touch& touch, DenseLikelihood& likelihood,
                                   const DenseBelief& belief);

  ContactModel contact_;
  const PoseLattice& lattice_;
  std::optional<DenseBelief> no_contact_;  ///< log-likelihood of No Contact everywhere
  ContactEvidence evaluated_;              ///< that it holds
  // Memory that updates share.
  std::vector<StillTouch> gathered_;  ///< of the most touches so far
  std::vector<Reading> readings_;
  ContactEvidence everywhere_;
};

}  // namespace palpate
