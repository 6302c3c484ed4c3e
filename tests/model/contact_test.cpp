#include "palpate/contact.hpp"

#include <numbers>

#include <gtest/gtest.h>

#include "reference/reference.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate::contact_test {

constexpr Reading in = Reading::in_contact;
constexpr Reading no = Reading::no_contact;
constexpr Reading unknown = Reading::unknown;
using Readings = std::vector<Reading>;

/// The readings, which must be the reference's.
Readings classify(const std::vector<double>& pressure, const std::vector<std::uint8_t>& valid = {},
                  const ContactClassifier& classifier = {}) {
  const std::vector<glm::dvec2> elements(pressure.size());
  const Touch touch{.elements_mm = elements, .pressure = pressure, .valid = valid};
  const Readings readings = classifier.classify(touch);
  EXPECT_EQ(readings, reference::classify(touch, classifier));
  return readings;
}

TEST(ContactClassifier, NeedsBothTestsToAgree) {
  // Threshold 2, ratio 0.3, largest 20: the second bound is 6.
  EXPECT_EQ(classify({20.0, 7.0, 5.0, 1.0}), (Readings{in, in, unknown, no}));
  // Largest 4: the second bound is 1.2.
  EXPECT_EQ(classify({4.0, 2.5, 1.5, 1.0}), (Readings{in, in, unknown, no}));
  EXPECT_EQ(classify({1.0, 1.0}), (Readings{unknown, unknown})) << "equal, below the threshold";
  EXPECT_EQ(classify({0.0, 0.0}), (Readings{unknown, unknown})) << "none is below 0.3 times 0";
  EXPECT_TRUE(classify({}).empty());
}

TEST(ContactClassifier, EqualityIsUnknown) {
  const ContactClassifier half{.threshold = 2.0, .ratio = 0.5};
  EXPECT_EQ(classify({8.0, 2.0}, {}, half), (Readings{in, unknown})) << "threshold";
  EXPECT_EQ(classify({8.0, 4.0}, {}, half), (Readings{in, unknown})) << "ratio, above the other";
  EXPECT_EQ(classify({3.0, 1.5}, {}, half), (Readings{in, unknown})) << "ratio, below the other";
}

TEST(ContactClassifier, DeadElementsAndNonNumbersAreUnknownAndDoNotSetTheMaximum) {
  EXPECT_EQ(classify({1e9, 5.0, 1.0}, {0, 1, 1}), (Readings{unknown, in, no}));
  EXPECT_EQ(classify({nan, 5.0, 1.0}, {0, 1, 1}), (Readings{unknown, in, no}));
  EXPECT_EQ(classify({5.0, 1.0}, {0, 0}), (Readings{unknown, unknown}));
  EXPECT_EQ(classify({nan, 5.0, 1.0}), (Readings{unknown, in, no}));
  EXPECT_EQ(classify({5.0, nan, 1.0}), (Readings{in, unknown, no}));
}

TEST(ContactClassifier, AgreesWithTheReference) {
  Uniform random(11);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<double> pressure(9);
    std::vector<std::uint8_t> valid(9);
    for (std::size_t i = 0; i < pressure.size(); ++i) {
      // Halves, so that many pressures equal a bound.
      pressure[i] = std::floor(random(0.0, 13.0)) / 2.0;
      valid[i] = random(0.0, 1.0) < 0.9 ? 1 : 0;
    }
    classify(pressure, valid, {.threshold = 2.0, .ratio = 0.5});
  }
}

TEST(ContactClassifier, RefusesBoundsThatDecideNothing) {
  const auto expect_refused = [](const ContactClassifier& classifier, const char* field) {
    expect_named(input_error([&] { classifier.validate(); }), {field});
    const std::vector<glm::dvec2> elements(2);
    const std::vector<double> pressure{5.0, 1.0};
    const Touch touch{.elements_mm = elements, .pressure = pressure};
    expect_named(input_error([&] { classifier.classify(touch); }), {field});
  };
  for (const double threshold : {nan, infinity, -infinity, -0.1}) {
    expect_refused({.threshold = threshold}, "threshold = ");
  }
  for (const double ratio : {nan, infinity, -0.1, 1.0, 1.5}) {
    expect_refused({.ratio = ratio}, "ratio = ");
  }
  ContactClassifier{.threshold = 0.0, .ratio = 0.0}.validate();
}

TEST(FaultOfReadings, IsAPlaceBeyondWhatAMapMayReach) {
  const ElementReading near{{1e9, -1e9}, in};
  EXPECT_EQ(fault_of(std::vector{near}), std::nullopt);
  for (const double far : {1.1e9, -1e300, infinity, nan}) {
    for (const glm::dvec2 at : {glm::dvec2(far, 0.0), glm::dvec2(0.0, far)}) {
      EXPECT_NE(fault_of(std::vector<ElementReading>{near, {at, no}}), std::nullopt) << far;
    }
  }
}

TEST(KnownReadings, AreInTheRobotFrameWithoutTheUnknown) {
  const std::vector<glm::dvec2> elements{{1.0, 0.0}, {2.0, 0.0}, {3.0, 0.0}};
  const std::vector<double> pressure{10.0, 2.5, 0.0};
  const Touch touch{.T_robot_sensor = {{100.0, 200.0}, std::numbers::pi / 2.0},
                    .elements_mm = elements,
                    .pressure = pressure};
  const std::vector<ElementReading> known = known_readings(touch, {});
  ASSERT_EQ(known.size(), 2U);
  // A quarter turn puts the sensor's x axis along the robot's y; 1e-12 mm is float64 rounding.
  EXPECT_EQ(known[0].reading, in);
  EXPECT_NEAR(known[0].position_mm.x, 100.0, 1e-12);
  EXPECT_NEAR(known[0].position_mm.y, 201.0, 1e-12);
  EXPECT_EQ(known[1].reading, no);
  EXPECT_NEAR(known[1].position_mm.y, 203.0, 1e-12);
}

}  // namespace palpate::contact_test
