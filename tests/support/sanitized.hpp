#pragma once

namespace palpate {

// AddressSanitizer makes float64 ten times slower. With it, tests that try many random cases for a
// number beyond its bounds try fewer, and a few cases are smaller: the released code's tests try
// all.
#ifdef __SANITIZE_ADDRESS__
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

}  // namespace palpate
