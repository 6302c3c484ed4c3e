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

struct Exhaustive {
  double best = -INFINITY;
  double log_evidence = 0.0;
};

/// What the reference says over all bins.
Exhaustive over_all_bins(const Press& press, const OccupancyGrid& map, const ContactModel& contact,
                         const PoseLattice& lattice) {
  const std::vector<double> nats =
      reference::log_likelihoods(press.touches, lattice, map, tabulated(contact));
  Exhaustive found{.best = *std::ranges::max_element(nats)};
  double sum = 0.0;
  for (const double x : nats) {
    sum += std::exp(x - found.best);
  }
  found.log_evidence = found.best + std::log(sum / static_cast<double>(nats.size()));
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
  const OccupancyGrid map = map_of(on_letter_l, "L");
  const PoseLattice lattice{.x_mm = {-5.0, 5.0, 7},
                            .y_mm = {-4.0, 6.0, 6},
                            .theta_rad = {0.0, two_pi, 16},
                            .pivot_mm = {0.5, -1.0}};
  const ContactModel contact{.prior = map.prior};
  const Hypothesis hypothesis{.map = map};
  PressPlacer placer(hypothesis, contact, lattice);
  for (std::size_t i = 0; i < 4; ++i) {
    const Press press = single_press(simulated.recordings[i], 0);
    const Exhaustive expected = over_all_bins(press, map, contact, lattice);
    const PressPlacement found = placer.place(evidence_of(press.touches, contact));
    EXPECT_NEAR(found.log_likelihood, expected.best, 1e-6) << i;
    EXPECT_NEAR(
        reference::log_likelihood(press.touches[0], found.T_object_robot, map, tabulated(contact)),
        expected.best, 1e-6)
        << i;
    EXPECT_NEAR(found.log_evidence, expected.log_evidence, 0.05) << i;
  }
}

TEST(PressPlacer, TakesTouchesAtPosesAndATableOverALayer) {
  const Recording first = touches_of(on_letter_l, {{1.0, 0.5}, 0.8}, 4, 22);
  const Recording second = touches_of(on_letter_l, {{-1.0, 1.5}, 2.8}, 6, 23);
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
  PressPlacer placer(hypothesis, contact, lattice);
  for (const Recording* recording : {&first, &second, &first}) {
    const Press press{.name = "touches", .label = "L", .touches = all_touches(*recording)};
    const Exhaustive expected = over_all_bins(press, *hypothesis.layer, contact, lattice);
    const PressPlacement found = placer.place(evidence_of(press.touches, contact));
    EXPECT_NEAR(found.log_likelihood, expected.best, 1e-6);
    EXPECT_NEAR(found.log_evidence, expected.log_evidence, 0.3);
  }
}

TEST(PressPlacer, OfASingleBinEvaluatesIt) {
  SimulatedPresses simulated;
  simulated.add(on_disc, "disc", 1, 24);
  const OccupancyGrid map = map_of(on_disc, "disc");
  const ContactModel contact{.prior = map.prior};
  const PoseLattice lattice{
      .x_mm = {1.0, 1.0, 1}, .y_mm = {0.0, 0.0, 1}, .theta_rad = {0.2, 0.2, 1}};
  const Hypothesis hypothesis{.map = map};
  const PressPlacement found = PressPlacer(hypothesis, contact, lattice)
                                   .place(evidence_of(simulated.presses[0].touches, contact));
  EXPECT_NEAR(found.log_evidence, found.log_likelihood, 1e-12);
  EXPECT_NEAR(found.T_object_robot.translation_mm.x, 1.0, 1e-12);
}

TEST(PressPlacer, RefusesWhatIsTooFarAway) {
  SimulatedPresses simulated;
  simulated.add(on_disc, "disc", 1, 25);
  simulated.presses[0].touches[0].T_robot_sensor.translation_mm = {1e8, 0.0};
  const OccupancyGrid map = map_of(on_disc, "disc");
  const Hypothesis hypothesis{.map = map};
  const ContactModel contact{.prior = map.prior};
  PressPlacer placer(hypothesis, contact, {});
  EXPECT_THROW(placer.place(evidence_of(simulated.presses[0].touches, contact)), Error);
}

}  // namespace palpate::press_placement_test
