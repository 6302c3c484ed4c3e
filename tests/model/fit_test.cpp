#include "palpate/fit.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "model/displacement_points.hpp"
#include "reference/reference.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"
#include "support/touched_shape.hpp"

namespace palpate::fit_test {

constexpr Pose T_object_robot{{1.5, -0.8}, 0.7};

/// Three levels of contact, at pressures of 7, 10 and 13, whose probabilities follow the log odds.
/// The rows of each object's numbers have no sum in particular.
ContactModel three_levels(std::size_t objects) {
  LikelihoodTable table{.nodes = 17, .level_edges = {8.0, 12.0}, .log_likelihood = {}};
  Uniform random(31);
  for (std::size_t row = 0; row < objects * table.levels(); ++row) {
    const double slope = row % table.levels() == 0 ? -0.3 : 0.2;
    for (std::size_t node = 0; node < table.nodes; ++node) {
      table.log_likelihood.push_back(slope * static_cast<double>(node) - random(1.0, 3.0));
    }
  }
  return {.table = std::move(table)};
}

// By hand: a map of log odds log 3 everywhere, so p = 3/4. By Eq. 7 with m = 1/5, contact has the
// likelihood 0.02 + 0.9 * 3/4 = 0.695 and no contact 0.02 + 0.9 / 4 = 0.245. They predict contact
// with q = 0.695 / 0.94 = 139/188 = 1 - 49/188. In units of D = log(0.695 / 0.245), contact is
// 49/188 above the mean, no contact 139/188 below it, and the variance is 49 * 139 / 188^2.
class FitByHand : public testing::Test {
 protected:
  FitByHand() { map_.log_odds.assign(9, static_cast<float>(std::log(3.0))); }

  std::optional<Fit> fit(const std::vector<double>& pressure,
                         const ContactModel& model = {.gamma = 0.1}, std::size_t object = 0) const {
    const std::vector<glm::dvec2> elements_mm(pressure.size(), {0.2, 0.1});
    const Touch touch{.elements_mm = elements_mm, .pressure = pressure};
    return fit_of(std::span(&touch, 1), Pose{}, map_, model, {}, object);
  }

  OccupancyGrid map_{
      .label = "small", .origin_mm = {-0.5, -0.5}, .prior = 0.2, .nx = 3, .ny = 3, .log_odds = {}};
};

TEST_F(FitByHand, HasTheZAndTheVerdictThatOneComputesByHand) {
  const double sd = std::sqrt(49.0 * 139.0);
  EXPECT_NEAR(fit({10.0})->z, 49.0 / sd, 1e-6) << "of the map's float32";
  // One contact among n readings.
  for (const auto& [n, verdict] : {std::pair(3, Verdict::fits),  // z = -1.60, -3.20 and -4.60
                                   {6, Verdict::doubtful},
                                   {10, Verdict::does_not_fit}}) {
    std::vector<double> pressure(static_cast<std::size_t>(n), 0.0);
    pressure[0] = 10.0;
    EXPECT_NEAR(fit(pressure)->z, (49.0 - 139.0 * (n - 1)) / (sd * std::sqrt(n)), 1e-5);
    EXPECT_EQ(fit(pressure)->verdict, verdict) << n;
  }
}

TEST_F(FitByHand, IsNoneWhereNothingIsKnown) {
  EXPECT_FALSE(fit({2.0, 2.0})) << "at the threshold";
  EXPECT_FALSE(fit({}));
  EXPECT_FALSE(fit_of({}, Pose{}, map_, ContactModel{}));
}

TEST_F(FitByHand, CutsOffWhatIsHeldToBeImpossible) {
  map_.log_odds.assign(9, 1000.0F);
  EXPECT_EQ(fit({10.0, 10.0}, {.gamma = 0.0})->z, 0.0) << "nothing else is possible";
  EXPECT_EQ(fit({10.0, 0.0}, {.gamma = 0.0})->z, -largest_fit_z);
  EXPECT_EQ(fit({10.0, 0.0}, {.gamma = 0.0})->verdict, Verdict::does_not_fit);
}

TEST_F(FitByHand, RefusesWhatIsNotSound) {
  input_error([&] { fit({10.0, infinity}); });
  EXPECT_NO_THROW(fit({10.0}, three_levels(2), 1));
  input_error([&] { fit({10.0}, three_levels(2), 2); });
  input_error([&] { fit({10.0}, {.gamma = nan}); });
  input_error([&] { fit_of({}, {{nan, 0.0}, 0.0}, map_, {}); });
  input_error([&] { fit_of({}, {}, map_, {}, {.mm = -1.0}); });
}

/// Contact models of every kind.
std::vector<ContactModel> models() {
  return {{.gamma = 0.0},
          {.gamma = 0.1},
          {.gamma = 0.5, .prior = 0.07},
          three_levels(1),
          three_levels(3)};
}

TEST(Fit, IsTheReferences) {
  const Recording recording = random_recording(7, 65, 6);
  for (const double cell_mm : {0.3, 1.1}) {
    const OccupancyGrid map = random_map(33, 21, cell_mm, 8.0, 5);
    for (const ContactModel& model : models()) {
      for (const Pose& pose : {T_object_robot, Pose{{-4.0, 7.0}, -2.5}, Pose{{1e8, 0.0}, 0.0}}) {
        const auto touches = all_touches(recording);
        const std::optional<Fit> expected = reference::fit_of(touches, pose, map, model, 2);
        const std::optional<Fit> actual = fit_of(touches, pose, map, model, {}, 2);
        ASSERT_TRUE(actual && expected);
        // Both are float64; the sum over 455 elements may be near 0.
        EXPECT_NEAR(actual->z, expected->z, 1e-9 * std::max(1.0, std::abs(expected->z)));
        EXPECT_EQ(actual->verdict, expected->verdict);
      }
    }
  }
}

constexpr DisplacementSd usual_sd{.mm = 1.0, .rad = 0.05};

TEST(DisplacedFit, IsTheReferences) {
  const OccupancyGrid map = map_of(on_letter_l, "L");
  for (const ContactModel& model :
       {ContactModel{.gamma = 0.0}, ContactModel{.gamma = 0.1}, three_levels(3)}) {
    for (const DisplacementSd& sd :
         {usual_sd, DisplacementSd{.mm = 2.0}, DisplacementSd{.rad = 0.3}}) {
      double squares = 0.0;
      for (const std::uint64_t seed : {15U, 16U}) {
        const Recording recording = random_recording(3, 6, seed);
        const auto touches = all_touches(recording);
        const std::optional<Fit> expected =
            reference::fit_of(touches, T_object_robot, map, model, sd, 2);
        const std::optional<Fit> actual = fit_of(touches, T_object_robot, map, model, sd, 2);
        ASSERT_TRUE(actual && expected);
        const std::vector reversed(touches.rbegin(), touches.rend());
        EXPECT_NEAR(fit_of(reversed, T_object_robot, map, model, sd, 2)->z, actual->z, 1e-9);
        // z is out by about 1 / sqrt(64) by chance in M, and by a tenth of itself by chance in V.
        const double out = (actual->z - expected->z) / std::hypot(0.125, 0.1 * expected->z);
        EXPECT_LT(std::abs(out), 4.0) << expected->z << ' ' << actual->z;
        squares += out * out;
      }
      EXPECT_LT(squares / 2.0, 4.0) << "two standard errors on average";
    }
  }
}

/// A touch whose readings are drawn from what the map at the pose predicts by Eq. 7.
Recording drawn_touch(const OccupancyGrid& map, const ContactModel& model, Uniform& random) {
  Recording recording{
      .T_robot_sensor = {{{random(-9.0, 9.0), random(-9.0, 9.0)}, random(0.0, two_pi)}},
      .elements_mm = digitacts_array()};
  const Pose T_object_sensor = T_object_robot * recording.T_robot_sensor[0];
  for (const glm::dvec2& element : recording.elements_mm) {
    const MapSample sample{reference::interpolate(map, *model.prior, T_object_sensor * element)};
    const double in = std::exp(reference::log_likelihood(Reading::in_contact, sample, model));
    const double no = std::exp(reference::log_likelihood(Reading::no_contact, sample, model));
    // No Contact also where no element is in contact.
    recording.pressure.push_back(random(0.0, in + no) < in ? 7.0 : -20.0);
  }
  return recording;
}

// A bias that is too small to be seen beside the chance of one touch.
TEST(DisplacedFit, OfTouchesAsPredictedHasMeanZeroAndVarianceOne) {
  constexpr int draws = 600;
  const OccupancyGrid map = map_of(on_letter_l, "L");
  const ContactModel model{.gamma = 0.1, .prior = map.prior};
  Uniform random(19);
  Random displacements(20, Stream::pose_noise);
  double sum = 0.0;
  double squares = 0.0;
  int fitting = 0;
  double plain_sum = 0.0;
  for (int i = 0; i < draws; ++i) {
    Recording touch = drawn_touch(map, model, random);
    // The sensor reports another place than it was at.
    touch.T_robot_sensor[0] =
        touch.T_robot_sensor[0] * inverse(random_displacement(usual_sd, displacements));
    const Fit fit = fit_of(all_touches(touch), T_object_robot, map, model, usual_sd).value();
    sum += fit.z;
    squares += fit.z * fit.z;
    fitting += fit.verdict == Verdict::fits ? 1 : 0;
    plain_sum += fit_of(all_touches(touch), T_object_robot, map, model)->z;
  }
  // Four standard errors: 1 / sqrt(n) of the mean; of the variance at most 2 / sqrt(n), for a
  // kurtosis of 5. The chance in M and V of every touch adds less than a tenth.
  EXPECT_NEAR(sum / draws, 0.0, 4.5 / std::sqrt(draws));
  EXPECT_NEAR(squares / draws, 1.0, 9.0 / std::sqrt(draws));
  EXPECT_GE(fitting, (0.98 - 0.018) * draws) << "what the header promises, less three errors";
  EXPECT_LT(plain_sum / draws, -1.0) << "as if exact, such touches fit worse";
}

TEST(FitScale, IsWhatTouchesOfTheirOwnObjectShow) {
  const FitScale scale{.mean = -6.0, .sd = 4.0};
  EXPECT_EQ(scale.of({.z = -6.0}, 1).z, 0.0);
  EXPECT_EQ(scale.of({.z = -14.0}, 1).z, -2.0);
  EXPECT_EQ(scale.of({.z = -14.0, .verdict = Verdict::does_not_fit}, 1).verdict, Verdict::fits);
  EXPECT_EQ(scale.of({.z = -20.0}, 1).verdict, Verdict::fits);
  EXPECT_EQ(scale.of({.z = -20.5}, 1).verdict, Verdict::doubtful);
  EXPECT_EQ(scale.of({.z = -26.5}, 1).verdict, Verdict::does_not_fit);
  EXPECT_EQ(scale.of({.z = -20.0}, 4).z, -2.0) << "four touches are 2 times 6 below 0";
  const FitScale shared{.mean = -6.0, .sd = 3.0, .shared_sd = 2.0};
  EXPECT_EQ(shared.of({.z = -17.0}, 4).z, -1.0) << "variances of 9 and 4 times 4";
  for (const Fit fit : {Fit{.z = -2.9}, Fit{.z = -3.2, .verdict = Verdict::doubtful},
                        Fit{.z = -4.2, .verdict = Verdict::does_not_fit}}) {
    EXPECT_EQ(FitScale{}.of(fit, 9).z, fit.z);
    EXPECT_EQ(FitScale{}.of(fit, 9).verdict, fit.verdict) << "of mean 0 and sd 1";
  }
}

TEST(FitScale, OfOneTouchIsThatOfTouchesWhereTheyFitBest) {
  const FitScale scale{
      .mean = 1.0, .sd = 2.0, .shared_sd = 1.0, .single_touch = SingleFitScale{1.5, 0.5}};
  EXPECT_EQ(scale.of({.z = 0.5}, 1).z, -2.0);
  // What the search for the pose gained is shared by more and more deviations.
  EXPECT_DOUBLE_EQ(scale.of({.z = 2.0 + 0.5 / 2.0}, 4).z, 0.0);
  EXPECT_DOUBLE_EQ(scale.of({.z = 3.0 + 0.5 / 3.0 - std::sqrt(13.0)}, 9).z, -1.0);
}

TEST(FitScale, GoesByTheNumberAndTheSpacingOfElements) {
  const FitScale scale{.mean = 1.0,
                       .sd = 2.0,
                       .shared_sd = 0.5,
                       .single_touch = SingleFitScale{1.5, 0.5},
                       .array = FitArray{.elements = 36.0, .spacing_mm = 2.0}};
  const FitScale dense = scale.for_array({.elements = 4.0 * 36.0, .spacing_mm = 1.0});
  EXPECT_EQ(std::tie(dense.mean, dense.sd, dense.shared_sd), std::tuple(2.0, 4.0, 1.0));
  EXPECT_EQ(std::tie(dense.single_touch->mean, dense.single_touch->sd), std::tuple(3.0, 1.0));
  const FitScale sparse = scale.for_array({.elements = 9.0, .spacing_mm = 4.0});
  EXPECT_EQ(std::tie(sparse.mean, sparse.sd), std::tuple(0.5, 2.0)) << "share no less";
  EXPECT_EQ(FitScale{.mean = 3.0}.for_array({.elements = 9.0, .spacing_mm = 4.0}).mean, 3.0)
      << "of any array";
}

TEST(FitScale, ObjectsTogetherVaryAsTheirTouchesDo) {
  // With one touch of each object, z varies by 0.25 within the objects and by 0.25 between them.
  const std::vector<FitScale> objects{{.mean = 0.5, .sd = 0.5}, {.mean = 1.5, .sd = 0.5}};
  const FitScale all = pooled(objects);
  EXPECT_DOUBLE_EQ(all.mean, 1.0);
  EXPECT_DOUBLE_EQ(all.shared_sd, 0.5 * std::sqrt(0.5));
  EXPECT_DOUBLE_EQ(all.sd * all.sd + all.shared_sd * all.shared_sd, 0.5);
  const FitScale one = pooled(std::vector{FitScale{.mean = 0.9, .sd = 0.02}});
  EXPECT_EQ(one.sd, 0.25) << "as new places spread at least";
  EXPECT_EQ(one.shared_sd, 0.03);
}

}  // namespace palpate::fit_test
