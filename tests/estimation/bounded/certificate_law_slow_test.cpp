// The certificate's law on lattices that take a while.

#include <gtest/gtest.h>

#include "bounded/certificate_trials.hpp"

namespace palpate {
namespace {

TEST(CertificateLaw, HoldsOverFiftyUnknownsOfTenThousandBins) {
  expect_trials({25, 25, 16}, 50, 903);
}
TEST(CertificateLaw, HoldsOverFiftyUnknownsOfThirtyThousandBins) {
  expect_trials({30, 31, 32}, 50, 921);
}
TEST(CertificateLaw, HoldsOverFiftyUnknownsOfSixtyThousandBins) {
  expect_trials({45, 44, 30}, 50, 922);
}

}  // namespace
}  // namespace palpate
