#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "palpate/pose_histogram.hpp"
#include "support/synthetic.hpp"

namespace palpate::likelihood_parity_test {

// As steep as maps of some hundred touches are from cell to cell.
constexpr double steepness = 12.0;

PoseLattice small_lattice() {
  return {.x_mm = {-5.0, 6.0, 7}, .y_mm = {-7.0, 4.0, 5}, .theta_rad = {0.0, two_pi, 3}};
}

/// Largest error in nats per touch of one histogram over these maps and touches.
double error_per_touch(Device& device, const std::vector<OccupancyGrid>& maps,
                       const HistogramOptions& options, const Recording& recording) {
  std::vector<Hypothesis> hypotheses;
  for (const OccupancyGrid& map : maps) {
    hypotheses.push_back({map, 1.0});
  }
  PoseHistogram histogram(device, hypotheses, options);
  const std::vector<Touch> touches = all_touches(recording);
  histogram.update(touches);
  return likelihood_error(histogram, reference_posterior(hypotheses, options, touches)) /
         static_cast<double>(touches.size());
}

double error_per_touch(const std::vector<OccupancyGrid>& maps, const HistogramOptions& options,
                       const Recording& recording) {
  Device device = Device::open();
  return error_per_touch(device, maps, options, recording);
}

class BinsAlongOneAxis : public testing::TestWithParam<int> {};

TEST_P(BinsAlongOneAxis, Agree) {
  const OccupancyGrid map = random_map(31, 27, 0.5, steepness, 41);
  const Recording recording = random_recording(2, 36, 42);
  for (Axis PoseLattice::*axis :
       {&PoseLattice::x_mm, &PoseLattice::y_mm, &PoseLattice::theta_rad}) {
    HistogramOptions options;
    options.lattice = small_lattice();
    (options.lattice.*axis).count = GetParam();
    EXPECT_LT(error_per_touch({map}, options, recording), per_touch);
  }
}

INSTANTIATE_TEST_SUITE_P(Bins, BinsAlongOneAxis, testing::Values(1, 7, 63, 65, 1000));

class CellsAlongOneAxis : public testing::TestWithParam<int> {};

TEST_P(CellsAlongOneAxis, Agree) {
  const Recording recording = random_recording(2, 36, 43);
  HistogramOptions options;
  options.lattice = small_lattice();
  const std::vector<OccupancyGrid> maps{
      random_map(GetParam(), 1, 0.5, steepness, 44), random_map(1, GetParam(), 0.5, steepness, 45),
      random_map(GetParam(), 3, 0.1, steepness, 46), random_map(3, GetParam(), 2.0, steepness, 47)};
  EXPECT_LT(error_per_touch(maps, options, recording), per_touch);
}

INSTANTIATE_TEST_SUITE_P(Cells, CellsAlongOneAxis, testing::Values(1, 7, 63, 65, 1000));

class Elements : public testing::TestWithParam<std::size_t> {};

TEST_P(Elements, Agree) {
  const OccupancyGrid map = random_map(31, 27, 0.5, steepness, 48);
  HistogramOptions options;
  options.lattice = small_lattice();
  // The tolerance is for arrays of 36; errors of that many elements and more add up.
  const double arrays = std::max(1.0, static_cast<double>(GetParam()) / 36.0);
  EXPECT_LT(error_per_touch({map}, options, random_recording(3, GetParam(), GetParam())),
            per_touch * arrays);
}

INSTANTIATE_TEST_SUITE_P(Numbers, Elements, testing::Values(0, 1, 7, 36, 37, 63, 65, 256, 1400));

TEST(Likelihood, AgreesForMapsOfDifferentCellsInOneHistogram) {
  const std::vector<OccupancyGrid> maps{
      random_map(31, 27, 0.5, steepness, 51), random_map(20, 20, 1.0, steepness, 52),
      random_map(9, 33, 0.5, steepness, 53), random_map(60, 60, 0.3, steepness, 54)};
  HistogramOptions options;
  options.lattice = small_lattice();
  EXPECT_LT(error_per_touch(maps, options, random_recording(2, 36, 55)), per_touch);
}

TEST(Likelihood, AgreesForEveryGammaAndPrior) {
  const OccupancyGrid map = random_map(31, 27, 0.5, steepness, 56);
  const Recording recording = random_recording(2, 36, 57);
  Device device = Device::open();
  for (const double gamma : {0.0, 1e-40, 1e-9, 0.01, 0.9}) {
    for (const double prior : {0.01, 0.8}) {
      HistogramOptions options;
      options.lattice = small_lattice();
      options.contact.gamma = gamma;
      options.contact.prior = prior;
      EXPECT_LT(error_per_touch(device, {map}, options, recording), per_touch)
          << "gamma " << gamma << ", prior " << prior;
    }
  }
}

TEST(Likelihood, AgreesForAnArrayThatChangesAndHasDeadElements) {
  Recording recording = random_recording(5, 36, 58);
  Uniform random(59);
  recording.elements_mm.clear();
  for (std::size_t i = 0; i < recording.pressure.size(); ++i) {
    recording.elements_mm.emplace_back(random(-6.0, 6.0), random(-6.0, 6.0));
    recording.valid.push_back(random(0.0, 1.0) < 0.8 ? 1 : 0);
    if (recording.valid.back() == 0) {
      recording.pressure[i] = 1e6;
    }
  }
  HistogramOptions options;
  options.lattice = small_lattice();
  EXPECT_LT(error_per_touch({random_map(31, 27, 0.5, steepness, 60)}, options, recording),
            per_touch);
}

TEST(Likelihood, AgreesOverPartOfTheCircleAndAFixedDimension) {
  const OccupancyGrid map = random_map(31, 27, 0.5, steepness, 61);
  HistogramOptions options;
  options.lattice = {.x_mm = {2.5, 2.5, 1},
                     .y_mm = {-7.0, 4.0, 21},
                     .theta_rad = {-0.4, 1.1, 13},
                     .pivot_mm = {3.0, -2.0}};
  EXPECT_LT(error_per_touch({map}, options, random_recording(2, 36, 62)), per_touch);
}

TEST(Likelihood, OfTouchesOffTheMapIsThePriors) {
  const OccupancyGrid map = random_map(31, 27, 0.5, steepness, 63);
  HistogramOptions options;
  options.lattice = small_lattice();
  for (const double away_mm : {40.0, 1e4, 1e9, 1e30}) {
    const Recording recording = moved(random_recording(2, 36, 64), {{away_mm, -away_mm}, 0.0});
    Device device = Device::open();
    const Hypothesis hypothesis{map, 1.0};
    PoseHistogram histogram(device, std::span(&hypothesis, 1), options);
    double expected = 0.0;
    for (const Touch& touch : all_touches(recording)) {
      for (const ElementReading& element : known_readings(touch, {})) {
        expected +=
            reference::log_likelihood(element.reading, {std::log(0.2 / 0.8)}, {.prior = 0.2});
      }
    }
    histogram.update(all_touches(recording));
    for (const double l : histogram.log_likelihood(0)) {
      ASSERT_NEAR(l, expected, 2.0 * per_touch) << away_mm << " mm away, two touches";
    }
  }
}

}  // namespace palpate::likelihood_parity_test
