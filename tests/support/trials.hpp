#pragma once

#include <cstdlib>
#include <stdexcept>
#include <string>

namespace palpate {

// AddressSanitizer makes float64 ten times slower. With it, tests that try many random cases for a
// number beyond its bounds try fewer, and a few cases are smaller: the released code's tests try
// all.
#ifdef __SANITIZE_ADDRESS__
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

/// How many random cases a test tries: as many as fit in a minute for all tests together, or
/// PALPATE_TRIALS times as many where the environment has it. Under AddressSanitizer, where float64
/// is ten times slower, a fifth.
/// @throws std::invalid_argument, and so fails the test, where PALPATE_TRIALS is no number from 1:
/// a test that tries nothing finds nothing
inline int trials(int usual) {
  const char* const given = std::getenv("PALPATE_TRIALS");
  const int times = given == nullptr ? 1 : std::atoi(given);
  if (times < 1) {
    throw std::invalid_argument(std::string("PALPATE_TRIALS = '") + given +
                                "': give a whole number from 1");
  }
  const int wanted = usual * times;
  return sanitized ? (wanted + 4) / 5 : wanted;
}

}  // namespace palpate
