#include "dense_posterior.hpp"

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "letters.hpp"
#include "trials.hpp"

namespace palpate::bench {
namespace {

/// Two letters on a small lattice, touched three times.
class DensePosteriorTest : public testing::Test {
 protected:
  DensePosteriorTest() {
    histogram_.update(trial_.touches(0, 3));
    bounded_.update(trial_.touches(0, 3));
  }

  DensePosterior dense() const {
    return dense_posterior(histogram_, letters_, ContactModel{}, trial_.touches(0, 3));
  }

  Device device_ = Device::open();
  std::vector<Hypothesis> letters_ = letter_maps(device_, training_recordings(), MapOptions{});
  Recording trial_ = make_trials(vowels, 1, 3, 7)[1];
  PoseLattice lattice_ = lattice_of(7, 6, 8);
  PoseHistogram histogram_{device_, letters_, {.lattice = lattice_}};
  BoundedPosterior bounded_{letters_, {.lattice = lattice_}};
};

TEST_F(DensePosteriorTest, IsTheHistogramsUpToItsRounding) {
  const DensePosterior posterior = dense();
  const Estimate estimate = histogram_.estimate();
  EXPECT_EQ(posterior.mode.object, estimate.mode.object);
  EXPECT_EQ(posterior.mode.bin, estimate.mode.bin);
  // Three touches of 36 elements in float32: a few 1e-6 nats each.
  EXPECT_NEAR(posterior.mode.log_likelihood, estimate.mode.log_likelihood, 3e-5);
  double sum = 0.0;
  for (std::size_t i = 0; i < letters_.size(); ++i) {
    EXPECT_NEAR(posterior.identity[i], estimate.identity[i], 3e-5);
    const Marginals marginals = histogram_.marginals(static_cast<int>(i));
    const Marginals& exact = posterior.marginals[i];
    for (std::size_t k = 0; k < exact.xy.size(); ++k) {
      EXPECT_NEAR(exact.xy[k], marginals.xy[k], 3e-5);
    }
    EXPECT_NEAR(std::accumulate(exact.xy.begin(), exact.xy.end(), 0.0), posterior.identity[i],
                1e-12);
    EXPECT_NEAR(std::accumulate(exact.theta.begin(), exact.theta.end(), 0.0), posterior.identity[i],
                1e-12);
    sum += posterior.identity[i];
  }
  EXPECT_NEAR(sum, 1.0, 1e-12);
}

TEST_F(DensePosteriorTest, CertificateOfTheSameTouchesHolds) {
  const CertificateCheck check = check_certificate(bounded_, dense());
  EXPECT_TRUE(check.holds());
  EXPECT_TRUE(check.same_mode);
  EXPECT_LE(check.promised, 1e-6);
}

TEST_F(DensePosteriorTest, CertificateOfOtherTouchesDoesNot) {
  const DensePosterior posterior = dense();
  bounded_.reset();
  bounded_.update(trial_.touches(0, 2));
  const CertificateCheck check = check_certificate(bounded_, posterior);
  EXPECT_FALSE(check.holds()) << "the check can fail";
  EXPECT_GT(check.total_variation, 1e-3);
}

}  // namespace
}  // namespace palpate::bench
