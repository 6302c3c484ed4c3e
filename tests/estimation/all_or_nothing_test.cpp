// What an update that throws leaves behind, and what is left of an object that was moved from.

#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "gpu/context.hpp"
#include "palpate/error.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/synthetic.hpp"

namespace palpate::all_or_nothing_test {

void expect_refused(const std::function<void()>& call, const std::string& says) {
  try {
    call();
    ADD_FAILURE() << "accepted, in the place of: " << says;
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_EQ(error.fault(), Fault::input) << message;
    EXPECT_NE(message.find(says), std::string::npos) << message;
  }
}

const std::vector<Hypothesis>& objects() {
  static const std::vector<Hypothesis> two{{random_map(31, 27, 0.5, 12.0, 171), 1.0},
                                           {random_map(23, 29, 0.5, 12.0, 172), 1.0}};
  return two;
}

HistogramOptions with_none() {
  HistogramOptions options;
  options.lattice = {.x_mm = {-3.0, 3.0, 11}, .y_mm = {-2.0, 2.0, 9}, .theta_rad = {0.0, 3.0, 4}};
  options.none_weight = 0.3;
  return options;
}

/// All that a histogram tells.
std::vector<std::vector<double>> told_by(const PoseHistogram& histogram) {
  const Estimate estimate = histogram.estimate();
  return {
      histogram.log_likelihood(0), histogram.log_likelihood(1), estimate.identity, {estimate.none}};
}

/// All that a filter tells.
std::vector<double> told_by(const ParticleFilter& filter) {
  std::vector<double> told{filter.effective_sample_size()};
  for (const ParticleFilter::Particle& particle : filter.particles()) {
    told.insert(told.end(),
                {static_cast<double>(particle.object), particle.T_object_robot.translation_mm.x,
                 particle.T_object_robot.theta_rad, particle.weight});
  }
  return told;
}

/// Presses of an array at rest, mostly No Contact; the last touch has a pose that is no number.
class AllOrNothing : public testing::Test {
 protected:
  AllOrNothing() {
    recording.elements_mm.resize(60);
    recording.T_robot_sensor.assign(4, {{0.7, -0.4}, 0.3});
    for (std::size_t i = 0; i < recording.pressure.size(); ++i) {
      recording.pressure[i] = i % 5 == 0 ? recording.pressure[i] : 0.0;
    }
    recording.pressure[0] = recording.pressure[60] = recording.pressure[120] = 20.0;
    recording.T_robot_sensor[3].translation_mm.x = std::numeric_limits<double>::quiet_NaN();
    touches = all_touches(recording);
  }

  Device device = Device::open();
  Recording recording = random_recording(4, 60, 173);
  std::vector<Touch> touches;
};

TEST_F(AllOrNothing, OfTouchesOneOfWhichIsNotSoundNoneIsTakenIn) {
  PoseHistogram histogram(device, objects(), with_none());
  histogram.update(touches[0]);
  const auto before = told_by(histogram);
  expect_refused([&] { histogram.update(touches); }, "T_robot_sensor is not finite");
  EXPECT_EQ(told_by(histogram), before);
  histogram.update(std::span(touches).subspan(1, 2));
  PoseHistogram sound(device, objects(), with_none());
  sound.update(std::span(touches).first(3));
  EXPECT_EQ(told_by(histogram), told_by(sound)) << "as if nothing had been refused";
}

TEST_F(AllOrNothing, AnUpdateThatIsBrokenOffLeavesABeliefThatSaysSo) {
  PoseHistogram histogram(device, objects(), with_none());
  const auto update = [&] {
    histogram.update(std::span(touches).subspan(1, 1),
                     [](double) { throw std::runtime_error("broken off"); });
  };
  histogram.update(touches[0]);
  EXPECT_THROW(update(), std::runtime_error);
  const Mode mode;
  for (const auto& call : std::vector<std::function<void()>>{
           [&] { histogram.estimate(); }, [&] { histogram.refine(mode); },
           [&] { histogram.marginals(0); }, [&] { histogram.log_likelihood(0); },
           [&] { histogram.update(touches[0]); }}) {
    expect_refused(call, "reset()");
  }
  EXPECT_GT(histogram.device_bytes(), 0U);
  histogram.reset();
  histogram.update(std::span(touches).first(2));
  PoseHistogram sound(device, objects(), with_none());
  sound.update(std::span(touches).first(2));
  EXPECT_EQ(told_by(histogram), told_by(sound)) << "begun anew";
}

TEST(Histogram, ProgressThatThrowsBetweenTwoPartsOfAnUpdate) {
  Device device = Device::open();
  gpu::Limits limits = device.context().limits();
  limits.cpu = true;  // so that half a billion bins and elements are a part
  device.context().lower_limits(limits);
  HistogramOptions options = with_none();
  options.lattice = {.x_mm = {-3, 3, 60}, .y_mm = {-3, 3, 60}, .theta_rad = {0, 3, 60}};
  const Recording recording = random_recording(200, 100, 174);
  PoseHistogram histogram(device, objects(), options);
  double most = 0.0;
  EXPECT_THROW(histogram.update(all_touches(recording),
                                [&](double fraction) {
                                  most = fraction;
                                  throw std::runtime_error("broken off");
                                }),
               std::runtime_error);
  EXPECT_GT(most, 0.0);
  EXPECT_LT(most, 0.9) << "not in the middle";
  expect_refused([&] { histogram.estimate(); }, "reset()");
  histogram.reset();
  EXPECT_EQ(histogram.estimate().mode.log_likelihood, 0.0);
}

TEST(ParticleFilter, OfTouchesOneOfWhichIsNotSoundNoneIsTakenIn) {
  Recording recording = random_recording(3, 36, 175);
  const std::vector<Touch> sound = all_touches(recording);
  std::vector<Touch> touches = sound;
  touches[2].pressure = touches[2].pressure.first(35);
  Device device = Device::open();
  ParticleFilter filter(device, objects(), {.particles = 500, .seed = 3});
  filter.update(touches[0]);
  const std::vector<double> before = told_by(filter);
  expect_refused([&] { filter.update(touches); }, "make them agree");
  EXPECT_EQ(told_by(filter), before);
  filter.update(std::span(sound).subspan(1, 2));
  ParticleFilter other(device, objects(), {.particles = 500, .seed = 3});
  other.update(sound);
  EXPECT_EQ(told_by(filter), told_by(other)) << "as if nothing had been refused";
}

TEST(MapBuilder, OfTouchesOneOfWhichCannotBeMappedNoneIsTakenIn) {
  Device device = Device::open();
  Recording recording = random_recording(4, 36, 176);
  const std::vector<Touch> sound = all_touches(recording);
  MapBuilder expected(device, {});
  expected.add(std::span(sound).first(2));
  const OccupancyGrid map = expected.build("made up");

  gpu::Limits limits = device.context().limits();
  limits.storage_range = 1 << 27;  // the least that Vulkan allows
  device.context().lower_limits(limits);
  MapBuilder builder(device, {});
  builder.add(std::span(sound).first(1));
  const auto refuse = [&](const Pose& T_robot_sensor, const std::string& says) {
    std::vector<Touch> touches(sound.begin() + 1, sound.end());
    touches[2].T_robot_sensor = T_robot_sensor;
    expect_refused([&] { builder.add(touches); }, says);
  };
  refuse({{std::numeric_limits<double>::infinity(), 0.0}, 0.0}, "T_robot_sensor is not finite");
  refuse({{1e300, 0.0}, 0.0}, "touch 2: an element at [1e+300");
  refuse({{-1.1e9, 0.0}, 0.0}, "within 1e+09 mm");
  refuse({{1e9 - 10.0, 0.0}, 0.0}, "use larger cells");  // too many cells to count
  refuse({{1e4, 1e4}, 0.0}, "use larger cells");         // more than the device binds
  builder.add(std::span(sound).subspan(1, 1));
  const OccupancyGrid built = builder.build("made up");
  EXPECT_EQ(built.origin_mm, map.origin_mm);
  EXPECT_EQ(built.log_odds, map.log_odds) << "as if nothing had been refused";
  expect_refused([&] { builder.build("(none)"); }, "(none)");
}

TEST(MapBuilder, RoomForMoreNeverCostsWhatIsNeeded) {
  const Recording recording = random_recording(3, 4, 177);
  std::vector<Touch> touches = all_touches(recording);
  Device device = Device::open();
  gpu::Limits limits = device.context().limits();
  // Touched from left to right, in cells of 8 bytes: what is needed in the end just fits.
  const MapOptions options{.cell_mm = 0.25};
  const auto place = [&](double first_mm, double second_mm, double third_mm) {
    touches[0].T_robot_sensor = {{first_mm, 0.0}, 0.0};
    touches[1].T_robot_sensor = {{second_mm, 0.0}, 0.0};
    touches[2].T_robot_sensor = {{third_mm, 0.0}, 0.0};
  };
  place(0.0, 10.0, 80.0);
  MapBuilder expected(device, options);
  expected.add(touches);
  const OccupancyGrid map = expected.build("made up");
  limits.storage_range = map.log_odds.size() * 8;
  device.context().lower_limits(limits);
  MapBuilder builder(device, options);
  for (const Touch& touch : touches) {
    builder.add(std::span(&touch, 1));
    builder.build("made up");
  }
  const OccupancyGrid built = builder.build("made up");
  EXPECT_EQ(built.origin_mm, map.origin_mm);
  ASSERT_EQ(built.log_odds.size(), map.log_odds.size());
  for (std::size_t i = 0; i < built.log_odds.size(); ++i) {
    ASSERT_NEAR(built.log_odds[i], map.log_odds[i], 1e-3) << "what the method allows a map";
  }
}

// Asked on purpose, each of them. NOLINTBEGIN(bugprone-use-after-move)
TEST(MovedFrom, HistogramsSaySo) {
  Device device = Device::open();
  const Recording recording = random_recording(1, 36, 178);
  PoseHistogram first(device, objects(), with_none());
  PoseHistogram second(std::move(first));
  second.update(recording.touch(0));
  for (const auto& call : std::vector<std::function<void()>>{
           [&] { first.reset(); }, [&] { first.update(recording.touch(0)); },
           [&] { first.estimate(); }, [&] { first.refine({}); }, [&] { first.marginals(0); },
           [&] { first.log_likelihood(0); }, [&] { first.lattice(); }, [&] { first.paths(); },
           [&] { first.device_bytes(); }}) {
    expect_refused(call, "histogram: was moved from");
  }
  first = std::move(second);
  EXPECT_NE(first.estimate().mode.log_likelihood, 0.0);
}

TEST(MovedFrom, ParticleFiltersSaySo) {
  Device device = Device::open();
  const Recording recording = random_recording(1, 36, 179);
  ParticleFilter first(device, objects(), {.particles = 10});
  const ParticleFilter second(std::move(first));
  for (const auto& call : std::vector<std::function<void()>>{
           [&] { first.reset(); }, [&] { first.update(recording.touch(0)); },
           [&] { first.estimate(); }, [&] { first.effective_sample_size(); },
           [&] { first.particles(); }, [&] { first.device_bytes(); }}) {
    expect_refused(call, "particle filter: was moved from");
  }
  EXPECT_EQ(second.particles().size(), 10U);
}

TEST(MovedFrom, MapBuildersSaySo) {
  Device device = Device::open();
  const Recording recording = random_recording(1, 36, 180);
  MapBuilder first(device, {});
  const MapBuilder second(std::move(first));
  for (const auto& call : std::vector<std::function<void()>>{
           [&] { first.add(all_touches(recording)); }, [&] { first.build("made up"); },
           [&] { first.clear(); }}) {
    expect_refused(call, "map builder: was moved from");
  }
}

TEST(MovedFrom, DevicesAreNotComputedOn) {
  Device device = Device::open();
  const Device other(std::move(device));
  expect_refused([&] { MapBuilder(device, {}); }, "device: was moved from");
  expect_refused([&] { PoseHistogram(device, objects(), {}); }, "device: was moved from");
  expect_refused([&] { ParticleFilter(device, objects(), {}); }, "device: was moved from");
}
// NOLINTEND(bugprone-use-after-move)

}  // namespace palpate::all_or_nothing_test
