#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "palpate/fit.hpp"

namespace palpate {

/// How touches of an object that is left out fit the best of all others.
struct StrangerFit {
  Fit fit;                  ///< by evidence_fit(), on no scale
  std::size_t touches = 0;  ///< with an element In Contact
};

/// FitScale::stranger_sd by which the fits are likeliest; each object counts alike. No fit of less
/// than two touches counts.
/// @param objects [label]
/// @param scale of learned objects' z
/// @returns from 1 to 16; none of fewer than three objects with five fits each
std::optional<double> stranger_sd_of(const std::map<std::string, std::vector<StrangerFit>>& objects,
                                     const FitScale& scale);

}  // namespace palpate
