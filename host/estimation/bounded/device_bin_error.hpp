#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "estimation/bounded/known_elements.hpp"
#include "estimation/bounded/map_extent.hpp"
#include "estimation/bounded/reading_form.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// How wrong DeviceBinLikelihood may be, on every device of Vulkan's precision.
class DeviceBinError {
 public:
  /// @param contact resolved: with its prior
  DeviceBinError(std::span<const Hypothesis> hypotheses, const ContactModel& contact,
                 const PoseLattice& lattice);

  /// Bound, in nats, of the error at any bin of an object.
  double nats(std::size_t object, const KnownElements& elements) const;

 private:
  ReadingForm form_;
  bool products_;  ///< how the kernel evaluates Eq. 7
  bool has_floor_;
  double trust_;                    ///< 1 - gamma
  double prior_rounding_;           ///< of the prior's log odds, as a float
  std::vector<MapExtent> extents_;  ///< [object]
};

}  // namespace palpate
