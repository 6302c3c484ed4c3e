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
TEST(SlipCertificate, HoldsWithinAnyBudget) {
  for (std::uint64_t seed = 945; seed < (sanitized ? 947 : 953); ++seed) {
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    expect_certified_within(make_slipping_trial({25, 25, 9}, seed), {1e-9, 1e-3, 1e-2, 10.0});
  }
}
TEST(SlipCertificate, HoldsAfterManyTouches) {
  expect_trials({16, 15, 16}, 1, 944, make_long_slipping_trial);
}

}  // namespace palpate::slip_certificate_test
