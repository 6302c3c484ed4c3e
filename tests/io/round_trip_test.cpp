// A recording that the library agrees to write it reads back as it was, whatever it is; what it
// refuses leaves no file.

#include <gtest/gtest.h>

#include <random>

#include "file_parts.hpp"
#include "io/recording_rules.hpp"
#include "model/stream_time.hpp"
#include "palpate/files.hpp"
#include "palpate/frame_recorder.hpp"
#include "same.hpp"
#include "support/limits.hpp"
#include "support/trials.hpp"

namespace palpate::round_trip_test {

// Draws values most of which are usual; the others are what nobody expects.
class Hostile {
 public:
  explicit Hostile(std::uint64_t seed) : random_(seed) {}

  std::size_t below(std::size_t bound) { return random_() % bound; }
  bool once_in(std::size_t n) { return below(n) == 0; }

  template <typename Value>
  Value one_of(std::initializer_list<Value> values) {
    return values.begin()[below(values.size())];
  }

  // How rare the unexpected is: rare enough that some draws are free of it as a whole.
  void set_rarity(std::size_t n) { rarity_ = n; }

  double number() {
    if (once_in(rarity_)) {
      return one_of({nan, infinity, -infinity, 1.7e308, -1.7e308, 5e-324, -0.0, 1e300, 0x1p53 + 2});
    }
    return static_cast<double>(below(2000)) / 64.0 - 10.0;
  }

  std::string text() {
    if (once_in(rarity_)) {
      return one_of<std::string>({"caf\xe9", std::string("a\0b", 3), "a\nb", "\xff", "\xc3",
                                  "\xed\xa0\x80", "\x7f", std::string(100'000, 'x')});
    }
    return one_of<std::string>({"", "A", "Ä", "a b", "触覚", "\xf0\x9f\x96\x90"});
  }

  std::uint64_t count() {
    if (once_in(rarity_)) {
      return one_of<std::uint64_t>({UINT64_MAX, largest_count, largest_count + 1, 1ULL << 60});
    }
    return below(5);
  }

  std::size_t size(std::size_t usual) {
    return once_in(rarity_) ? one_of<std::size_t>({0, 1, usual + 1, 2 * usual}) : usual;
  }

  Pose pose() {
    if (once_in(8)) {
      return {{nan, nan}, nan};
    }
    return {{number(), number()}, number()};
  }

  std::vector<double> numbers(std::size_t n) {
    std::vector<double> list(n);
    std::generate(list.begin(), list.end(), [&] { return number(); });
    return list;
  }

  std::vector<glm::dvec2> points(std::size_t n) {
    std::vector<glm::dvec2> list(n);
    std::ranges::generate(list, [&] { return glm::dvec2(number(), number()); });
    return list;
  }

  std::vector<std::uint8_t> flags(std::size_t n) {
    std::vector<std::uint8_t> list(n);
    std::generate(list.begin(), list.end(),
                  [&] { return static_cast<std::uint8_t>(once_in(4) ? 0 : 1); });
    return list;
  }

 private:
  std::mt19937_64 random_;
  std::size_t rarity_ = 1;
};

class RoundTrip : public OneFile {
 protected:
  // As often as `runs` says: writes what `draw` returns, and expects a file that `check` finds
  // right, or an Error of the user's input and none. Neither is rare, or the draws test nothing.
  template <typename Draw, typename Write, typename Check>
  void expect_whole_or_refused(int runs, const Draw& draw, const Write& write, const Check& check) {
    int refused = 0;
    for (int run = 0; run < runs; ++run) {
      SCOPED_TRACE(run);
      const auto drawn = draw(run % 2 == 0);
      try {
        write(drawn);
      } catch (const Error& error) {
        EXPECT_EQ(error.fault(), Fault::input) << error.what();
        EXPECT_EQ(std::string_view(error.what()).find('\n'), std::string_view::npos);
        EXPECT_TRUE(std::filesystem::is_empty(folder_.path())) << error.what();
        ++refused;
        continue;
      }
      ASSERT_NO_THROW(check(drawn));
      std::filesystem::remove(path_);
    }
    EXPECT_GT(refused, runs / 5);
    EXPECT_LT(refused, runs * 4 / 5);
  }
};

TEST_F(RoundTrip, Recording) {
  Hostile draw(20110509);
  const auto drawn = [&](bool often) {
    draw.set_rarity(often ? 30 : 2000);
    const std::size_t n = 1 + draw.below(5);
    const std::size_t e = 1 + draw.below(4);
    Recording r;
    r.object = draw.text();
    r.sensor = draw.text();
    r.serial = draw.text();
    r.pressure_unit = draw.once_in(20) ? draw.text() : draw.one_of({"kPa", "raw"});
    r.rows = draw.once_in(20) ? draw.text() : draw.one_of({"touches", "frames", "frames"});
    for (std::size_t i = 0; i < n; ++i) {
      r.T_robot_sensor.push_back(draw.pose());
    }
    r.pressure = draw.numbers(draw.size(n * e));
    r.elements_mm = draw.points(draw.size(draw.one_of({e, n * e})));
    r.valid = draw.flags(draw.one_of<std::size_t>({0, draw.size(e), n * e}));
    r.time_s = draw.numbers(draw.one_of<std::size_t>({0, draw.size(n)}));
    r.baseline = draw.numbers(draw.one_of<std::size_t>({0, draw.size(e)}));
    r.device_time_s = draw.numbers(draw.one_of<std::size_t>({0, draw.size(n)}));
    for (std::size_t i = draw.one_of<std::size_t>({0, draw.size(n)}); i > 0; --i) {
      r.lost_before.push_back(draw.count());
    }
    if (draw.once_in(2)) {
      r.truth = {.object = draw.text(), .T_object_robot = draw.pose()};
    }
    return r;
  };
  expect_whole_or_refused(
      trials(100), drawn, [&](const Recording& r) { write_recording(path_, r); },
      [&](const Recording& r) { expect_same(read_recording(path_), r); });
}

// What a stored frame is read back as: what is no pose, no time of a device and no reading of an
// element that is alive is unknown.
void expect_stored(const Recording& read, std::size_t i, const Frame& frame, std::size_t e) {
  EXPECT_EQ(read.time_s[i], frame.host_time_s);
  for (std::size_t k = 0; k < e; ++k) {
    const bool alive = read.valid.empty() || read.valid[k] != 0;
    const double kept = alive && !is_known(frame.values[k]) ? nan : frame.values[k];
    EXPECT_TRUE(same(read.pressure[i * e + k], static_cast<float>(kept)));
  }
  const bool posed = frame.T_robot_sensor && is_finite(*frame.T_robot_sensor);
  EXPECT_TRUE(same(read.T_robot_sensor[i], posed ? *frame.T_robot_sensor : Pose{{nan, nan}, nan}));
}

TEST_F(RoundTrip, StreamOfFrames) {
  Hostile draw(24);
  const auto drawn = [&](bool often) {
    draw.set_rarity(often ? 6 : 200);
    const std::size_t e = 1 + draw.below(4);
    SensorDescription sensor;
    sensor.name = draw.text();
    sensor.serial = draw.text();
    sensor.object = draw.text();
    sensor.pressure_unit = draw.once_in(10) ? draw.text() : draw.one_of({"kPa", "raw"});
    sensor.elements_mm = draw.points(e);
    sensor.valid = draw.flags(draw.one_of<std::size_t>({0, draw.size(e)}));
    sensor.baseline = draw.numbers(draw.one_of<std::size_t>({0, draw.size(e)}));
    if (draw.once_in(4)) {
      sensor.truth = {.object = draw.text(), .T_object_robot = draw.pose()};
    }
    return sensor;
  };
  std::vector<Frame> stored;
  const auto record = [&](const SensorDescription& sensor) {
    stored.clear();
    FrameRecorder recorder(path_, sensor);
    for (std::size_t i = 0; i < 12 || (recorder.frames() == 0 && i < 1000); ++i) {
      Frame frame{.host_time_s = draw.number(), .values = draw.numbers(sensor.elements_mm.size())};
      frame.lost_before = draw.count();
      if (!draw.once_in(3)) {
        frame.T_robot_sensor = draw.pose();
      }
      if (!draw.once_in(3)) {
        frame.device_time_s = draw.number();
      }
      const std::uint64_t before = recorder.frames();
      recorder.add(frame);
      if (recorder.frames() > before) {
        stored.push_back(frame);
      }
      if (draw.once_in(3)) {
        recorder.flush();
      }
    }
    recorder.close();
  };
  expect_whole_or_refused(trials(80), drawn, record, [&](const SensorDescription& sensor) {
    const Recording read = read_recording(path_);
    EXPECT_TRUE(read.closed);
    EXPECT_EQ(read.object, sensor.object);
    EXPECT_EQ(read.pressure_unit, sensor.pressure_unit);
    EXPECT_EQ(read.elements_mm, sensor.elements_mm);
    EXPECT_EQ(read.valid, sensor.valid);
    EXPECT_TRUE(same(read.baseline, sensor.baseline));
    EXPECT_TRUE(same(read.truth, sensor.truth));
    ASSERT_EQ(read.size(), stored.size());
    for (std::size_t i = 0; i < stored.size(); ++i) {
      expect_stored(read, i, stored[i], sensor.elements_mm.size());
    }
  });
}

}  // namespace palpate::round_trip_test
