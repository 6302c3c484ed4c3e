// A filter whose pivot moves before the first touch.

#include <limits>

#include <gtest/gtest.h>

#include "palpate/error.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/synthetic.hpp"

namespace palpate::moved_pivot_test {

const glm::dvec2 pivot_mm{400.0, 200.0};

const std::vector<Hypothesis>& objects() {
  static const std::vector<Hypothesis> two{{random_map(31, 27, 0.5, 12.0, 181), 1.0},
                                           {random_map(23, 29, 0.5, 12.0, 182), 1.0}};
  return two;
}

PoseLattice lattice_about(const glm::dvec2& pivot) {
  return {.x_mm = {-3.0, 3.0, 11},
          .y_mm = {-2.0, 2.0, 9},
          .theta_rad = {0.0, 3.0, 4},
          .pivot_mm = pivot};
}

/// Touches near the pivot, mostly No Contact.
Recording recording_near_pivot() {
  Recording recording = random_recording(3, 60, 183);
  recording.elements_mm.resize(60);
  recording.T_robot_sensor.assign(3, {pivot_mm + glm::dvec2(0.7, -0.4), 0.3});
  for (std::size_t i = 0; i < recording.pressure.size(); ++i) {
    recording.pressure[i] = i % 5 == 0 ? recording.pressure[i] : 0.0;
  }
  return recording;
}

template <typename Filter>
void expect_pivot_refused(Filter& filter, const glm::dvec2& pivot, const std::string& says) {
  try {
    filter.move_pivot(pivot);
    ADD_FAILURE() << "moved";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::input);
    EXPECT_NE(std::string(error.what()).find(says), std::string::npos) << error.what();
  }
}

class MovedPivot : public testing::Test {
 protected:
  static HistogramOptions options(const glm::dvec2& pivot) {
    return {.lattice = lattice_about(pivot)};
  }

  Device device = Device::open();
  Recording recording = recording_near_pivot();
  std::vector<Touch> touches = all_touches(recording);
};

TEST_F(MovedPivot, MakesAHistogramWhatItIsWithThePivotFromTheStart) {
  PoseHistogram moved(device, objects(), options({0.0, 0.0}));
  moved.update(touches);  // about another pivot, which nothing may be left of
  moved.reset();
  moved.move_pivot(pivot_mm);
  EXPECT_EQ(moved.lattice().pivot_mm, pivot_mm);
  moved.update(touches);
  PoseHistogram built(device, objects(), options(pivot_mm));
  built.update(touches);
  for (const int object : {0, 1}) {
    EXPECT_EQ(moved.log_likelihood(object), built.log_likelihood(object));
    EXPECT_EQ(moved.marginals(object).grid.pivot_mm, pivot_mm);
  }
  const Mode mode = moved.estimate().mode;
  EXPECT_EQ(mode.T_object_robot.translation_mm,
            built.estimate().mode.T_object_robot.translation_mm);
  EXPECT_EQ(moved.refine(mode).T_object_robot.translation_mm,
            built.refine(mode).T_object_robot.translation_mm);
  EXPECT_EQ(moved.refine(mode).covariance, built.refine(mode).covariance);
}

TEST_F(MovedPivot, StaysWhereItIsWhileThereAreTouchesAboutIt) {
  PoseHistogram histogram(device, objects(), options({1.0, 2.0}));
  histogram.update(touches[0]);
  const std::vector<double> before = histogram.log_likelihood(0);
  expect_pivot_refused(histogram, pivot_mm, "reset()");
  EXPECT_EQ(histogram.lattice().pivot_mm, glm::dvec2(1.0, 2.0));
  EXPECT_EQ(histogram.log_likelihood(0), before);
  histogram.reset();
  for (const double far : {std::numeric_limits<double>::quiet_NaN(), 2.0 * farthest_mm}) {
    expect_pivot_refused(histogram, {far, 0.0}, "pivot_mm");
  }
  EXPECT_EQ(histogram.lattice().pivot_mm, glm::dvec2(1.0, 2.0)) << "also over reset()";
}

TEST_F(MovedPivot, CarriesTheParticlesWithIt) {
  const auto options = [](const glm::dvec2& pivot) {
    return ParticleOptions{.particles = 500, .region = lattice_about(pivot), .seed = 3};
  };
  ParticleFilter moved(device, objects(), options({0.0, 0.0}));
  moved.update(all_touches(recording));
  expect_pivot_refused(moved, pivot_mm, "reset()");
  moved.reset();
  moved.move_pivot(pivot_mm);
  moved.update(all_touches(recording));
  ParticleFilter built(device, objects(), options(pivot_mm));
  built.update(all_touches(recording));
  const auto a = moved.particles();
  const auto b = built.particles();
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].T_object_robot.translation_mm, b[i].T_object_robot.translation_mm);
    EXPECT_EQ(a[i].weight, b[i].weight);
  }
}

}  // namespace palpate::moved_pivot_test
