

#include <gtest/gtest.h>

#include "model/touch_evidence.hpp"
#include "palpate/touch.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate::touch_test {

TEST(DigitactsArray, HasTheGeometryOfTwoPadsSideBySide) {
  const std::vector<glm::dvec2> elements = digitacts_array();
  ASSERT_EQ(elements.size(), 36U);
  // 2.2 mm across the join of the pads, 1.9 mm within a pad.
  EXPECT_EQ(elements[0], glm::dvec2(-1.1 - 2 * 1.9, -2.5 * 1.9));
  EXPECT_EQ(elements[1], glm::dvec2(-3.0, -4.75));
  EXPECT_EQ(elements[5], glm::dvec2(4.9, -4.75));
  EXPECT_EQ(elements[6], glm::dvec2(-4.9, -1.5 * 1.9));
  EXPECT_EQ(elements[35], glm::dvec2(4.9, 4.75));
  // 11.6 x 11.3 mm in all, from outer edge to outer edge.
  EXPECT_NEAR(elements[35].x - elements[0].x + digitacts_element_mm, 11.6, 1e-12);
  EXPECT_NEAR(elements[35].y - elements[0].y + digitacts_element_mm, 11.3, 1e-12);
}

TEST(ArrayReach, IsTheDistanceOfTheFarthestElementFromTheCentre) {
  const std::vector<glm::dvec2> elements{{97.0, 4.0}, {103.0, -4.0}, {100.0, 3.0}};
  EXPECT_EQ(array_centre_mm(elements), glm::dvec2(100.0, 0.0));
  EXPECT_EQ(array_reach_mm(elements), 5.0);
  EXPECT_EQ(array_centre_mm({}), glm::dvec2(0.0, 0.0));
  EXPECT_EQ(array_reach_mm({}), 0.0);
}

/// Three touches of two elements, with pressures 0, 1, 2, ...
Recording small_recording() {
  Recording r;
  r.T_robot_sensor = {{}, {{1.0, 2.0}, 3.0}, {}};
  r.pressure = {0.0, 1.0, 2.0, 3.0, 4.0, 5.0};
  r.elements_mm = {{-1.0, 0.0}, {1.0, 0.0}};
  return r;
}

TEST(Recording, ViewsTouchesOfAnArrayThatStays) {
  const Recording r = small_recording();
  const Touch touch = r.touch(1);
  EXPECT_EQ(r.size(), 3U);
  EXPECT_EQ(r.elements(), 2U);
  EXPECT_EQ(Recording{}.elements(), 0U);
  EXPECT_EQ(touch.T_robot_sensor.theta_rad, 3.0);
  EXPECT_EQ(touch.pressure[0], 2.0);
  EXPECT_EQ(touch.pressure[1], 3.0);
  EXPECT_EQ(touch.elements_mm[1], glm::dvec2(1.0, 0.0));
  EXPECT_TRUE(touch.valid.empty());
  const std::vector<Touch> touches = r.touches(1, 3);
  ASSERT_EQ(touches.size(), 2U);
  EXPECT_EQ(touches[0].pressure[0], 2.0);
  EXPECT_EQ(touches[1].pressure[0], 4.0);
  EXPECT_LE(touches.capacity(), 2U) << "each frame of a long recording is an unknown of its own";
  EXPECT_TRUE(r.touches(2, 2).empty());
  input_error([&] { r.touches(0, 4); });
  for (const std::size_t list : {0U, 1U, 2U}) {
    Recording other = r;  // of lists that disagree
    other.pressure.resize(list == 0 ? 5 : 6);
    other.elements_mm.resize(list == 1 ? 1 : 2);
    other.valid.resize(list == 2 ? 1 : 0);
    expect_named(input_error([&] { other.touch(0); }), {"touch 0 of 3 poses"});
  }
}

TEST(Recording, ViewsTheRowOfAnArrayAndOfDeadElementsThatChange) {
  Recording r = small_recording();
  r.elements_mm = {{0, 0}, {0, 1}, {1, 0}, {1, 1}, {2, 0}, {2, 1}};
  r.valid = {1, 1, 1, 0, 0, 1};
  EXPECT_EQ(r.touch(2).elements_mm[1], glm::dvec2(2.0, 1.0));
  EXPECT_EQ(r.touch(1).valid[1], 0);
  EXPECT_EQ(r.touch(2).valid[0], 0);
  r.valid = {0, 1};
  EXPECT_EQ(r.touch(2).valid[0], 0) << "one row holds for all touches";
}

/// Six elements 2 mm apart: in contact, below the ratio, a negative pressure, no number, dead, and
/// in contact again.
struct SixElements {
  std::vector<glm::dvec2> elements_mm{{-5, 1}, {-3, 1}, {-1, 1}, {1, 1}, {3, 1}, {5, 1}};
  std::vector<double> pressure{20.0, 5.0, -1.0, nan, 50.0, 10.0};
  std::vector<std::uint8_t> valid{1, 1, 1, 1, 0, 1};

  Touch touch(double theta_rad = 0.5 * two_pi) const {
    return {.T_robot_sensor = {{100.0, 50.0}, theta_rad},
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

  const TouchEvidence known = evidence.known();
  EXPECT_EQ(known.readings, (std::vector{in, no, in}));
  EXPECT_EQ(known.elements_mm,
            (std::vector<glm::dvec2>{six.elements_mm[0], six.elements_mm[2], six.elements_mm[5]}));
  EXPECT_EQ(known.lives, (std::vector<std::uint8_t>{1, 1, 1}));
  const TouchEvidence contact = known.contact();
  EXPECT_EQ(contact.readings, (std::vector{in, in}));
  EXPECT_EQ(contact.elements_mm, (std::vector<glm::dvec2>{six.elements_mm[0], six.elements_mm[5]}));
}

TEST(TouchEvidence, OfDeadElementsHasNoPressureAndOfTooFewPressuresIsRefused) {
  SixElements six;
  six.valid.assign(6, 0);
  const TouchEvidence evidence(six.touch(), {});
  EXPECT_FALSE(evidence.in_contact());
  EXPECT_GT(evidence.least_pressure, evidence.largest_pressure);
  EXPECT_EQ(evidence.force, 0.0);
  EXPECT_TRUE(evidence.known().readings.empty());
  six.pressure.pop_back();
  input_error([&] { TouchEvidence(six.touch(), {}); });
}

TEST(FitSums, AreOfEachTouchAndAddUp) {
  const OccupancyGrid map = random_map(31, 27, 0.5, 6.0, 481);
  const ContactModel contact{.prior = 0.2};
  const SixElements six;
  std::vector<TouchEvidence> touches;
  for (const double theta_rad : {0.0, 1.0, 2.0}) {
    touches.emplace_back(six.touch(theta_rad), contact);
  }
  std::ranges::fill(touches[1].readings, Reading::unknown);
  const Pose pose{{1.0, -2.0}, 0.5};
  for (const DisplacementSd& sd : {DisplacementSd{}, DisplacementSd{.mm = 0.5, .rad = 0.05}}) {
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

}  // namespace palpate::touch_test
