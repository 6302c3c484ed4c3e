#include "model/touch_evidence.hpp"

#include <gtest/gtest.h>

#include "palpate/error.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate::touch_evidence_test {

/// Six elements 2 mm apart: in contact, below the ratio, a negative pressure, no number, dead, and
/// in contact again.
struct SixElements {
  std::vector<glm::dvec2> elements_mm{{-5, 1}, {-3, 1}, {-1, 1}, {1, 1}, {3, 1}, {5, 1}};
  std::vector<double> pressure{20.0, 5.0, -1.0, nan, 50.0, 10.0};
  std::vector<std::uint8_t> valid{1, 1, 1, 1, 0, 1};

  Touch touch() const {
    return {.T_robot_sensor = {{100.0, 50.0}, 0.5 * two_pi},
            .elements_mm = elements_mm,
            .pressure = pressure,
            .valid = valid};
  }
};

constexpr Reading in = Reading::in_contact;
constexpr Reading no = Reading::no_contact;
constexpr Reading unknown = Reading::unknown;

TEST(TouchEvidence, TellsWhatEveryElementReadsAndWhichLive) {
  const SixElements six;
  const TouchEvidence evidence(six.touch(), {});  // threshold 2, ratio 0.3 of 20
  EXPECT_EQ(evidence.readings, (std::vector{in, unknown, no, unknown, unknown, in}));
  EXPECT_EQ(evidence.lives, (std::vector<std::uint8_t>{1, 1, 1, 0, 0, 1}));
  EXPECT_EQ(evidence.contacts, 2U);
  EXPECT_TRUE(evidence.in_contact());
  EXPECT_EQ(evidence.least_pressure, -1.0);
  EXPECT_EQ(evidence.largest_pressure, 20.0) << "a dead element's 50 does not count";
  EXPECT_DOUBLE_EQ(evidence.force, (20.0 + 5.0 + 10.0) / 2.0);
  // The array's middle is (0, 1) mm in its own frame, and the sensor stands upside down.
  EXPECT_NEAR(evidence.middle_mm().x, 100.0, 1e-12);
  EXPECT_NEAR(evidence.middle_mm().y, 49.0, 1e-12);
}

TEST(TouchEvidence, KnownLeavesOutUnknownElements) {
  const SixElements six;
  const TouchEvidence known = TouchEvidence(six.touch(), {}).known();
  EXPECT_EQ(known.readings, (std::vector{in, no, in}));
  EXPECT_EQ(known.elements_mm,
            (std::vector<glm::dvec2>{six.elements_mm[0], six.elements_mm[2], six.elements_mm[5]}));
  EXPECT_EQ(known.lives, (std::vector<std::uint8_t>{1, 1, 1}));
  const TouchEvidence contact = known.contact();
  EXPECT_EQ(contact.readings, (std::vector{in, in}));
  EXPECT_EQ(contact.elements_mm, (std::vector<glm::dvec2>{six.elements_mm[0], six.elements_mm[5]}));
}

TEST(TouchEvidence, OfDeadElementsHasNoPressure) {
  SixElements six;
  six.valid.assign(6, 0);
  const TouchEvidence evidence(six.touch(), {});
  EXPECT_FALSE(evidence.in_contact());
  EXPECT_GT(evidence.least_pressure, evidence.largest_pressure);
  EXPECT_EQ(evidence.force, 0.0);
  EXPECT_TRUE(evidence.known().readings.empty());
}

TEST(TouchEvidence, SaysOfATouchWhatTheTouchSays) {
  const SixElements six;
  const ContactModel contact{.prior = 0.2};
  const std::vector<Touch> touches{six.touch()};
  const std::vector<TouchEvidence> evidence = evidence_of(touches, contact);
  EXPECT_EQ(features_of(evidence[0], contact.classifier.threshold).values,
            press_features(touches[0], contact.classifier).values);

  const OccupancyGrid map = random_map(31, 27, 0.5, 6.0, 481);
  const Pose T_object_robot{{100.0, 50.0}, 0.5 * two_pi};
  const std::optional<Fit> fit = evidence_fit(evidence, T_object_robot, map, contact, {}, 0);
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->z, fit_of(touches, T_object_robot, map, contact, 0)->z);
  const DisplacementSd sd{.mm = 0.5, .rad = 0.05};
  EXPECT_EQ(evidence_fit(evidence, T_object_robot, map, contact, sd, 0)->z,
            fit_of(touches, T_object_robot, map, contact, sd, 0)->z);
}

TEST(FitSums, AreOfEachTouchAndAddUp) {
  const OccupancyGrid map = random_map(31, 27, 0.5, 6.0, 481);
  const ContactModel contact{.prior = 0.2};
  SixElements six;
  std::vector<TouchEvidence> touches;
  for (const double theta_rad : {0.0, 1.0, 2.0}) {
    Touch touch = six.touch();
    touch.T_robot_sensor.theta_rad = theta_rad;
    touches.emplace_back(touch, contact);
  }
  std::ranges::fill(touches[1].readings, Reading::unknown);
  for (const DisplacementSd& sd : {DisplacementSd{}, DisplacementSd{.mm = 0.5, .rad = 0.05}}) {
    const Pose pose{{1.0, -2.0}, 0.5};
    const auto sums = fit_sums(touches, pose, map, contact, sd, 0);
    ASSERT_EQ(sums.size(), 3u);
    EXPECT_FALSE(sums[1]) << "tells nothing";
    EXPECT_EQ(combined_fit(std::span(sums).first(1))->z,
              evidence_fit(std::span(touches).first(1), pose, map, contact, sd, 0)->z);
    EXPECT_DOUBLE_EQ(combined_fit(sums)->z, (sums[0]->deviation + sums[2]->deviation) /
                                                std::sqrt(sums[0]->variance + sums[2]->variance));
    EXPECT_FALSE(combined_fit(std::span(sums).subspan(1, 1)));
  }
}

TEST(TouchEvidence, RefusesATouchThatIsNotSound) {
  SixElements six;
  six.pressure.pop_back();
  EXPECT_THROW(TouchEvidence(six.touch(), {}), Error);
}

}  // namespace palpate::touch_evidence_test
