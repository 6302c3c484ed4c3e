// What a survey finds in a recording, and what it suspects: each rule on a file made to show it.

#include "io/recording_survey.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "file_parts.hpp"
#include "palpate/files.hpp"
#include "palpate/simulation.hpp"
#include "support/limits.hpp"

namespace palpate::recording_survey_test {

class RecordingSurveyed : public OneFile {
 protected:
  RecordingSurvey survey(const Recording& recording) const {
    write_recording(path_, recording);
    return survey_recording(path_);
  }
  std::vector<std::string> findings(const Recording& recording) const {
    return findings_of(survey(recording));
  }
};

// The paper's training touches of a letter: 192 on a grid.
Recording training() {
  return Simulator(make_shape("A"), {}, digitacts_array(), 5).touch(training_grid(), {});
}

// As a stream of frames, one after the other at 100 Hz.
Recording stream() {
  Recording frames = training();
  frames.rows = "frames";
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames.time_s[i] = 1.7e9 + 0.01 * static_cast<double>(i);
  }
  return frames;
}

double& reading(Recording& recording, std::size_t row, std::size_t element) {
  return recording.pressure[recording.elements() * row + element];
}

TEST_F(RecordingSurveyed, FindsTheRangesOfPosesPlacesReadingsAndTimes) {
  Recording r;
  r.elements_mm = {{-1.0, 0.0}, {1.0, 0.0}, {1.0, 3.0}};
  r.T_robot_sensor = {{{1.0, -2.0}, 0.5}, {{-4.0, 8.0}, -1.5}};
  r.pressure = {0.0, 1.0, 2.0, 9.0, 2.0, 0.5};
  r.time_s = {10.0, 12.5};
  const RecordingSurvey s = survey(r);
  const auto ends = [](const Extremes& range) { return std::pair(range.least, range.most); };
  EXPECT_EQ(s.head.rows, 2u);
  EXPECT_EQ(s.head.elements, 3u);
  EXPECT_EQ(ends(s.poses->x_mm), std::pair(-4.0, 1.0));
  EXPECT_EQ(ends(s.poses->y_mm), std::pair(-2.0, 8.0));
  EXPECT_EQ(ends(s.poses->theta_rad), std::pair(-1.5, 0.5));
  EXPECT_EQ(s.array->x_mm.span(), 2.0);
  EXPECT_EQ(s.array->y_mm.span(), 3.0);
  EXPECT_EQ(ends(s.spacing->nearest_mm), std::pair(2.0, 3.0));
  EXPECT_EQ(ends(*s.pressure.range), std::pair(0.0, 9.0));
  EXPECT_EQ(s.spacing->closest, (std::array<std::size_t, 2>{0, 1}));
  EXPECT_EQ(s.pressure.readings.quantile(0.5), 1.0);
  EXPECT_EQ(s.pressure.in_contact, 1u) << "a reading of 2 kPa is not above 2 kPa";
  EXPECT_EQ(s.elapsed_s, 2.5);
}

TEST_F(RecordingSurveyed, ContactIsJudgedAboveTheBaseline) {
  Recording r = stream();
  const std::uint64_t touched = survey(r).pressure.in_contact;
  EXPECT_GT(touched, 100u);
  r.baseline.assign(36, 64.0);
  std::ranges::for_each(r.pressure, [](double& pressure) { pressure += 64.0; });
  EXPECT_EQ(survey(r).pressure.in_contact, touched);
  r.pressure_unit = "raw";
  EXPECT_FALSE(survey(r).threshold);
}

TEST_F(RecordingSurveyed, DeadAndUnknownReadingsDoNotCount) {
  Recording r = stream();
  r.valid.assign(36, 1);
  r.valid[3] = 0;
  r.elements_mm[3] = r.elements_mm[4];
  for (std::size_t i = 0; i < r.size(); ++i) {
    reading(r, i, 3) = 4000.0;
  }
  reading(r, 7, 5) = nan;
  const RecordingSurvey s = survey(r);
  EXPECT_LT(s.pressure.range->most, 100.0);
  EXPECT_EQ(s.pressure.unknown, 1u);
  EXPECT_EQ(s.pressure.elements[3].known, 0u);
  EXPECT_EQ(s.pressure.elements[5].known, r.size() - 1);
  EXPECT_TRUE(findings(r).empty());
}

TEST_F(RecordingSurveyed, QuantilesAreExactToABin) {
  ReadingHistogram readings;
  for (int k = -1000; k < 3000; ++k) {
    readings.add(0.1 * k);
  }
  // Bins are 1/128 of a number wide.
  EXPECT_NEAR(readings.quantile(0.125), -50.0, 50.0 / 128.0);
  EXPECT_NEAR(readings.quantile(0.5), 100.0, 100.0 / 128.0);
  EXPECT_NEAR(readings.quantile(1.0), 300.0, 300.0 / 128.0);
  EXPECT_EQ(readings.count(-100.0, 300.0), 4000u);
  EXPECT_EQ(readings.occupied(-1e30, -101.0), 0u);
}

TEST_F(RecordingSurveyed, SpacingIsThatOfAllPairs) {
  std::vector<glm::dvec2> places;
  for (int k = 0; k < 400; ++k) {  // on a spiral, in no order
    const double turn = 0.1 * (k * 7 % 400);
    places.emplace_back(turn * std::cos(turn), turn * std::sin(turn));
  }
  std::optional<Extremes> expected;
  for (const glm::dvec2& a : places) {
    double nearest = infinity;
    for (const glm::dvec2& b : places) {
      nearest = &a == &b ? nearest : std::min(nearest, std::hypot(a.x - b.x, a.y - b.y));
    }
    include(expected, nearest);
  }
  const ElementSpacing spacing = spacing_of(places).value();
  // Two ways to round a square root.
  EXPECT_NEAR(spacing.nearest_mm.least, expected->least, 1e-12);
  EXPECT_NEAR(spacing.nearest_mm.most, expected->most, 1e-12);
  EXPECT_FALSE(spacing_of(std::vector<glm::dvec2>(1)));
}

TEST_F(RecordingSurveyed, SimulatedTouchesAreSound) {
  for (const double noise_kpa : {0.0, 0.7}) {
    for (const int touches : {3, 9, 40, 200}) {
      for (const auto& [letter, seed] : {std::pair("E", 0u), {"O", 1u}}) {
        Simulator sensor(make_shape(letter), {.noise_kpa = noise_kpa}, digitacts_array(), seed);
        EXPECT_EQ(findings(sensor.touch(random_poses(touches, seed), {})),
                  std::vector<std::string>{})
            << letter << " " << touches << " " << noise_kpa;
      }
    }
  }
}

using Change = std::function<void(Recording&)>;

template <typename Value, typename Function>
Change each(std::vector<Value> Recording::*list, Function change) {
  return [=](Recording& r) { std::ranges::transform(r.*list, (r.*list).begin(), change); };
}

template <typename Value>
Change scale(std::vector<Value> Recording::*list, double factor) {
  return each(list, [=](const Value& value) { return factor * value; });
}

Change both(const Change& first, const Change& second) {
  return [=](Recording& r) {
    first(r);
    second(r);
  };
}

Change raw(const std::function<double(double)>& change) {
  return both(each(&Recording::pressure, change), [](Recording& r) { r.pressure_unit = "raw"; });
}

auto constant(double value) {
  return [=](double) { return value; };
}

/// As of an 8-bit sensor, cut at its largest value.
Change quantize(double gain) {
  return raw([=](double kpa) { return std::min(255.0, std::round(gain * kpa)); });
}

Change element(std::size_t e, const std::function<double(double)>& change) {
  return [=](Recording& r) {
    for (std::size_t i = 0; i < r.size(); ++i) {
      reading(r, i, e) = change(reading(r, i, e));
    }
  };
}

Change forget_poses(std::ptrdiff_t count) {
  return [=](Recording& r) { std::fill_n(r.T_robot_sensor.begin(), count, Pose{{nan, nan}, nan}); };
}

Change write_again(std::size_t from, std::size_t to) {
  return [=](Recording& r) {
    r.T_robot_sensor[to] = r.T_robot_sensor[from];
    for (std::size_t e = 0; e < r.elements(); ++e) {
      reading(r, to, e) = reading(r, from, e);
    }
  };
}

/// Presses one place, with a robot that trembles.
void tremble(Recording& r) {
  for (std::size_t i = 0; i < r.size(); ++i) {
    std::copy_n(r.pressure.begin() + 36 * 70, 36, r.pressure.begin() + 36 * static_cast<int>(i));
    reading(r, i, i % 36) += 0.01;
  }
}

void touch_again_nearby(Recording& r) {
  r.T_robot_sensor[30].translation_mm.x += 1e-9;
  reading(r, 31, 35) += 1e-9;
}

double with_offset(double kpa) { return kpa + 50.0; }
double as_switch(double kpa) { return kpa > 5.0 ? 1.0 : 0.0; }
Pose in_metres(const Pose& T) {
  return {1e-3 * T.translation_mm + glm::dvec2(0.6, -0.2), T.theta_rad};
}
Pose in_degrees(const Pose& T) {
  return {T.translation_mm, T.theta_rad * 180.0 / std::numbers::pi};
}
Pose counted_on(const Pose& T) { return {T.translation_mm, T.theta_rad + 1.5 * std::numbers::pi}; }

const Change twice_again = both(write_again(20, 30), write_again(20, 31));
const Change constant_elements = both(element(4, constant(7.25)), element(9, constant(7.25)));

/// What is suspected of a recording after a change: one thing that says both, or nothing.
struct Rule {
  const char* name;
  Recording (*sound)();
  Change change;
  const char* said = nullptr;
  const char* besides = "";
};

void PrintTo(const Rule& rule, std::ostream* out) { *out << rule.name; }

const Rule rules[] = {
    {"SoundTouches", training, [](Recording&) {}},
    {"SoundFrames", stream, [](Recording&) {}},
    {"ElementsInMetres", training, scale(&Recording::elements_mm, 1e-3), "0.0136 mm", "metres"},
    {"ElementsInMicrometres", training, scale(&Recording::elements_mm, 1e3), "4900 mm", "microm"},
    {"ElementsAtOnePlace", training,
     [](Recording& r) { r.elements_mm[7] = r.elements_mm[30] + glm::dvec2(0.005, 0.0); },
     "Elements 7 and 30", "0.005 mm apart"},
    {"PosesInMetres", training, each(&Recording::T_robot_sensor, in_metres), "0.0204 x 0.0204 mm",
     "metres"},
    {"PosesOfOnePlace", training, both(each(&Recording::T_robot_sensor, in_metres), tremble)},
    {"AnglesInDegrees", training, each(&Recording::T_robot_sensor, in_degrees), "330", "degrees"},
    {"AnglesBeyondATurn", training, each(&Recording::T_robot_sensor, counted_on)},
    {"ConstantElements", training, constant_elements, "Elements 4, 9 read", "7.25 kPa"},
    {"ElementOfZero", training, element(4, constant(0.0)), "Element 4 reads", "0 kPa"},
    {"ConstantReadings", training, each(&Recording::pressure, constant(3.0)),
     "No element's reading ever changes"},
    {"ReadingsOf8Bits", training, quantize(8.0)},
    {"SaturatedReadings", training, quantize(16.0), "exactly the largest, 255 raw", "saturates"},
    {"Switches", training, raw(as_switch)},
    {"NothingInContact", training, scale(&Recording::pressure, 1e-3), "ever in contact", "2 kPa"},
    {"SmallRawReadings", training, raw([](double kpa) { return 1e-3 * kpa; })},
    {"Pascals", training, scale(&Recording::pressure, 1e3), "10000 kPa", "pascals"},
    {"TouchesWrittenAgain", training, twice_again, "2 of 192 touches equal an earlier one"},
    {"TouchesThatDifferInADigit", training, both(twice_again, touch_again_nearby)},
    {"FramesOfATouchThatLasts", stream, write_again(20, 21)},
    {"HalfTheFramesWithAPose", stream, forget_poses(90)},
    {"FewFramesWithAPose", stream, forget_poses(100), "100 of 192 frames have no pose"},
    {"NoFrameWithAPose", stream, forget_poses(192), "No frame has a pose"},
    {"TimeGoesBackwards", stream, [](Recording& r) { std::swap(r.time_s[50], r.time_s[51]); },
     "backwards at 1 row, first at row 51"},
    {"TimesInMilliseconds", stream, scale(&Recording::time_s, 1e3), "0.5 s apart", "millisec"},
    {"ElementReadsNothing", stream, element(11, constant(nan)), "Element 11 has no known reading"},
    {"ElementOfAnOffset", stream, element(20, with_offset)},
    {"ElementAlwaysTouched", stream,
     both(element(20, with_offset), [](Recording& r) { r.baseline.assign(36, 0.0); }),
     "Element 20 reads more than 2 kPa above the baseline in every frame"}};

class RecordingFindings : public RecordingSurveyed, public testing::WithParamInterface<Rule> {};

TEST_P(RecordingFindings, AreThoseOfTheRule) {
  const auto& [name, sound, change, said, besides] = GetParam();
  Recording recording = sound();
  change(recording);
  const std::vector<std::string> found = findings(recording);
  ASSERT_EQ(found.size(), said == nullptr ? 0u : 1u) << testing::PrintToString(found);
  if (said != nullptr) {
    expect_named(found.front(), {said, besides});
    EXPECT_TRUE(found.front().ends_with(".") || found.front().ends_with("?")) << found.front();
  }
}

INSTANTIATE_TEST_SUITE_P(All, RecordingFindings, testing::ValuesIn(rules),
                         [](const auto& rule) { return std::string(rule.param.name); });

}  // namespace palpate::recording_survey_test
