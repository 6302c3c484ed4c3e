// The certificate's law on lattices that take a while.

#include <gtest/gtest.h>

#include "bounded/certificate_trials.hpp"

namespace palpate {
namespace {

TEST(CertificateLaw, HoldsOverFiftyUnknownsOfThirtyThousandBins) {
  expect_trials({30, 31, 32}, 50, 921);
}
TEST(CertificateLaw, HoldsOverFiftyUnknownsOfAHundredThousandBins) {
  expect_trials({60, 58, 30}, 50, 922);
}

}  // namespace
}  // namespace palpate
