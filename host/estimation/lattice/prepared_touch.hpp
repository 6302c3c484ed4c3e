#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "estimation/contact_evidence.hpp"
#include "estimation/lattice/dense_belief.hpp"
#include "estimation/lattice/dense_likelihood.hpp"

namespace palpate {

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

}  // namespace palpate
