#include "learning/stranger_fit.hpp"

#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "model/random.hpp"

namespace palpate::stranger_fit_test {

constexpr FitScale scale{.mean = 0.9, .sd = 1.4, .shared_sd = 0.1};

using Fits = std::map<std::size_t, std::vector<StrangerFit>>;

std::optional<double> sd_of(const Fits& fits) { return with_strangers(fits, scale).stranger_sd; }

/// Fits as wide as the model says, one in ten of them wider, of objects left out.
class Strangers {
 public:
  void add(std::size_t label, int count, std::size_t touches, double stranger_sd) {
    const auto n = static_cast<double>(touches);
    for (int i = 0; i < count; ++i) {
      const double own_sd = random_.uniform() < 0.1 ? 5.0 : 1.0;
      const double z = std::hypot(own_sd, stranger_sd * (n - 1.0)) * random_.normal();
      fits[label].push_back(
          {{.z = scale.mean * std::sqrt(n) +
                 z * std::sqrt(scale.sd * scale.sd + n * scale.shared_sd * scale.shared_sd)},
           touches});
    }
  }

  Fits fits;

 private:
  Random random_{7, Stream::readings};
};

TEST(WithStrangers, FindsTheSdByWhichFitsWereDrawn) {
  for (const double truth : {1.5, 3.0, 6.0}) {
    Strangers strangers;
    for (const std::size_t label : {0U, 1U, 2U}) {
      strangers.add(label, 300, 3, truth);
      strangers.add(label, 100, 2, truth);
    }
    EXPECT_NEAR(sd_of(strangers.fits).value(), truth, 0.1 * truth);
  }
}

TEST(WithStrangers, FindsWhatSingleTouchesAreLike) {
  Random random(8, Stream::readings);
  for (const SingleFitScale& truth : {SingleFitScale{0.0, 1.0}, SingleFitScale{-6.0, 3.0}}) {
    Fits fits;
    const double spread = std::sqrt(scale.sd * scale.sd + scale.shared_sd * scale.shared_sd);
    for (const std::size_t label : {0U, 1U, 2U}) {
      for (int i = 0; i < 300; ++i) {
        const double z = truth.mean + truth.sd * random.normal();
        fits[label].push_back({{.z = scale.mean + spread * z}, 1});
      }
    }
    const FitScale found = with_strangers(fits, scale);
    ASSERT_TRUE(found.stranger_alone);
    EXPECT_NEAR(found.stranger_alone->mean, truth.mean, 0.5);
    EXPECT_NEAR(found.stranger_alone->sd, truth.sd, 0.15 * truth.sd);
    EXPECT_FALSE(found.stranger_sd) << "of single touches alone";
    fits.erase(2);
    EXPECT_FALSE(with_strangers(fits, scale).stranger_alone) << "of two objects";
  }
}

TEST(WithStrangers, OfFewerThanThreeObjectsIsNone) {
  Strangers strangers;
  strangers.add(0, 300, 3, 4.0);
  strangers.add(1, 300, 3, 4.0);
  EXPECT_FALSE(sd_of({}));
  EXPECT_FALSE(sd_of(strangers.fits));
  strangers.add(2, 4, 3, 4.0);
  strangers.add(2, 20, 1, 4.0);
  EXPECT_FALSE(sd_of(strangers.fits)) << "of four groups, and of single touches";
  strangers.add(2, 1, 3, 4.0);
  EXPECT_TRUE(sd_of(strangers.fits));
}

TEST(WithStrangers, CountsObjectsAlikeHoweverOftenTheyWereTouched) {
  Strangers alike;
  Strangers often;
  for (const std::size_t label : {0U, 1U, 2U}) {
    const double stranger_sd = label == 0 ? 2.0 : 8.0;
    alike.add(label, 200, 3, stranger_sd);
    often.add(label, label == 0 ? 4000 : 200, 3, stranger_sd);
  }
  const double expected = sd_of(alike.fits).value();
  EXPECT_NEAR(sd_of(often.fits).value(), expected, 0.15 * expected);
}

TEST(WithStrangers, StaysWithinAQuarterAndFourTimesPalpatesOwn) {
  Strangers alike;
  Strangers unlike;
  for (const std::size_t label : {0U, 1U, 2U}) {
    alike.add(label, 50, 3, 0.0);
    unlike.fits[label].assign(50, {{.z = -largest_fit_z}, 2});
  }
  EXPECT_EQ(sd_of(alike.fits), 1.0);
  EXPECT_NEAR(sd_of(unlike.fits).value(), 16.0, 1.0);
}

}  // namespace palpate::stranger_fit_test
