#include "learning/press_placement.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "model/contact_readings.hpp"
#include "palpate/error.hpp"
#include "palpate/reading_layer.hpp"
#include "simulated_presses.hpp"
#include "support/synthetic.hpp"

namespace palpate::press_placement_test {

/// Expects of a press on a map the log-likelihood of the best of all bins, and about the evidence,
/// that the reference has.
PressPlacement expect_best(const Press& press, const Hypothesis& hypothesis,
                           const ContactModel& contact, const PoseLattice& lattice,
                           double evidence_nats) {
  const OccupancyGrid& map = hypothesis.compared();
  const std::vector<double> nats =
      reference::log_likelihoods(press.touches, lattice, map, tabulated(contact));
  const double best = *std::ranges::max_element(nats);
  double sum = 0.0;
  for (const double x : nats) {
    sum += std::exp(x - best);
  }
  const PressPlacement found =
      PressPlacer(hypothesis, contact, lattice).place(evidence_of(press.touches, contact));
  EXPECT_NEAR(found.log_likelihood, best, 1e-6);
  EXPECT_NEAR(found.log_evidence, best + std::log(sum / static_cast<double>(nats.size())),
              evidence_nats);
  return found;
}

TEST(PressPlacer, FindsTheBestBinOfTheReference) {
  SimulatedPresses simulated;
  simulated.add(on_letter_l, "L", 4, 21);
  // Dead elements, and Unknown ones: between the threshold and the ratio of the largest.
  simulated.recordings[2].valid.assign(196, 1);
  for (std::size_t e = 0; e < 20; ++e) {
    simulated.recordings[2].valid[9 * e] = 0;
    simulated.recordings[3].pressure[7 * e] = 2.5;
  }
  const Hypothesis hypothesis{.map = map_of(on_letter_l, "L")};
  const PoseLattice lattice{.x_mm = {-5.0, 5.0, 7},
                            .y_mm = {-4.0, 6.0, 6},
                            .theta_rad = {0.0, two_pi, 16},
                            .pivot_mm = {0.5, -1.0}};
  const ContactModel contact{.prior = hypothesis.map.prior};
  for (const Recording& recording : simulated.recordings) {
    SCOPED_TRACE(recording.path);
    const Press press = single_press(recording, 0);
    const PressPlacement found = expect_best(press, hypothesis, contact, lattice, 0.05);
    EXPECT_NEAR(reference::log_likelihood(press.touches[0], found.T_object_robot, hypothesis.map,
                                          tabulated(contact)),
                found.log_likelihood, 1e-6);
  }
}

TEST(PressPlacer, TakesTouchesAtPosesAndATableOverALayer) {
  const OccupancyGrid map = map_of(on_letter_l, "L");
  const Hypothesis hypothesis{.map = map, .layer = reading_layer(map, {})};
  ContactModel contact{.prior = probability_from_log_odds(ReadingLayer::beyond)};
  LikelihoodTable table{.first_log_odds = -16.0, .last_log_odds = 8.0, .nodes = 49};
  for (int node = 0; node < 98; ++node) {
    table.log_likelihood.push_back(node < 49 ? -0.05 * (node % 49) : -3.0 + 0.06 * (node % 49));
  }
  contact.table = table;
  const PoseLattice lattice{
      .x_mm = {-6.0, 6.0, 9}, .y_mm = {-6.0, 6.0, 9}, .theta_rad = {0.0, two_pi, 16}};
  const Recording first = touches_of(on_letter_l, {{1.0, 0.5}, 0.8}, 4, 22);
  const Recording second = touches_of(on_letter_l, {{-1.0, 1.5}, 2.8}, 6, 23);
  PressPlacer placer(hypothesis, contact, lattice);
  for (const Recording* recording : {&first, &second, &first}) {  // one placer, several presses
    const Press press{.name = "touches", .label = "L", .touches = all_touches(*recording)};
    EXPECT_EQ(placer.place(evidence_of(press.touches, contact)).log_likelihood,
              expect_best(press, hypothesis, contact, lattice, 0.3).log_likelihood);
  }
}

TEST(PressPlacer, OfASingleBinEvaluatesItAndRefusesWhatIsTooFarAway) {
  SimulatedPresses simulated;
  simulated.add(on_disc, "disc", 1, 24);
  const Hypothesis hypothesis{.map = map_of(on_disc, "disc")};
  const ContactModel contact{.prior = hypothesis.map.prior};
  const PoseLattice lattice{
      .x_mm = {1.0, 1.0, 1}, .y_mm = {0.0, 0.0, 1}, .theta_rad = {0.2, 0.2, 1}};
  std::vector<Touch>& touches = simulated.presses[0].touches;
  const PressPlacement found =
      PressPlacer(hypothesis, contact, lattice).place(evidence_of(touches, contact));
  EXPECT_NEAR(found.log_evidence, found.log_likelihood, 1e-12);
  EXPECT_NEAR(found.T_object_robot.translation_mm.x, 1.0, 1e-12);
  touches[0].T_robot_sensor.translation_mm = {1e8, 0.0};
  PressPlacer placer(hypothesis, contact, {});
  EXPECT_THROW(placer.place(evidence_of(touches, contact)), Error);
}

}  // namespace palpate::press_placement_test
