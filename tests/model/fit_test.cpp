#include "palpate/fit.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "model/displacement_points.hpp"
#include "palpate/error.hpp"
#include "reference/reference.hpp"
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
class SmallCase : public testing::Test {
 protected:
  SmallCase() { map_.log_odds.assign(9, static_cast<float>(std::log(3.0))); }

  std::optional<Fit> fit(const std::vector<double>& pressure) const {
    const std::vector<glm::dvec2> elements_mm(pressure.size(), {0.2, 0.1});
    const Touch touch{.elements_mm = elements_mm, .pressure = pressure};
    return fit_of(std::span(&touch, 1), Pose{}, map_, ContactModel{.gamma = 0.1});
  }

  OccupancyGrid map_{
      .label = "small", .origin_mm = {-0.5, -0.5}, .prior = 0.2, .nx = 3, .ny = 3, .log_odds = {}};
};

TEST_F(SmallCase, IsWhatOneComputesByHand) {
  constexpr double tolerance = 1e-6;  // of the map's float32
  const double sd = std::sqrt(49.0 * 139.0);
  const double contact = 49.0 / sd;
  const double none = -139.0 / sd;
  EXPECT_NEAR(fit({10.0})->z, contact, tolerance);
  EXPECT_NEAR(fit({10.0, 0.0})->z, (contact + none) / std::sqrt(2.0), tolerance);
  EXPECT_NEAR(fit({10.0, 0.0, 0.0, 0.0})->z, (contact + 3.0 * none) / 2.0, tolerance);
}

TEST_F(SmallCase, LeadsToAVerdict) {
  // One contact among n readings: z = (0.594 - (n - 1) 1.684) / sqrt(n).
  EXPECT_EQ(fit({10.0, 0.0, 0.0})->verdict, Verdict::fits) << "z = -1.60";
  EXPECT_EQ(fit({10.0, 0.0, 0.0, 0.0, 0.0, 0.0})->verdict, Verdict::doubtful) << "z = -3.20";
  EXPECT_EQ(fit(std::vector<double>{10.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0})->verdict,
            Verdict::does_not_fit)
      << "z = -4.60";
}

TEST_F(SmallCase, IsNoneWhereNothingIsKnown) {
  EXPECT_FALSE(fit({2.0, 2.0})) << "at the threshold";
  EXPECT_FALSE(fit({}));
  EXPECT_FALSE(fit_of({}, Pose{}, map_, ContactModel{}));
}

TEST_F(SmallCase, CutsOffWhatIsHeldToBeImpossible) {
  map_.log_odds.assign(9, 1000.0F);
  const std::vector<glm::dvec2> elements_mm(2, {0.0, 0.0});
  const ContactModel sure{.gamma = 0.0};
  const auto fit = [&](const std::vector<double>& pressure) {
    const Touch touch{.elements_mm = elements_mm, .pressure = pressure};
    return fit_of(std::span(&touch, 1), Pose{}, map_, sure);
  };
  EXPECT_EQ(fit({10.0, 10.0})->z, 0.0) << "nothing else is possible";
  EXPECT_EQ(fit({10.0, 0.0})->z, -largest_fit_z);
  EXPECT_EQ(fit({10.0, 0.0})->verdict, Verdict::does_not_fit);
}

TEST_F(SmallCase, RefusesWhatIsNotSound) {
  EXPECT_THROW(fit({10.0, HUGE_VAL}), Error);
  const std::vector<glm::dvec2> element(1, {0.0, 0.0});
  const std::vector<double> pressure(1, 10.0);
  const Touch touch{.elements_mm = element, .pressure = pressure};
  EXPECT_NO_THROW(fit_of(std::span(&touch, 1), Pose{}, map_, three_levels(2), 1));
  EXPECT_THROW(fit_of(std::span(&touch, 1), Pose{}, map_, three_levels(2), 2), Error);
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
  for (const double cell_mm : {0.3, 1.1}) {
    const OccupancyGrid map = random_map(33, 21, cell_mm, 8.0, 5);
    const Recording recording = random_recording(7, 65, 6);
    for (const ContactModel& model : models()) {
      for (const Pose& pose : {T_object_robot, Pose{{-4.0, 7.0}, -2.5}, Pose{{1e8, 0.0}, 0.0}}) {
        const auto touches = all_touches(recording);
        const std::optional<Fit> expected = reference::fit_of(touches, pose, map, model, 2);
        const std::optional<Fit> actual = fit_of(touches, pose, map, model, 2);
        ASSERT_TRUE(actual && expected);
        // Both are float64; the sum over 455 elements may be near 0.
        EXPECT_NEAR(actual->z, expected->z, 1e-9 * std::max(1.0, std::abs(expected->z)));
        EXPECT_EQ(actual->verdict, expected->verdict);
      }
    }
  }
}

TEST(Fit, IsTheSameInAMovedRobotFrame) {
  const OccupancyGrid map = random_map(33, 21, 0.5, 8.0, 7);
  const Recording recording = random_recording(5, 36, 8);
  const Pose T_moved_robot{{12.0, -31.0}, 2.1};
  const Recording elsewhere = moved(recording, T_moved_robot);
  for (const ContactModel& model : models()) {
    EXPECT_NEAR(
        fit_of(all_touches(recording), T_object_robot, map, model)->z,
        fit_of(all_touches(elsewhere), T_object_robot * inverse(T_moved_robot), map, model)->z,
        1e-9)
        << "rounding of places some 30 mm away";
  }
}

TEST(Fit, IsUnchangedByAnUnknownTouch) {
  const OccupancyGrid map = random_map(33, 21, 0.5, 8.0, 9);
  Recording recording = random_recording(3, 36, 10);
  const std::optional<Fit> without =
      fit_of(recording.touches(0, 2), T_object_robot, map, ContactModel{});
  std::fill(recording.pressure.begin() + 2 * 36, recording.pressure.end(), 2.0);
  const std::optional<Fit> with =
      fit_of(all_touches(recording), T_object_robot, map, ContactModel{});
  EXPECT_EQ(with->z, without->z);
  EXPECT_EQ(with->verdict, without->verdict);
}

/// A touch whose readings are drawn from what the map at the pose predicts.
Recording drawn_touch(const OccupancyGrid& map, const ContactModel& model, Uniform& random) {
  constexpr double no_contact = -20.0;  // No Contact also where no element is in contact
  constexpr double of_level[] = {no_contact, 7.0, 10.0, 13.0};
  const std::size_t levels = model.table ? model.table->levels() : 2;
  Recording recording{
      .T_robot_sensor = {{{random(-9.0, 9.0), random(-9.0, 9.0)}, random(0.0, two_pi)}},
      .elements_mm = digitacts_array()};
  const Pose T_object_sensor = T_object_robot * recording.T_robot_sensor[0];
  for (const glm::dvec2& element : recording.elements_mm) {
    const MapSample sample{reference::interpolate(map, *model.prior, T_object_sensor * element)};
    std::vector<double> sums;
    double sum = 0.0;
    for (std::size_t level = 0; level < levels; ++level) {
      sum += std::exp(reference::log_likelihood(static_cast<Reading>(level), sample, model));
      sums.push_back(sum);
    }
    const auto level = std::upper_bound(sums.begin(), sums.end(), random(0.0, sum));
    recording.pressure.push_back(of_level[level - sums.begin()]);
  }
  return recording;
}

TEST(Fit, OfTouchesAsPredictedHasMeanZeroAndVarianceOne) {
  constexpr int draws = 4000;
  OccupancyGrid doubtful = map_of(on_letter_l, "L");
  OccupancyGrid sure = doubtful;
  for (float& l : sure.log_odds) {
    l *= 5.0F;
  }
  ContactModel levels = three_levels(1);
  levels.prior = sure.prior;
  const ContactModel eq7{.gamma = 0.1, .prior = sure.prior};
  Uniform random(11);
  for (const auto& [map, model] :
       {std::pair(doubtful, eq7), std::pair(sure, eq7), std::pair(sure, levels)}) {
    double sum = 0.0;
    double squares = 0.0;
    int fitting = 0;
    int not_fitting = 0;
    int false_alarms = 0;
    int grave_ones = 0;
    for (int i = 0; i < draws; ++i) {
      const Recording touch = drawn_touch(map, model, random);
      const Fit fit = fit_of(all_touches(touch), T_object_robot, map, model).value();
      sum += fit.z;
      squares += fit.z * fit.z;
      fitting += fit.verdict == Verdict::fits ? 1 : 0;
      not_fitting += fit.verdict == Verdict::does_not_fit ? 1 : 0;
      false_alarms += fit.z < scaled_fits_from_z ? 1 : 0;
      grave_ones += fit.z < scaled_doubtful_from_z ? 1 : 0;
    }
    // Four standard errors: 1 / sqrt(n) of the mean; of the variance at most 2 / sqrt(n), for a
    // kurtosis of 5, which one surprise among 36 elements has.
    EXPECT_NEAR(sum / draws, 0.0, 4.0 / std::sqrt(draws));
    EXPECT_NEAR(squares / draws, 1.0, 8.0 / std::sqrt(draws));
    // What the header promises, less three standard errors.
    EXPECT_GE(fitting, (0.98 - 0.007) * draws);
    EXPECT_LE(not_fitting, (0.005 + 0.0034) * draws);
    // The limits on a scale: 1 % and 0.1 %, and three standard errors.
    EXPECT_LE(false_alarms, (0.01 + 0.0047) * draws);
    EXPECT_LE(grave_ones, (0.001 + 0.0015) * draws);
  }
}

constexpr DisplacementSd usual_sd{.mm = 1.0, .rad = 0.05};

TEST(DisplacedFit, WithoutADisplacementIsThePlainOne) {
  const OccupancyGrid map = random_map(33, 21, 0.5, 8.0, 12);
  const Recording recording = random_recording(4, 36, 13);
  for (const ContactModel& model : models()) {
    EXPECT_EQ(fit_of(all_touches(recording), T_object_robot, map, model, DisplacementSd{}, 2)->z,
              fit_of(all_touches(recording), T_object_robot, map, model, 2)->z);
  }
}

TEST(DisplacedFit, IsThePlainOneWhereItIsTooSmallToMatter) {
  const OccupancyGrid map = map_of(on_letter_l, "L");
  const Recording recording = random_recording(4, 36, 14);
  const double plain = fit_of(all_touches(recording), T_object_robot, map, ContactModel{})->z;
  const double displaced = fit_of(all_touches(recording), T_object_robot, map, ContactModel{},
                                  DisplacementSd{.mm = 1e-6, .rad = 1e-7})
                               ->z;
  // The log odds change by up to 12 nats/mm; the control variate takes all other chance away.
  EXPECT_NEAR(displaced, plain, 1e-3);
}

TEST(DisplacedFit, IsTheReferences) {
  const OccupancyGrid map = map_of(on_letter_l, "L");
  for (const ContactModel& model :
       {ContactModel{.gamma = 0.0}, ContactModel{.gamma = 0.1}, three_levels(3)}) {
    for (const DisplacementSd& sd :
         {usual_sd, DisplacementSd{.mm = 2.0}, DisplacementSd{.rad = 0.3}}) {
      double squares = 0.0;
      int compared = 0;
      for (const std::uint64_t seed : {15U, 16U}) {
        const Recording recording = random_recording(3, 6, seed);
        const auto touches = all_touches(recording);
        const std::optional<Fit> expected =
            reference::fit_of(touches, T_object_robot, map, model, sd, 2);
        const std::optional<Fit> actual = fit_of(touches, T_object_robot, map, model, sd, 2);
        ASSERT_TRUE(actual && expected);
        // z is out by about 1 / sqrt(64) by chance in M, and by a tenth of itself by chance in V.
        const double out = (actual->z - expected->z) / std::hypot(0.125, 0.1 * expected->z);
        EXPECT_LT(std::abs(out), 4.0) << expected->z << ' ' << actual->z;
        squares += out * out;
        ++compared;
      }
      EXPECT_LT(squares / compared, 4.0) << "two standard errors on average";
    }
  }
}

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
  // As for the plain fit; the chance in M and V of every touch adds less than a tenth.
  EXPECT_NEAR(sum / draws, 0.0, 4.5 / std::sqrt(draws));
  EXPECT_NEAR(squares / draws, 1.0, 9.0 / std::sqrt(draws));
  EXPECT_GE(fitting, (0.98 - 0.018) * draws) << "three standard errors less";
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
}

TEST(FitScale, OfOneTouchIsThatOfTouchesWhereTheyFitBest) {
  const FitScale scale{.mean = 1.0, .sd = 2.0, .shared_sd = 1.0, .alone = SingleFitScale{1.5, 0.5}};
  EXPECT_EQ(scale.of({.z = 0.5}, 1).z, -2.0);
  // What the search for the pose gained is shared by more and more deviations.
  EXPECT_DOUBLE_EQ(scale.of({.z = 2.0 + 0.5 / 2.0}, 4).z, 0.0);
  EXPECT_DOUBLE_EQ(scale.of({.z = 3.0 + 0.5 / 3.0 - std::sqrt(13.0)}, 9).z, -1.0);
}

TEST(FitScale, GoesByTheNumberAndTheSpacingOfElements) {
  const FitScale scale{.mean = 1.0,
                       .sd = 2.0,
                       .shared_sd = 0.5,
                       .alone = SingleFitScale{1.5, 0.5},
                       .array = FitArray{.elements = 36.0, .spacing_mm = 2.0}};
  const FitScale dense = scale.for_array({.elements = 4.0 * 36.0, .spacing_mm = 1.0});
  EXPECT_EQ(dense.mean, 2.0);
  EXPECT_EQ(dense.sd, 4.0);
  EXPECT_EQ(dense.shared_sd, 1.0);
  EXPECT_EQ(dense.alone->mean, 3.0);
  EXPECT_EQ(dense.alone->sd, 1.0);
  const FitScale sparse = scale.for_array({.elements = 9.0, .spacing_mm = 4.0});
  EXPECT_EQ(sparse.mean, 0.5);
  EXPECT_EQ(sparse.sd, 2.0) << "elements further apart share no less than the others";
  EXPECT_EQ(scale.for_array(*scale.array).of({.z = 5.0}, 4).z, scale.of({.z = 5.0}, 4).z);
  EXPECT_EQ(FitScale{.mean = 3.0}.for_array({.elements = 9.0, .spacing_mm = 4.0}).mean, 3.0)
      << "of any array";
}

TEST(FitScale, OfMeanZeroAndSdOneChangesNothing) {
  for (const Fit fit : {Fit{.z = -2.9}, Fit{.z = -3.2, .verdict = Verdict::doubtful},
                        Fit{.z = -4.2, .verdict = Verdict::does_not_fit}}) {
    EXPECT_EQ(FitScale{}.of(fit, 9).z, fit.z);
    EXPECT_EQ(FitScale{}.of(fit, 9).verdict, fit.verdict);
  }
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
