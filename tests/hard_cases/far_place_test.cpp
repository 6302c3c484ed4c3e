#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "hard_case.hpp"

namespace palpate::far_place_test {

std::vector<Hypothesis> two_objects() {
  return {{random_map(61, 61, 0.5, 6.0, 441), 1.0}, {random_map(31, 31, 1.0, 6.0, 442), 1.0}};
}

/// Bins of 0.1 mm.
constexpr PoseLattice fine_lattice{
    .x_mm = {-1.0, 1.0, 20}, .y_mm = {-0.5, 0.5, 10}, .theta_rad = {0.0, two_pi, 4}};

struct FarCase {
  std::string name;
  PoseLattice lattice;
  Recording recording;
};

std::vector<FarCase> far_cases() {
  std::vector<FarCase> cases;
  const Recording near = random_recording(4, 36, 443);
  for (const glm::dvec2 away_mm : {glm::dvec2(1e6, -1e6), glm::dvec2(-1e6, 0.0)}) {
    cases.push_back({fmt::format("poses at {:.0e}, {:.0e} mm, with a pivot, in bins of 0.1 mm",
                                 away_mm.x, away_mm.y),
                     fine_lattice, moved(near, {away_mm, 0.0})});
    cases.back().lattice.pivot_mm = away_mm;
  }
  cases.push_back({"objects 1e6 mm from the robot's origin, without a pivot",
                   {{-1e6 - 1.0, -1e6 + 1.0, 20}, {1e6 - 0.5, 1e6 + 0.5, 10}, {0.0, 0.0, 1}, {}},
                   moved(random_recording(4, 36, 444), {{1e6, -1e6}, 0.0})});
  cases.push_back({"angles of 1e6 turns, of sensor and region", fine_lattice, near});
  cases.back().lattice.theta_rad = {1e6 * two_pi, 1e6 * two_pi + two_pi, 4};
  for (std::size_t i = 0; i < near.size(); ++i) {
    cases.back().recording.T_robot_sensor[i].theta_rad += (i % 2 == 0 ? 1e6 : -1e6) * two_pi;
  }
  return cases;
}

TEST(FarPlace, AgreesWithFloat64) {
  const std::vector<Hypothesis> objects = two_objects();
  for (const auto& [name, lattice, recording] : far_cases()) {
    HardCase hard(name);
    HardCase bounds("bounds: " + name);
    const Estimate estimate =
        hard.expect_posterior(objects, {.lattice = lattice}, all_touches(recording));
    EXPECT_GT(std::abs(estimate.mode.log_likelihood), 1.0) << "off the map";
    // 1e-10 mm of 1e6 mm are 2e-10 cells of 12 nats, times 150 elements and turns.
    bounds.expect_laws(objects, HistogramOptions{.lattice = lattice}, recording, 1e-5);
  }
}

TEST(FarPlace, OfParticles) {
  HardCase hard("particles: 1e6 mm from the robot's origin, with a pivot, after 1e6 turns");
  const glm::dvec2 away_mm(1e6, -1e6);
  ParticleOptions about = two_thousand_particles(away_mm);
  about.region.theta_rad = {1e6 * two_pi, 1e6 * two_pi + two_pi, 1};
  const Recording far = moved(random_recording(4, 36, 443), {away_mm, 0.0});
  EXPECT_NE(hard.expect_particles(two_objects(), about, far).estimate().identity[0], 0.5)
      << "off the map";
}

}  // namespace palpate::far_place_test
