// The certificate's law on lattices that take a while.

#include <gtest/gtest.h>

#include "bounded/certificate_trials.hpp"
#include "support/sanitized.hpp"

namespace palpate::certificate_law_slow_test {

// The float64 posterior of all bins is what takes long: smaller lattices try many more unknowns.
TEST(CertificateLaw, HoldsOverUnknownsOfTenThousandBins) {
  expect_trials({25, 25, 16}, sanitized ? 2 : 5, 1004);
}
TEST(CertificateLaw, HoldsOverUnknownsOfThirtyThousandBins) {
  expect_trials({30, 31, 32}, sanitized ? 1 : 3, 921);
}
TEST(CertificateLaw, HoldsOverUnknownsOfSixtyThousandBins) {
  expect_trials({45, 44, 30}, sanitized ? 1 : 2, 1035);
}

}  // namespace palpate::certificate_law_slow_test
