// What an update that throws leaves behind, and what is left of an object that was moved from. That
// no touch is taken in where one is refused is a law of filter_laws_test.cpp.

#include <functional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "beliefs.hpp"
#include "palpate/map_builder.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"

namespace palpate::all_or_nothing_test {

using Calls = std::vector<std::function<void()>>;

void expect_refused(const Calls& calls, const char* says) {
  for (std::size_t i = 0; i < calls.size(); ++i) {
    SCOPED_TRACE(i);
    expect_named(input_error(calls[i]), {says});
  }
}

/// An update of more bins and elements than a CPU takes in one part, so that it reports progress.
TEST(BrokenOffUpdate, LeavesABeliefThatSaysSo) {
  Device device = lowered_device([](gpu::Limits& limits) { limits.cpu = true; });
  const Recording recording = random_recording(60, 100, 174);
  PoseHistogram histogram(
      device, two_objects(12.0, 171),
      {.lattice = {.x_mm = {-3, 3, 60}, .y_mm = {-3, 3, 60}, .theta_rad = {0, 3, 60}}});
  double most = 0.0;
  EXPECT_THROW(histogram.update(all_touches(recording),
                                [&](double fraction) {
                                  most = fraction;
                                  throw std::runtime_error("broken off");
                                }),
               std::runtime_error);
  EXPECT_GT(most, 0.0);
  EXPECT_LT(most, 0.9) << "not in the middle";
  expect_refused({[&] { histogram.estimate(); }, [&] { histogram.refine({}); },
                  [&] { histogram.marginals(0); }, [&] { histogram.log_likelihood(0); },
                  [&] { histogram.update(recording.touch(0)); }},
                 "reset()");
  EXPECT_GT(histogram.device_bytes(), 0U);
  histogram.reset();
  EXPECT_EQ(histogram.estimate().mode.log_likelihood, 0.0);
}

TEST(MapBuilder, OfTouchesOneOfWhichCannotBeMappedNoneIsTakenIn) {
  Device device = Device::open();
  Recording recording = random_recording(4, 36, 176);
  const std::vector<Touch> sound = all_touches(recording);
  MapBuilder expected(device, {});
  expected.add(std::span(sound).first(2));
  const OccupancyGrid map = expected.build("made up");

  Device least = lowered_device([](gpu::Limits& limits) { limits.storage_range = 1 << 27; });
  MapBuilder builder(least, {});
  builder.add(std::span(sound).first(1));
  const auto refuse = [&](const Pose& T_robot_sensor, const char* says) {
    std::vector<Touch> touches(sound.begin() + 1, sound.end());
    touches[2].T_robot_sensor = T_robot_sensor;
    expect_named(input_error([&] { builder.add(touches); }), {says});
  };
  refuse({{infinity, 0.0}, 0.0}, "T_robot_sensor is not finite");
  refuse({{1e300, 0.0}, 0.0}, "touch 2: an element at [1e+300");
  refuse({{-1.1e9, 0.0}, 0.0}, "within 1e+09 mm");
  refuse({{1e9 - 10.0, 0.0}, 0.0}, "use larger cells");  // too many cells to count
  refuse({{1e4, 1e4}, 0.0}, "use larger cells");         // more than the device binds
  builder.add(std::span(sound).subspan(1, 1));
  const OccupancyGrid built = builder.build("made up");
  EXPECT_EQ(built.origin_mm, map.origin_mm);
  EXPECT_EQ(built.log_odds, map.log_odds) << "as if nothing had been refused";
  expect_named(input_error([&] { builder.build("(none)"); }), {"(none)"});
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
TEST(MovedFrom, FiltersMapBuildersAndDevicesSaySo) {
  Device device = Device::open();
  const Recording recording = random_recording(2, 36, 178);
  const Touch touch = recording.touch(0);
  const std::vector<Hypothesis> objects = three_objects();

  PoseHistogram histogram(device, objects, {.lattice = small_lattice()});
  histogram.update(touch);
  const auto told = told_by(histogram);
  PoseHistogram second(std::move(histogram));
  expect_refused(
      {[&] { histogram.reset(); }, [&] { histogram.update(touch); }, [&] { histogram.estimate(); },
       [&] { histogram.refine({}); }, [&] { histogram.marginals(0); },
       [&] { histogram.log_likelihood(0); }, [&] { histogram.lattice(); },
       [&] { histogram.paths(); }, [&] { histogram.device_bytes(); }},
      "histogram: was moved from");
  histogram = std::move(second);
  EXPECT_EQ(told_by(histogram), told);

  ParticleFilter filter(device, objects, {.particles = 10});
  const ParticleFilter other(std::move(filter));
  expect_refused({[&] { filter.reset(); }, [&] { filter.update(touch); },
                  [&] { filter.estimate(); }, [&] { filter.effective_sample_size(); },
                  [&] { filter.particles(); }, [&] { filter.device_bytes(); }},
                 "particle filter: was moved from");
  EXPECT_EQ(other.particles().size(), 10U);

  MapBuilder builder(device, {});
  const MapBuilder another(std::move(builder));
  expect_refused({[&] { builder.add(all_touches(recording)); }, [&] { builder.build("made up"); },
                  [&] { builder.clear(); }},
                 "map builder: was moved from");

  Device gone = Device::open();
  const Device elsewhere(std::move(gone));
  expect_refused({[&] { MapBuilder(gone, {}); }, [&] { PoseHistogram(gone, objects, {}); },
                  [&] { ParticleFilter(gone, objects, {}); }},
                 "device: was moved from");
}
// NOLINTEND(bugprone-use-after-move)

}  // namespace palpate::all_or_nothing_test
