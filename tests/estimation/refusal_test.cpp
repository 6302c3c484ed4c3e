#include <functional>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include "palpate/balanced_lattice.hpp"
#include "palpate/error.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate::refusal_test {

void expect_refused(const std::function<void()>& call, const std::string& says) {
  try {
    call();
    ADD_FAILURE() << "accepted, though " << says << " is wrong";
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_EQ(error.fault(), Fault::input) << message;
    EXPECT_NE(message.find(says), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

TEST(MapOptions, OutOfRangeAreRefused) {
  Device device = Device::open();
  const auto refuse = [&](const MapOptions& options, const std::string& says) {
    expect_refused([&] { const MapBuilder builder(device, options); }, says);
  };
  for (const double length : {0.0, -0.5, nan, infinity, 1e-7, 1.1e6, 1e154, 1e200}) {
    refuse({.cell_mm = length}, "cell");
    refuse({.sensor = {.spread_mm = length}}, "spread");
  }
  for (const double wrong : {nan, -1.0}) {
    refuse({.classifier = {.threshold = wrong}}, "threshold");
    refuse({.classifier = {.ratio = wrong}}, "ratio");
  }
  refuse({.sensor = {.peak = 1e-7}}, "peak");
  for (const double p : {0.0, 1.0, -0.5, 2.0, nan}) {
    refuse({.sensor = {.peak = p}}, "peak");
    refuse({.sensor = {.prior = p}}, "prior");
  }
}

TEST(MapOptions, AMapTooLargeIsRefusedBeforeItIsBuilt) {
  Device device = Device::open();
  Recording recording = random_recording(2, 36, 121);
  recording.T_robot_sensor[1].translation_mm = {1e6, 1e6};
  const auto build = [&](double cell_mm) {
    MapBuilder builder(device, {.cell_mm = cell_mm});
    builder.add(all_touches(recording));
    return builder.build("made up");
  };
  expect_refused([&] { build(0.001); }, "use larger cells");
  expect_refused([&] { build(10.0); }, "use larger cells");
  EXPECT_NO_THROW(build(1000.0));
}

TEST(BalancedLattice, OfAMapThatIsNotSoundIsRefused) {
  for (const auto& [cell_mm, spread_mm, says] :
       {std::tuple(1e200, 0.5, "cell_mm"), std::tuple(0.5, 500.0, "spread_mm")}) {
    Hypothesis object{random_map(5, 4, 0.5, 1.0, 122), 1.0};
    object.map.cell_mm = cell_mm;
    object.map.spread_mm = spread_mm;
    expect_refused([&] { balanced_lattice({}, std::span(&object, 1)); }, says);
  }
}

class HistogramInput : public testing::Test {
 protected:
  /// Both filters are given the same.
  void refuse(const std::string& says) {
    expect_refused([&] { const PoseHistogram histogram(device, objects, options); }, says);
    const ParticleOptions particles{
        .particles = 10, .region = options.lattice, .contact = options.contact};
    expect_refused([&] { const ParticleFilter filter(device, objects, particles); }, says);
  }

  Device device = Device::open();
  std::vector<Hypothesis> objects{{random_map(5, 4, 0.5, 1.0, 122), 1.0}};
  HistogramOptions options;
};

TEST_F(HistogramInput, WithoutObjectsIsRefused) {
  objects.clear();
  refuse("no objects");
}

TEST_F(HistogramInput, WithAMapThatIsNoGridIsRefused) {
  const OccupancyGrid sound = objects[0].map;
  objects[0].map.nx = 0;
  refuse("'made up'");
  objects[0].map = sound;
  objects[0].map.log_odds.pop_back();
  refuse("19 log odds");
  for (const double cell_mm : {0.0, -1.0, nan, infinity, 1e-200, 1e154, 1e200}) {
    objects[0].map = sound;
    objects[0].map.cell_mm = cell_mm;
    refuse("cell_mm");
  }
  for (const double spread_mm : {0.0, -1.0, nan, infinity, 500.0}) {
    objects[0].map = sound;
    objects[0].map.spread_mm = spread_mm;
    refuse("spread_mm");
  }
  for (const double origin_mm : {nan, infinity, 1e10}) {
    objects[0].map = sound;
    objects[0].map.origin_mm.y = origin_mm;
    refuse("origin_mm");
  }
  for (const double log_odds : {nan, infinity, -infinity}) {
    objects[0].map = sound;
    objects[0].map.log_odds[7] = static_cast<float>(log_odds);
    refuse("finite");
  }
  objects[0].map = sound;
  objects[0].map.prior = nan;
  refuse("prior");
  objects[0].map = sound;
  objects[0].map.symmetry = -1;
  refuse("symmetry");
  objects[0].map = sound;
  objects[0].map.label = "(none)";
  refuse("(none)");
}

TEST_F(HistogramInput, WithAClassifierThatDecidesNothingIsRefused) {
  options.contact.classifier.threshold = nan;
  refuse("threshold");
  options.contact.classifier = {.ratio = nan};
  refuse("ratio");
  options.contact.classifier = {.ratio = 1.5};
  refuse("ratio");
}

TEST_F(HistogramInput, WithAWeightThatIsNotPositiveIsRefused) {
  for (const double weight : {0.0, -1.0, nan, infinity}) {
    objects[0].weight = weight;
    refuse("weight");
  }
}

TEST_F(HistogramInput, WithAGammaOrPriorOutOfRangeIsRefused) {
  for (const double gamma : {-0.1, 1.0, nan}) {
    options.contact.gamma = gamma;
    refuse("gamma");
  }
  options.contact.gamma = 0.1;
  for (const double prior : {0.0, 1.0, nan}) {
    options.contact.prior = prior;
    refuse("prior");
  }
}

TEST_F(HistogramInput, WithMapsOfDifferentPriorsIsRefusedUnlessOneIsGiven) {
  objects.push_back({random_map(5, 4, 0.5, 1.0, 123), 1.0});
  objects[1].map.prior = 0.3;
  refuse("0.3");
  options.contact.prior = 0.25;
  EXPECT_NO_THROW(PoseHistogram(device, objects, options));
}

TEST_F(HistogramInput, WithALatticeOutOfRangeIsRefused) {
  options.lattice.x_mm.count = 0;
  refuse("x_mm");
  options.lattice = {.y_mm = {5.0, -5.0, 3}};
  refuse("y_mm");
  options.lattice = {.theta_rad = {0.0, nan, 3}};
  refuse("theta_rad");
  options.lattice = {.pivot_mm = {infinity, 0.0}};
  refuse("pivot_mm");
  options.lattice = {.y_mm = {-1e200, 1e200, 3}};
  refuse("y_mm");
}

}  // namespace palpate::refusal_test
