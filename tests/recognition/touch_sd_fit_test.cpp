#include "recognition/touch_sd_fit.hpp"

#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>
#include <utility>
#include <variant>

#include <gtest/gtest.h>

#include "letters.hpp"
#include "model/random.hpp"
#include "palpate/error.hpp"
#include "palpate/simulation.hpp"
#include "recognition/displacement_population.hpp"

namespace palpate::touch_sd_fit_test {

/// Touches of letters in turn, each reported beside where it was.
std::vector<Recording> misplaced_letters(int count, int touches, const DisplacementSd& sd) {
  constexpr std::array letters{"A", "E", "U"};
  std::vector<Recording> recordings;
  Random random(1, Stream::pose_noise);
  for (int i = 0; i < count; ++i) {
    recordings.push_back(letter_touches(letters[i % letters.size()], touches, 10 + i));
    for (Pose& pose : recordings.back().T_robot_sensor) {
      pose =
          pose * Pose{{sd.mm * random.normal(), sd.mm * random.normal()}, sd.rad * random.normal()};
    }
  }
  return recordings;
}

std::vector<TouchedObject> as_unknowns(const std::vector<Recording>& recordings) {
  std::vector<TouchedObject> unknowns;
  for (const Recording& recording : recordings) {
    unknowns.push_back({recording.path, recording.touches(0, recording.size())});
  }
  return unknowns;
}

RecognitionTask letter_task(Device& device, std::optional<BinWidth> width = BinWidth::automatic,
                            FilterOptions filter = HistogramOptions{}) {
  RecognitionTask task(learned_letters(device), std::move(filter));
  task.bin_width = width;
  return task;
}

TEST(TouchSdFit, FindsTheMisplacement) {
  Device device = Device::open();
  const std::vector<Recording> recordings = misplaced_letters(9, 8, {1.0, 0.05});
  for (const FilterOptions& filter :
       {FilterOptions(HistogramOptions{}), FilterOptions(BoundedOptions{})}) {
    const bool bounded = std::holds_alternative<BoundedOptions>(filter);
    SCOPED_TRACE(bounded ? "by bounds" : "by the histogram");
    double shown = 0.0;
    const TouchSdFit fit =
        fit_touch_sd(bounded ? nullptr : &device, letter_task(device, {}, filter),
                     as_unknowns(recordings), {.samples = 16, .sweeps = 10}, [&](double fraction) {
                       EXPECT_GE(fraction, shown);
                       EXPECT_LE(fraction, 1.0);
                       shown = fraction;
                     });
    // 72 touches tell the deviation of x and y within 7 %, of the angle within 23 %, one standard
    // error each; 50 unknowns of 12 touches were found within 3 and 7 %.
    EXPECT_NEAR(fit.sd.mm, 1.0, 0.2);
    EXPECT_NEAR(fit.sd.rad, 0.05, 0.03);
    EXPECT_GT(fit.standard_error.mm, 0.02);
    EXPECT_LT(fit.standard_error.mm, 0.15);
    EXPECT_GT(fit.evidence_gain, 50.0);  // hundreds in fact
    EXPECT_EQ(fit.unknowns, 9U);
    EXPECT_EQ(fit.touches, 72U);
  }
}

TEST(TouchSdFit, OfExactTouchesIsNextToNothing) {
  Device device = Device::open();
  const std::vector<Recording> recordings = misplaced_letters(4, 6, {});
  std::vector<TouchedObject> unknowns = as_unknowns(recordings);
  for (std::size_t i = 0; i < unknowns.size(); i += 2) {
    unknowns[i].label = recordings[i].truth->object;
  }
  const TouchSdFit fit =
      fit_touch_sd(&device, letter_task(device), unknowns, {.samples = 16, .sweeps = 10});
  EXPECT_LT(fit.sd.mm, 0.2);  // the maps' cells have 0.5 mm
  EXPECT_LT(fit.sd.rad, 0.03);
  EXPECT_DOUBLE_EQ(fit.resolution.mm, 0.15);  // of cells of 0.5 mm
  EXPECT_TRUE(fit.sd.mm == 0.0 || fit.sd.mm >= fit.resolution.mm) << fit.sd.mm;
  EXPECT_TRUE(fit.sd.rad == 0.0 || fit.sd.rad >= fit.resolution.rad) << fit.sd.rad;
  EXPECT_GE(fit.evidence_gain, 0.0);
  EXPECT_DOUBLE_EQ(fit.resolution.rad, 0.15 / array_reach_mm(digitacts_array()));
}

TEST(TouchSdFit, SaysWhereTouchesAreTooFew) {
  Device device = Device::open();
  const std::vector<Recording> recordings = misplaced_letters(2, 1, {});
  const TouchSdFit fit = fit_touch_sd(&device, letter_task(device), as_unknowns(recordings),
                                      {.samples = 8, .sweeps = 4});
  ASSERT_GE(fit.warnings.size(), 2U);
  EXPECT_NE(fit.warnings[0].find("2 of 2 unknowns have fewer than 3 touches"), std::string::npos);
  EXPECT_NE(fit.warnings[1].find("in one place only"), std::string::npos);
}

TEST(TouchSdFit, RefusesWhatItCannotFit) {
  Device device = Device::open();
  const RecognitionTask task = letter_task(device);
  const std::vector<Recording> recordings = misplaced_letters(1, 3, {});
  std::vector<TouchedObject> unknowns = as_unknowns(recordings);
  EXPECT_THROW(fit_touch_sd(&device, task, {}), Error);
  EXPECT_THROW(fit_touch_sd(&device, RecognitionTask(task.hypotheses, ParticleOptions{}), unknowns),
               Error);
  unknowns[0].label = "Q";
  EXPECT_THROW(fit_touch_sd(&device, task, unknowns), Error);
  unknowns[0] = {"empty", {}};
  EXPECT_THROW(fit_touch_sd(&device, task, unknowns), Error);
}

/// The log evidence of touches of one object at a known angle by sums over a fine lattice.
class DenseEvidence {
 public:
  static constexpr double step_mm = 0.25;
  static constexpr double reach_mm = 2.0;  // of the region, along x and y
  static constexpr double step_rad = 0.04;

  DenseEvidence(const std::vector<LivingElements>& touches, const SmoothOccupancy& map,
                const ReadingModel& readings) {
    for (const LivingElements& touch : touches) {
      std::vector<double>& likelihood = likelihood_.emplace_back();
      for (int a = -angles; a <= angles; ++a) {
        for (int y = -places; y <= places; ++y) {
          for (int x = -places; x <= places; ++x) {
            double nats = 0.0;
            map.sample(touch,
                       {touch.T_robot_sensor.translation_mm + step_mm * glm::dvec2(x, y),
                        touch.T_robot_sensor.theta_rad + step_rad * a},
                       [&](const LivingElements::Element& element, double occupancy) {
                         nats += readings.log_probability(element.reading, occupancy);
                       });
            likelihood.push_back(std::exp(nats));
          }
        }
      }
    }
  }

  double operator()(const DisplacementSd& sd) const {
    std::vector<double> product(static_cast<std::size_t>((2 * inside + 1) * (2 * inside + 1)), 1.0);
    for (const std::vector<double>& likelihood : likelihood_) {
      multiply_means(product, likelihood, sd);
    }
    return std::log(std::accumulate(product.begin(), product.end(), 0.0));
  }

 private:
  static constexpr int places = 24;
  static constexpr int angles = 10;
  static constexpr int side = 2 * places + 1;
  static constexpr auto inside = static_cast<int>(reach_mm / step_mm);

  /// The weights of displacements by -most to `most` steps.
  static std::vector<double> weights(int most, double sd_steps) {
    std::vector<double> weights;
    for (int i = -most; i <= most; ++i) {
      weights.push_back(std::exp(-0.5 * i * i / (sd_steps * sd_steps)));
    }
    const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
    for (double& weight : weights) {
      weight /= sum;
    }
    return weights;
  }

  /// Times the mean of one touch over its displacements, with the object at each place [y, x].
  static void multiply_means(std::vector<double>& product, const std::vector<double>& likelihood,
                             const DisplacementSd& sd) {
    constexpr int most = places - inside;
    const std::vector<double> of_angle = weights(angles, sd.rad / step_rad);
    const std::vector<double> of_place = weights(most, sd.mm / step_mm);
    std::vector<double> plane(static_cast<std::size_t>(side * side));  // the mean over the angles
    for (std::size_t i = 0; i < likelihood.size(); ++i) {
      plane[i % plane.size()] += of_angle[i / plane.size()] * likelihood[i];
    }
    for (int k = 0; k < static_cast<int>(product.size()); ++k) {
      const int y = k / (2 * inside + 1);
      const int x = k % (2 * inside + 1);
      double sum = 0.0;
      for (int j = 0; j <= 2 * most; ++j) {
        for (int i = 0; i <= 2 * most; ++i) {
          sum += of_place[j] * of_place[i] * plane[(y + j) * side + x + i];
        }
      }
      product[k] *= sum;
    }
  }

  std::vector<std::vector<double>> likelihood_;  ///< [touch][angle, y, x]
};

TEST(DisplacementPopulation, FollowsTheEvidenceOfDenseSums) {
  Device device = Device::open();
  const OccupancyGrid map = learned_map(device, "E", 1);
  ContactModel contact;
  contact.prior = map.prior;
  // The touches lie 1 mm beside where they are reported.
  const std::vector<Pose> truth{{{-3.0, 4.0}, 0.0}, {{4.0, -6.0}, 1.5}, {{0.0, 8.0}, 0.7}};
  Recording recording = Simulator(make_shape("E"), {}, digitacts_array(), 3).touch(truth, Pose{});
  recording.T_robot_sensor[0].translation_mm += glm::dvec2(0.9, -0.4);
  recording.T_robot_sensor[1].translation_mm += glm::dvec2(-0.3, -1.0);
  recording.T_robot_sensor[2].theta_rad += 0.1;
  std::vector<LivingElements> touches;
  for (const Touch& touch : recording.touches(0, recording.size())) {
    touches.emplace_back(touch, contact);
  }
  const std::vector<SmoothOccupancy> maps{SmoothOccupancy(map, contact)};
  const ReadingModel readings(contact);
  const PoseLattice region{.x_mm = {-2.125, 2.125, 1},  // half a step beyond the outer places
                           .y_mm = {-2.125, 2.125, 1},
                           .theta_rad = {0.0, 0.0, 1}};
  const std::vector<PoseSample> starts(50, PoseSample{0, Pose{}});
  DisplacementPopulation population(touches, maps, readings, region, starts, 1);

  const DenseEvidence evidence(touches, maps[0], readings);
  const DisplacementSd sd{0.8, 0.1};
  population.move(sd, 100);
  const SdScore score = population.move(sd, 300);
  constexpr double part = 0.05;
  const auto at = [&](double mm, double rad) {
    return evidence({sd.mm * std::exp(mm), sd.rad * std::exp(rad)});
  };
  // 50 samples of 150 sweeps, of which about one in 15 counts, and scores that vary by 3 and 2.
  constexpr double noise = 0.3;
  EXPECT_NEAR(score.mean[0], (at(part, 0.0) - at(-part, 0.0)) / (2.0 * part), noise);
  EXPECT_NEAR(score.mean[1], (at(0.0, part) - at(0.0, -part)) / (2.0 * part), noise);
  const double middle = at(0.0, 0.0);
  EXPECT_NEAR(score.complete[0] - score.covariance[0],
              (2.0 * middle - at(part, 0.0) - at(-part, 0.0)) / (part * part), 3.0 * noise);
  EXPECT_NEAR(score.complete[1] - score.covariance[2],
              (2.0 * middle - at(0.0, part) - at(0.0, -part)) / (part * part), 3.0 * noise);

  // The weights' mean is the ratio of evidences; 50 samples, weights that vary by about 0.4.
  const DisplacementSd next{0.7, 0.09};
  EXPECT_NEAR(population.reweigh(sd, next), evidence(next) - middle, 0.2);
}

}  // namespace palpate::touch_sd_fit_test
