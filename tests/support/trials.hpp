#pragma once

#include <cstdlib>

#include "support/sanitized.hpp"

namespace palpate {

/// How many random cases a test tries: as many as fit in a minute for all tests together, or
/// PALPATE_TRIALS times as many where the environment has it. Under AddressSanitizer, where float64
/// is ten times slower, a fifth.
inline int trials(int usual) {
  const char* const times = std::getenv("PALPATE_TRIALS");
  const int wanted = times == nullptr ? usual : usual * std::atoi(times);
  return sanitized ? (wanted + 4) / 5 : wanted;
}

}  // namespace palpate
