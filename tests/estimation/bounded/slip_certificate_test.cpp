// The certificate of objects that slip between touches against the posterior over all bins in
// float64.

#include <gtest/gtest.h>

#include "bounded/certificate_trials.hpp"
#include "sanitized.hpp"

namespace palpate::slip_certificate_test {

TEST(SlipCertificate, HoldsOverUnknownsOfAHundredBins) {
  expect_trials({7, 5, 3}, sanitized ? 40 : 150, 941, make_slipping_trial);
}
TEST(SlipCertificate, HoldsOverUnknownsOfTwoThousandBins) {
  expect_trials({12, 12, 16}, sanitized ? 6 : 16, 942, make_slipping_trial);
}
TEST(SlipCertificate, HoldsOverUnknownsOfTenThousandBins) {
  expect_trials({25, 25, 16}, sanitized ? 1 : 2, 943, make_slipping_trial);
}
TEST(SlipCertificate, HoldsAfterManyTouches) {
  expect_trials({16, 15, 16}, 1, 944, make_long_slipping_trial);
}

}  // namespace palpate::slip_certificate_test
