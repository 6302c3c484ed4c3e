// The certificate's law on lattices that take a while.

#include <gtest/gtest.h>

#include "bounded/certificate_trials.hpp"

namespace palpate {
namespace {

#ifdef __SANITIZE_ADDRESS__
constexpr int unknowns = 5;  // the float64 posterior of all bins takes ten times as long
#else
constexpr int unknowns = 50;
#endif

TEST(CertificateLaw, HoldsOverUnknownsOfTenThousandBins) {
  expect_trials({25, 25, 16}, unknowns, 903);
}
TEST(CertificateLaw, HoldsOverUnknownsOfThirtyThousandBins) {
  expect_trials({30, 31, 32}, unknowns, 921);
}
TEST(CertificateLaw, HoldsOverUnknownsOfSixtyThousandBins) {
  expect_trials({45, 44, 30}, unknowns, 922);
}

}  // namespace
}  // namespace palpate
