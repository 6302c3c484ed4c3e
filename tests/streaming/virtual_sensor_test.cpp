#include "palpate/virtual_sensor.hpp"

#include <algorithm>
#include <numbers>

#include "palpate/files.hpp"
#include "palpate/sensor.hpp"
#include "palpate/simulation.hpp"
#include "press.hpp"
#include "support/limits.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::virtual_sensor_test {

using namespace std::chrono_literals;

std::vector<Frame> frames_of(Sensor& sensor) {
  std::vector<Frame> frames;
  sensor.start();
  while (!sensor.ended()) {
    if (auto frame = sensor.next(100ms)) {
      frames.push_back(std::move(*frame));
    }
  }
  sensor.stop();
  return frames;
}

std::vector<Frame> frames_of(const std::string& name) {
  return frames_of(*open_virtual_sensor(name));
}

std::vector<DetectedTouch> touches_of(const std::string& name) {
  const auto sensor = open_virtual_sensor(name);
  const std::vector<Frame> frames = frames_of(*sensor);
  const std::span first = std::span(frames).first(frames.size() / 30);
  return touches_in(frames, {}, baseline_of(first, sensor->description(), 2.0));
}

TEST(SimulatedSensor, ThePressesAreFoundAsTheyWereMade) {
  const std::string name = "simulate:E,seed=4,touches=10,speed=max";
  const auto touches = touches_of(name + ",object=3:-4:30");
  const auto exact = touches_of(name + ",noise=0");
  ASSERT_EQ(touches.size(), 10u);
  ASSERT_EQ(exact.size(), 10u);
  SensorModel model;
  model.noise_kpa = 0.0;
  Simulator simulator(make_shape("E"), model, digitacts_array(), 4);
  const Pose T_object_robot{{3.0, -4.0}, std::numbers::pi / 6.0};
  std::size_t found = 0;
  // Every pose that is drawn and touches the object, in order
  for (const Pose& drawn : random_poses(256, 4)) {
    const std::vector<double> pressure = simulator.touch({drawn}, {}).pressure;
    if (found == touches.size() || std::ranges::max(pressure) < 5.0) {
      continue;
    }
    SCOPED_TRACE(found);
    ASSERT_TRUE(touches[found].T_robot_sensor);
    const Pose T_object_sensor = T_object_robot * *touches[found].T_robot_sensor;
    // The robot stands still while it presses: only rounding.
    EXPECT_NEAR(T_object_sensor.translation_mm.x, drawn.translation_mm.x, 1e-9);
    EXPECT_NEAR(T_object_sensor.translation_mm.y, drawn.translation_mm.y, 1e-9);
    EXPECT_NEAR(wrap_angle(T_object_sensor.theta_rad - drawn.theta_rad, 2.0 * std::numbers::pi),
                0.0, 1e-9);
    for (std::size_t k = 0; k < pressure.size(); ++k) {
      // The baseline follows the begin of a press, from 0 to 1 kPa for less than 0.1 s, with a time
      // constant of 1 s.
      EXPECT_NEAR(exact[found].pressure[k], pressure[k], 0.05) << k;
      // Five standard errors of the steady mean, 0.7 / sqrt(0.84 * 40), and of the baseline,
      // 1.25 * 0.7 / sqrt(70).
      EXPECT_NEAR(touches[found].pressure[k], exact[found].pressure[k], 0.8) << k;
    }
    ++found;
  }
  EXPECT_EQ(found, touches.size());
}

TEST(SimulatedSensor, SameSeedGivesTheSameStream) {
  const auto values = [](const std::vector<Frame>& frames) {
    std::vector<std::vector<double>> all;
    std::ranges::transform(frames, std::back_inserter(all), &Frame::values);
    return all;
  };
  const std::string name = "simulate:A,touches=2,speed=max";
  const auto sensor = open_virtual_sensor(name);
  const auto first = values(frames_of(*sensor));
  EXPECT_EQ(values(frames_of(*sensor)), first) << "start() begins anew";
  EXPECT_EQ(values(frames_of(name + ",seed=1")), first);
  EXPECT_NE(values(frames_of(name + ",seed=2")), first);
}

TEST(SimulatedSensor, HasTheArrayTheRateAndTheSpeedThatAreAskedFor) {
  const auto sensor = open_virtual_sensor("simulate:A,array=3:2:1.5,touches=1,rate=250,speed=20");
  EXPECT_EQ(
      sensor->description().elements_mm,
      (std::vector<glm::dvec2>{
          {-1.5, -0.75}, {0.0, -0.75}, {1.5, -0.75}, {-1.5, 0.75}, {0.0, 0.75}, {1.5, 0.75}}));
  EXPECT_EQ(sensor->description().rate_hz, 250.0);
  EXPECT_EQ(sensor->description().object, "A");
  EXPECT_FALSE(sensor->description().truth);
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<Frame> frames = frames_of(*sensor);
  EXPECT_GE(std::chrono::steady_clock::now() - begin, 2.6s / 20);
  // 1 s of hovering, 1 s of pressing, 0.6 s until the end; the first and the last frame count.
  ASSERT_EQ(frames.size(), 651u);
  EXPECT_EQ(frames[0].values.size(), 6u);
  for (std::size_t i = 1; i < frames.size(); ++i) {
    // A double holds times since 1970 to 2.4e-7 s.
    EXPECT_NEAR(frames[i].host_time_s - frames[i - 1].host_time_s, 0.004, 1e-6);
  }
}

TEST(SimulatedSensor, RealTimeIsNotOvertaken) {
  const auto slow = open_virtual_sensor("simulate:A,rate=1,speed=0.001");
  slow->start();
  ASSERT_TRUE(slow->next(1s));
  EXPECT_FALSE(slow->next(1ms)) << "the second frame is due in 1,000 s";
  EXPECT_FALSE(slow->ended());
}

class ReplayedFile : public testing::Test {
 protected:
  ReplayedFile() {
    recording_.rows = "frames";
    recording_.sensor = "Board";
    recording_.serial = "9";
    recording_.elements_mm = {{0.0, 0.0}, {1.0, 0.0}};
    recording_.valid = {1, 0};
    recording_.baseline = {2.0, 0.0};
    for (int i = 0; i < 50; ++i) {
      recording_.pressure.insert(recording_.pressure.end(), {0.5 * i, nan});
      recording_.time_s.push_back(1.7e9 + 0.01 * i);
      recording_.device_time_s.push_back(i % 2 == 0 ? 0.01 * i : nan);
      recording_.lost_before.push_back(i == 7 ? 3 : 0);
      recording_.T_robot_sensor.push_back(i < 25 ? Pose{{nan, nan}, nan} : Pose{{1.0 * i, 0}, 2.0});
    }
    recording_.truth = {.object = "U", .T_object_robot = {}};
  }

  std::string saved() {
    write_recording(path_, recording_);
    return "replay:" + path_.string();
  }

  ScratchFolder folder_;
  std::filesystem::path path_ = folder_ / "with, comma=.h5";
  Recording recording_;
};

TEST_F(ReplayedFile, ComesAsItWasRecorded) {
  const auto sensor = open_virtual_sensor(saved() + ",speed=max");
  const SensorDescription& description = sensor->description();
  EXPECT_EQ(description.name, "Board");
  EXPECT_EQ(description.serial, "9");
  EXPECT_EQ(description.elements_mm, recording_.elements_mm);
  EXPECT_EQ(description.valid, recording_.valid);
  EXPECT_EQ(description.baseline, recording_.baseline);
  EXPECT_NEAR(description.rate_hz, 100.0, 1e-3);  // times are good to 2.4e-7 s in 0.49 s
  ASSERT_TRUE(description.truth);
  EXPECT_EQ(description.truth->object, "U");
  const std::vector<Frame> frames = frames_of(*sensor);
  ASSERT_EQ(frames.size(), 50u);
  for (std::size_t i = 0; i < 50; ++i) {
    EXPECT_EQ(frames[i].host_time_s, recording_.time_s[i]);
    EXPECT_EQ(frames[i].values[0], recording_.pressure[2 * i]);
    EXPECT_EQ(frames[i].device_time_s.has_value(), i % 2 == 0);
    EXPECT_EQ(frames[i].T_robot_sensor.has_value(), i >= 25);
    EXPECT_EQ(frames[i].lost_before, i == 7 ? 3u : 0u);
  }
  EXPECT_EQ(sensor->counters().frames, 50u);
  EXPECT_EQ(sensor->counters().lost, 3u);
}

// More lost frames than a count holds, at times of a clock that is set back.
TEST_F(ReplayedFile, CountsAndTimesThatAFileMayHold) {
  constexpr std::uint64_t most = std::uint64_t{1} << 53;
  for (std::size_t i = 0; i < 50; ++i) {
    recording_.lost_before[i] = most;
    recording_.time_s[i] -= i < 25 ? 0.0 : 3600.0;
  }
  const auto sensor = open_virtual_sensor(saved() + ",speed=max");
  EXPECT_NEAR(sensor->description().rate_hz, 49.0 / 0.48, 1e-3);  // as times are good to 2.4e-7 s
  EXPECT_EQ(frames_of(*sensor).size(), 50u);
  EXPECT_EQ(sensor->counters().lost, most);
}

// Also where the recording host's clock was set back in the middle
TEST_F(ReplayedFile, TakesItsTime) {
  for (const double back_s : {0.0, 3600.0}) {
    for (std::size_t i = 25; i < 50; ++i) {
      recording_.time_s[i] -= back_s;
    }
    const auto sensor = open_virtual_sensor(saved() + ",speed=5");
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(frames_of(*sensor).size(), 50u);
    EXPECT_GE(std::chrono::steady_clock::now() - begin, 0.479s / 5) << back_s;
  }
}

TEST_F(ReplayedFile, ReadingsThatAreNotValidInAFrameAreUnknownInIt) {
  recording_.valid.assign(100, 1);
  recording_.valid[2 * 7] = 0;
  for (std::size_t i = 0; i < 50; ++i) {
    recording_.valid[2 * i + 1] = 0;
  }
  const auto sensor = open_virtual_sensor(saved() + ",speed=max");
  EXPECT_EQ(sensor->description().valid, (std::vector<std::uint8_t>{1, 0})) << "dead";
  const std::vector<Frame> frames = frames_of(*sensor);
  ASSERT_EQ(frames.size(), 50u);
  for (std::size_t i = 0; i < 50; ++i) {
    EXPECT_EQ(is_known(frames[i].values[0]), i != 7);
    EXPECT_FALSE(is_known(frames[i].values[1]));
  }
}

TEST_F(ReplayedFile, RefusesWhatIsNoStream) {
  recording_.time_s.clear();
  expect_named(input_error([&] { open_virtual_sensor(saved()); }), {"comma=.h5", "'time'"});
  recording_.rows = "touches";
  recording_.T_robot_sensor.assign(50, {});
  expect_named(input_error([&] { open_virtual_sensor(saved()); }), {"comma=.h5", "touches"});
  expect_named(input_error([] { open_virtual_sensor("replay:missing.h5"); }), {"missing.h5"});
}

TEST(VirtualSensor, KnowsWhatFloodsWithoutAnEnd) {
  EXPECT_TRUE(is_endless_flood("simulate:A,speed=max"));
  for (const char* name : {"simulate:A,speed=100", "simulate:A", "simulate:A,touches=3,speed=max",
                           "replay:a.h5,speed=max", "takktile"}) {
    EXPECT_FALSE(is_endless_flood(name)) << name;
  }
}

TEST(VirtualSensor, RefusesNamesThatSayNothing) {
  const std::pair<const char*, const char*> names[] = {
      {"simulate:", "simulate:SHAPE"},
      {"replay:,speed=max", "replay:FILE"},
      {"simulate:A,rat=3", "rat is no option"},
      {"simulate:A,array=16:16", "array must be COLUMNS:ROWS:PITCH"},
      {"simulate:A,array=0:16:2", "array = 0: give a number from 1 to 64"},
      {"simulate:A,array=16:16:0", "array = 0: give a number from 0.01 to 100"},
      {"simulate:A,rate", "rate has no value"},
      {"simulate:A,rate=", "rate = : give a number from 1"},
      {"simulate:A,rate=0", "rate = 0: give a number from 1 to 100000"},
      {"simulate:A,rate=nan", "rate = nan: give"},
      {"simulate:A,rate=10x", "rate = 10x: give"},
      {"simulate:A,rate=10,rate=20", "rate is given twice"},
      {"simulate:A,seed=-1", "seed = -1: give a number from 0"},
      {"simulate:A,touches=0", "touches = 0: give a number from 1"},
      {"simulate:A,noise=-1", "noise = -1: give a number from 0"},
      {"simulate:A,object=1:2", "object must be random, or X:Y:DEG"},
      {"simulate:A,object=1:2:x", "object = x: give"},
      {"simulate:A,speed=0", "speed = 0: give a number from 0.001"},
      {"simulate:AB", "AB"}};
  for (const auto& [name, named] : names) {
    EXPECT_TRUE(is_virtual_sensor(name));
    expect_named(input_error([&] { open_virtual_sensor(name); }), {named});
  }
  EXPECT_FALSE(is_virtual_sensor("takktile"));
}

}  // namespace palpate::virtual_sensor_test
