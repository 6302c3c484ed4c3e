#include "bounded_set_up.hpp"

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "palpate/error.hpp"
#include "support/touched_shape.hpp"

namespace palpate {

const std::vector<Hypothesis>& two_shapes() {
  static const std::vector<Hypothesis> two{{map_of(on_letter_l, "L"), 1.0},
                                           {map_of(on_disc, "disc"), 2.0}};
  return two;
}

const std::vector<Hypothesis>& two_made_up() {
  static const std::vector<Hypothesis> two{{random_map(31, 27, 0.5, 3.0, 801), 1.0},
                                           {random_map(23, 29, 0.5, 3.0, 802), 3.0}};
  return two;
}

BoundedOptions small_options() {
  BoundedOptions options;
  options.lattice = {.x_mm = {-6.0, 6.0, 13},
                     .y_mm = {-5.0, 6.0, 12},
                     .theta_rad = {0, two_pi, 16},
                     .pivot_mm = {2.0, -1.0}};
  return options;
}

Recording touches_of_l(std::size_t touches, std::uint64_t seed) {
  return touches_of(on_letter_l, {{1.3, -0.8}, 0.7}, touches, seed);
}

double sum(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

HistogramOptions dense_options(const BoundedOptions& options) {
  return {.lattice = options.lattice,
          .contact = options.contact,
          .none_weight = options.none_weight,
          .touch_sd = options.touch_sd};
}

void expect_as_dense(BoundedPosterior& bounded, PoseHistogram& dense, std::size_t touches) {
  const Estimate ours = bounded.estimate();
  const Estimate theirs = dense.estimate();
  const double nats = 1e-3 * static_cast<double>(touches);
  EXPECT_NEAR(std::log(ours.none / (1.0 - ours.none)), std::log(theirs.none / (1.0 - theirs.none)),
              nats);
  EXPECT_LT(largest_difference(ours.identity, theirs.identity), 1e-4);
  EXPECT_EQ(ours.mode.object, theirs.mode.object);
  EXPECT_EQ(ours.mode.bin, theirs.mode.bin);
  EXPECT_NEAR(ours.mode.log_likelihood, theirs.mode.log_likelihood, nats);
  const Pose our_pose = bounded.refine(ours.mode).T_object_robot;
  const Pose their_pose = dense.refine(theirs.mode).T_object_robot;
  EXPECT_NEAR(our_pose.translation_mm.x, their_pose.translation_mm.x, 1e-3);
  EXPECT_NEAR(our_pose.translation_mm.y, their_pose.translation_mm.y, 1e-3);
  EXPECT_NEAR(our_pose.theta_rad, their_pose.theta_rad, 1e-4);
  EXPECT_LT(largest_difference(bounded.marginals(0).theta, dense.marginals(0).theta), 1e-4);
}

void expect_refused(const std::function<void()>& call, const std::string& says) {
  try {
    call();
    ADD_FAILURE() << "accepted, in the place of: " << says;
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_EQ(error.fault(), Fault::input) << message;
    EXPECT_NE(message.find(says), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

}  // namespace palpate
