#include "recognition/recogniser.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "palpate/error.hpp"
#include "recognition/filter.hpp"
#include "shapes.hpp"
#include "support/synthetic.hpp"

namespace palpate::recogniser_test {

void expect_same(const Estimate& actual, const Estimate& expected) {
  EXPECT_EQ(actual.identity, expected.identity);
  EXPECT_EQ(actual.mode.object, expected.mode.object);
  EXPECT_EQ(actual.mode.T_object_robot.translation_mm, expected.mode.T_object_robot.translation_mm);
  EXPECT_EQ(actual.mode.T_object_robot.theta_rad, expected.mode.T_object_robot.theta_rad);
}

Recogniser updated(const RecognitionTask& task, std::span<const Touch> touches) {
  Recogniser recogniser(shared_device(), task);
  recogniser.update(touches);
  return recogniser;
}

class RecogniserTells : public testing::Test {
 protected:
  /// Expects of the recogniser what the filter tells after the same touches.
  template <class Filter>
  void expect_told(const Recogniser& recogniser, Filter& filter) const {
    filter.update(touches_);
    expect_same(recogniser.estimate(), filter.estimate());
  }
  /// The same of a filter over bins.
  template <class Filter>
  void expect_told_of_bins(const Recogniser& recogniser, Filter& filter) const {
    expect_told(recogniser, filter);
    const Mode mode = filter.estimate().mode;
    const RefinedPose refined = recogniser.filter().refine(mode).value();
    EXPECT_EQ(refined.T_object_robot.theta_rad, filter.refine(mode).T_object_robot.theta_rad);
    EXPECT_EQ(refined.covariance, filter.refine(mode).covariance);
    EXPECT_EQ(recogniser.marginals(0).xy, filter.marginals(0).xy);
    EXPECT_EQ(recogniser.filter().sample(3, 1)[2].T_object_robot.translation_mm,
              filter.sample(3, 1)[2].T_object_robot.translation_mm);
    EXPECT_FALSE(recogniser.filter().effective_sample_size());
  }

  Recording recording_ = touched_letter(1);
  std::vector<Touch> touches_ = all_touches(recording_);
};

TEST_F(RecogniserTells, OfAHistogramWhatTheHistogramTells) {
  const auto options = std::get<HistogramOptions>(every_filter()[0]);
  const Recogniser recogniser = updated({shapes(), options}, touches_);
  PoseHistogram histogram(shared_device(), shapes(), options);
  expect_told_of_bins(recogniser, histogram);
  EXPECT_EQ(recogniser.filter().histogram()->log_likelihood(0), histogram.log_likelihood(0));
}

TEST_F(RecogniserTells, OfParticlesWhatTheParticlesTell) {
  const auto options = std::get<ParticleOptions>(every_filter()[1]);
  Recogniser recogniser(shared_device(), {shapes(), options});
  std::vector<double> fractions;
  recogniser.update(touches_, [&](double fraction) { fractions.push_back(fraction); });
  ParticleFilter particles(shared_device(), shapes(), options);
  expect_told(recogniser, particles);
  EXPECT_EQ(recogniser.filter().effective_sample_size(), particles.effective_sample_size());
  EXPECT_FALSE(recogniser.filter().refine(particles.estimate().mode));
  EXPECT_EQ(recogniser.filter().histogram(), nullptr);
  EXPECT_EQ(fractions.size(), 6U);
  EXPECT_EQ(fractions.back(), 1.0);
  for (const int object : {0, 1}) {
    std::vector<double> xy(400);
    std::vector<double> theta(16);
    for (const ParticleFilter::Particle& particle : particles.particles()) {
      const std::int64_t bin = options.region.bin_of(particle.T_object_robot);
      xy[bin % 400] += particle.object == object ? particle.weight : 0.0;
      theta[bin / 400] += particle.object == object ? particle.weight : 0.0;
    }
    EXPECT_EQ(recogniser.marginals(object).xy, xy);
    EXPECT_EQ(recogniser.marginals(object).theta, theta);
  }
}

TEST_F(RecogniserTells, OfBoundsWhatTheBoundedPosteriorTells) {
  const auto options = std::get<BoundedOptions>(every_filter()[2]);
  const Recogniser recogniser = updated({shapes(), options}, touches_);
  BoundedPosterior bounded(shapes(), options);
  expect_told_of_bins(recogniser, bounded);
  EXPECT_EQ(recogniser.filter().histogram(), nullptr);
  EXPECT_NE(recogniser.filter().words().front().find(bounded.path()), std::string::npos);
  EXPECT_EQ(recogniser.filter().device_bytes(), 0u);
}

/// The pivot is the array's centre at the first touch in contact, somewhere in a robot's reach.
class AutomaticPivot : public ByEveryFilter {
 protected:
  AutomaticPivot() {
    task_.auto_pivot = true;
    unsound_.pressure = unsound_.pressure.first(1);
  }

  static Recording far_letter(std::uint64_t seed) {
    return moved(touched_letter(seed), {{400.0, 200.0}, 0.7});
  }
  /// The task about this pivot.
  RecognitionTask about(const glm::dvec2& pivot_mm) const {
    PoseLattice lattice = task_.lattice();
    lattice.pivot_mm = pivot_mm;
    return {task_.hypotheses, with_lattice(task_.filter, lattice)};
  }
  /// The first touch at another place, all its elements out of contact but one, which is Unknown.
  Recording beside(const glm::dvec2& place_mm) const {
    Recording touch = recording_;
    std::fill_n(touch.pressure.begin(), touch.elements(), 0.0);
    touch.pressure[7] = 1.0;
    touch.T_robot_sensor[0].translation_mm = place_mm;
    return touch;
  }

  RecognitionTask task_{shapes(), filter()};
  Recording recording_ = far_letter(1);
  std::vector<Touch> touches_ = all_touches(recording_);
  glm::dvec2 first_mm_ = recording_.T_robot_sensor.front().translation_mm;
  Touch unsound_ = touches_[3];
};

TEST_P(AutomaticPivot, IsTheArraysCentreAtTheFirstTouchOfEachUnknown) {
  Recogniser automatic(shared_device(), task_);
  const Estimate untouched = automatic.estimate();
  expect_same(untouched, Recogniser(shared_device(), about({0.0, 0.0})).estimate());
  for (const std::uint64_t seed : {1, 4}) {
    Recording recording = far_letter(seed);
    // Of a sensor frame 100 mm beside the elements, such as the robot's flange.
    const Pose T_flange_sensor{{100.0, 30.0}, 0.5};
    for (Pose& pose : recording.T_robot_sensor) {
      pose = pose * inverse(T_flange_sensor);
    }
    for (glm::dvec2& element_mm : recording.elements_mm) {
      element_mm = T_flange_sensor * element_mm;
    }
    const glm::dvec2 centre_mm = recording.T_robot_sensor.front() * T_flange_sensor.translation_mm;
    automatic.reset();
    expect_same(automatic.estimate(), untouched);
    automatic.update(all_touches(recording));
    const glm::dvec2 pivot_mm = automatic.lattice().pivot_mm;
    EXPECT_LT(glm::distance(pivot_mm, centre_mm), 1e-9) << "but for rounding";
    EXPECT_EQ(automatic.marginals(0).grid.pivot_mm, pivot_mm);
    const Recogniser fixed = updated(about(pivot_mm), all_touches(recording));
    expect_same(automatic.estimate(), fixed.estimate());
    EXPECT_EQ(automatic.marginals(0).xy, fixed.marginals(0).xy);
  }
}

TEST_P(AutomaticPivot, IsNotPlacedByATouchThatIsRefused) {
  Recogniser recogniser(shared_device(), task_);
  Touch beyond = touches_[3];
  beyond.T_robot_sensor.translation_mm.x = 2.0 * farthest_mm;
  for (const Touch& refused : {unsound_, beyond}) {
    EXPECT_THROW(recogniser.update(std::span(&refused, 1)), Error);
  }
  recogniser.update(touches_);
  EXPECT_EQ(recogniser.lattice().pivot_mm, first_mm_);
}

TEST_P(AutomaticPivot, PassesOverTouchesWithoutContactButTakesThemIn) {
  Recogniser fixed(shared_device(), about(first_mm_));
  Recogniser together(shared_device(), task_);
  Recogniser one_by_one(shared_device(), task_);
  for (const double away_mm : {6.0, 60.0, 400.0}) {
    SCOPED_TRACE(away_mm);
    const Recording without_contact = beside(first_mm_ + glm::dvec2(0.0, away_mm));
    std::vector<Touch> touches = touches_;
    touches.insert(touches.begin(), 2, without_contact.touch(0));
    fixed.reset();
    fixed.update(touches);
    together.reset();
    const Estimate untouched = together.estimate();
    together.update(touches);
    expect_same(together.estimate(), fixed.estimate());
    EXPECT_EQ(together.lattice().pivot_mm, first_mm_);

    one_by_one.reset();
    for (std::size_t i = 0; i < touches.size(); ++i) {
      // The recogniser keeps copies: the caller's memory may go.
      std::vector<double> pressure(touches[i].pressure.begin(), touches[i].pressure.end());
      Touch copy = touches[i];
      copy.pressure = pressure;
      one_by_one.update(std::span(&copy, 1));
      std::fill(pressure.begin(), pressure.end(), 50.0);
      if (i < 2) {
        expect_same(one_by_one.estimate(), untouched);
      }
    }
    EXPECT_EQ(one_by_one.lattice().pivot_mm, first_mm_);
    EXPECT_EQ(one_by_one.estimate().mode.bin, together.estimate().mode.bin);
    // Evaluated ahead, a touch is added in one step: float32 rounds it by some 1e-5 nats.
    EXPECT_NEAR(one_by_one.estimate().identity[0], together.estimate().identity[0], 1e-4);
  }
}

TEST_P(AutomaticPivot, ForgetsTouchesThatWaitForItOnlyByAReset) {
  // Over the object, so that the touch without contact changes the belief.
  const Recording without_contact = beside(first_mm_);
  const Touch waits = without_contact.touch(0);
  const Estimate unwaited = updated(task_, touches_).estimate();
  Recogniser recogniser(shared_device(), task_);
  EXPECT_THROW(recogniser.update(std::vector{waits, unsound_}), Error);
  recogniser.update(touches_);
  expect_same(recogniser.estimate(), unwaited);

  recogniser.reset();
  recogniser.update(std::span(&waits, 1));
  EXPECT_THROW(recogniser.update(std::vector{touches_[0], unsound_}), Error);
  recogniser.update(touches_);
  // Bounds may drop all but one object, whatever the touches.
  const Estimate waited = recogniser.estimate();
  EXPECT_TRUE(waited.identity != unwaited.identity ||
              waited.mode.log_likelihood != unwaited.mode.log_likelihood);

  recogniser.reset();
  recogniser.update(std::span(&waits, 1));
  recogniser.reset();
  recogniser.update(touches_);
  expect_same(recogniser.estimate(), unwaited);
}

TEST_P(AutomaticPivot, WaitsForAResetAfterAnUpdateWasBrokenOff) {
  FilterOptions options = filter();
  if (auto* histogram = std::get_if<HistogramOptions>(&options)) {
    histogram->none_weight = 1.0;  // takes touch by touch, and says how far it is
  }
  RecognitionTask task(shapes(), options);
  task.auto_pivot = true;
  Recogniser recogniser(shared_device(), task);
  const auto broken_off = [](double) { throw std::runtime_error("broken off"); };
  EXPECT_THROW(recogniser.update(std::span(touches_).first(1), broken_off), std::runtime_error);
  if (!bounded()) {  // bounds take in no touch of a broken update
    EXPECT_THROW(recogniser.update(touches_), Error);
  }
  recogniser.reset();
  recogniser.update(touches_);
}

INSTANTIATE_TEST_SUITE_P(By, AutomaticPivot, each_filter, filter_name);

PoseLattice lattice_of(int nx, int ny, int ntheta) {
  return {{-10.0, 10.0, nx}, {-20.0, 25.0, ny}, {0.0, 6.283185307179586, ntheta}, {3.0, 4.0}};
}

TEST(MarginalGrid, IsTheLatticeWhereAPictureShowsItsBins) {
  for (const PoseLattice& lattice : {lattice_of(1, 25, 16), lattice_of(400, 399, 360)}) {
    const PoseLattice grid = marginal_grid(lattice);
    for (Axis PoseLattice::*axis :
         {&PoseLattice::x_mm, &PoseLattice::y_mm, &PoseLattice::theta_rad}) {
      EXPECT_EQ((grid.*axis).count, (lattice.*axis).count);
      EXPECT_EQ((grid.*axis).upper, (lattice.*axis).upper);
    }
  }
}

TEST(MarginalGrid, HoldsWholeBinsAndTheRegion) {
  for (const int count : {401, 799, 800, 801, 1000, 40'009, 2'000'000'000}) {
    const PoseLattice lattice = lattice_of(count, 17, 100'000);
    const PoseLattice grid = marginal_grid(lattice);
    EXPECT_LE(grid.x_mm.count, 400);
    EXPECT_GE(grid.x_mm.count, 200);
    const double width = grid.x_mm.step() / lattice.x_mm.step();
    EXPECT_NEAR(width, std::round(width), 1e-9 * width) << count << ": stripes";
    EXPECT_EQ(grid.x_mm.lower, lattice.x_mm.lower);
    EXPECT_GE(grid.x_mm.upper, lattice.x_mm.upper);
    EXPECT_LT(grid.x_mm.upper, lattice.x_mm.upper + grid.x_mm.step());
    EXPECT_EQ(grid.y_mm.count, 17);
    EXPECT_EQ(grid.theta_rad.count, 360);
    EXPECT_TRUE(grid.full_circle());
    EXPECT_EQ(grid.pivot_mm, lattice.pivot_mm);
  }
  PoseLattice largest = lattice_of(1001, 1001, 1);
  largest.x_mm = {-1e9, 1e9, 1001};
  EXPECT_NO_THROW(marginal_grid(largest).validate());
}

}  // namespace palpate::recogniser_test
