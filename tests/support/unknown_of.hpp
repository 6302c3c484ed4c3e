#pragma once

#include "recognition/recordings.hpp"

namespace palpate {

/// All touches of a recording as one unknown.
inline Query unknown_of(const Recording& recording) {
  return unknowns_in({}, {}, recording).front();
}

}  // namespace palpate
