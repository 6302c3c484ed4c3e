// The certificate of touches of uncertain pose against the posterior over all bins in float64.

#include <gtest/gtest.h>

#include "bounded/certificate_trials.hpp"
#include "support/sanitized.hpp"

namespace palpate::displaced_certificate_test {

TEST(DisplacedCertificate, HoldsOverUnknownsOfAHundredBins) {
  expect_trials({7, 5, 3}, 40, 931, make_displaced_trial);
}
TEST(DisplacedCertificate, HoldsOverUnknownsOfTwoThousandBins) {
  expect_trials({12, 12, 16}, sanitized ? 4 : 6, 932, make_displaced_trial);
}
TEST(DisplacedCertificate, HoldsOverUnknownsOfTenThousandBins) {
  expect_trials({25, 25, 16}, 1, 933, make_displaced_trial);
}

}  // namespace palpate::displaced_certificate_test
