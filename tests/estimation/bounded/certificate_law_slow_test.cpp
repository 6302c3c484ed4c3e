// The certificate's law on lattices that take a while.

#include <gtest/gtest.h>

#include "bounded/certificate_trials.hpp"
#include "sanitized.hpp"

namespace palpate::certificate_law_slow_test {

// The float64 posterior of all bins is what takes long.
constexpr int fewer = sanitized ? 10 : 1;

TEST(CertificateLaw, HoldsOverUnknownsOfTenThousandBins) {
  expect_trials({25, 25, 16}, 20 / fewer, 903);
}
TEST(CertificateLaw, HoldsOverUnknownsOfThirtyThousandBins) {
  expect_trials({30, 31, 32}, 10 / fewer, 921);
}
TEST(CertificateLaw, HoldsOverUnknownsOfSixtyThousandBins) {
  expect_trials({45, 44, 30}, 10 / fewer, 922);
}

}  // namespace palpate::certificate_law_slow_test
