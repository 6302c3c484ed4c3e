#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "palpate/fit.hpp"
#include "palpate/learned_sensor.hpp"

namespace palpate {

/// How touches of an object that is left out fit the best of all others.
struct StrangerFit {
  Fit fit;                  ///< by evidence_fit(), on no scale
  std::size_t touches = 0;  ///< with an element In Contact
};

/// The scale with stranger_sd and stranger_alone by which the fits are likeliest, those of several
/// touches and of one; each object counts alike. Either is none where fewer than three objects have
/// five such fits.
/// @param objects [label]
/// @param scale of learned objects' z
/// @returns stranger_sd from 1 to 16, stranger_alone with a mean from -16 to 0 and an sd from 1 to
/// 16
FitScale with_strangers(const std::map<std::size_t, std::vector<StrangerFit>>& objects,
                        FitScale scale);

/// Says, without a full stop, that touches did not tell how badly strangers fit; "" where they did,
/// or where nothing of fits was learned.
std::string unlearned_strangers(const LearnedSensor& sensor);

}  // namespace palpate
