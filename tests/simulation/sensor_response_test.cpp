#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/contact.hpp"
#include "palpate/simulation.hpp"

namespace palpate::sensor_response_test {

/// No randomness: what is left is the displacement field and the element's area.
SensorModel exact(double psf_mm) {
  return {.psf_mm = psf_mm, .force_spread = 0.0, .gain_spread = 0.0, .noise_kpa = 0.0};
}

/// The half-plane's edge, off the lines of the simulator's 0.1 mm grid, which starts at the shape's
/// lower left corner.
constexpr double edge_x_mm = 0.0371;

Shape rectangle(const glm::dvec2& lower, const glm::dvec2& upper) {
  return {.label = "rectangle",
          .strokes = {},
          .polygons = {{lower, {upper.x, lower.y}, upper, {lower.x, upper.y}}}};
}

/// Everything at x < edge_x_mm, as far as any element of these tests can feel.
Shape left_half_plane() { return rectangle({-30.0, -30.0}, {edge_x_mm, 30.0}); }

/// Twice the antiderivative, of second order, of the standard normal distribution function.
double twice_integrated_normal(double t) {
  const double density = std::exp(-t * t / 2.0) / std::sqrt(2.0 * std::numbers::pi);
  return (t * t + 1.0) * std::erfc(-t / std::numbers::sqrt2) / 2.0 + t * density;
}

/// Mean over a square, its centre x beyond the edge, of the blurred half-plane normal(-x / psf).
/// Along x the square is a box of width edge |cos| convolved with one of edge |sin|.
double edge_response(double x_mm, double theta_rad, double edge_mm, double psf_mm) {
  const double a = std::max(1e-3, edge_mm / 2.0 * std::abs(std::cos(theta_rad))) / psf_mm;
  const double b = std::max(1e-3, edge_mm / 2.0 * std::abs(std::sin(theta_rad))) / psf_mm;
  const double t = -x_mm / psf_mm;
  return (twice_integrated_normal(t + a + b) - twice_integrated_normal(t + a - b) -
          twice_integrated_normal(t - a + b) + twice_integrated_normal(t - a - b)) /
         (8.0 * a * b);
}

TEST(SensorResponse, FollowsTheErrorFunctionAcrossAnEdge) {
  for (const double psf_mm : {0.5, 1.0, 2.0}) {
    const SensorModel model = exact(psf_mm);
    Simulator simulator(left_half_plane(), model, {{0.0, 0.0}}, 1);
    for (const double degrees : {0.0, 20.0, 45.0, 90.0, 200.0}) {
      const double theta_rad = degrees * std::numbers::pi / 180.0;
      for (double x_mm = -6.0; x_mm <= 6.0; x_mm += 0.37) {
        const Recording r = simulator.touch({{{x_mm, 1.3}, theta_rad}}, {});
        const double expected = model.pressure_kpa * edge_response(x_mm - edge_x_mm, theta_rad,
                                                                   model.element_mm, psf_mm);
        // A thousandth of the nominal pressure. The 0.1 mm grid widens the point spread by its own
        // width, which costs most, 0.016 kPa, where the spread is narrowest.
        EXPECT_NEAR(r.pressure[0], expected, 0.02)
            << "psf " << psf_mm << ", " << degrees << " degrees, x = " << x_mm;
      }
    }
  }
}

TEST(SensorResponse, WithoutPointSpreadIsTheCoveredPartOfTheElement) {
  const SensorModel model = exact(0.0);
  Simulator simulator(left_half_plane(), model, {{0.0, 0.0}}, 1);
  for (double x_mm = -1.5; x_mm <= 1.5; x_mm += 0.07) {
    const Recording r = simulator.touch({{{x_mm, 0.0}, 0.0}}, {});
    const double covered = std::clamp(0.5 - (x_mm - edge_x_mm) / model.element_mm, 0.0, 1.0);
    // Grid and samples are 0.1 mm apart and place the edge to 0.03 mm, of 20 kPa per 1.8 mm.
    EXPECT_NEAR(r.pressure[0], model.pressure_kpa * covered, 0.3) << "x = " << x_mm;
  }
}

TEST(SensorResponse, ConservesTheShapesArea) {
  // Elements that tile the plane see every part of the shape exactly once, blurred or not.
  const double element_mm = digitacts_element_mm;
  const std::vector<glm::dvec2> tiling = grid_array(31, 31, element_mm);
  const double ring_mm2 = std::numbers::pi * (9.0 * 9.0 - 6.0 * 6.0);
  for (const auto& [shape, shape_mm2] :
       {std::pair{make_shape("ring"), ring_mm2},
        {rectangle({-9.0, -6.0}, {9.0, 6.0}), 18.0 * 12.0}}) {  // all edges on its bounding box
    for (const double psf_mm : {0.0, 0.02, 1.0, 2.5}) {
      Simulator simulator(shape, exact(psf_mm), tiling, 1);
      const Recording r = simulator.touch({{{0.4, -0.3}, 0.5}}, {});
      const double sum = std::accumulate(r.pressure.begin(), r.pressure.end(), 0.0);
      // The ring's 2-degree chords and the sampling of the elements, together below one in 500.
      EXPECT_NEAR(sum / 20.0 * element_mm * element_mm, shape_mm2, shape_mm2 / 500.0)
          << shape.label << ", psf " << psf_mm;
    }
  }
}

TEST(SensorResponse, ClassifierIsRightAboutNineTimesInTen) {
  const ContactClassifier classifier{.threshold = 2.0, .ratio = 0.3};
  int known = 0;
  int right = 0;
  for (const char* letter : {"A", "E", "I", "O", "U"}) {
    const Shape shape = make_shape(letter);
    Simulator simulator(shape, SensorModel{}, digitacts_array(), 7);
    const Recording recording = simulator.touch(training_grid(), {});
    for (const Touch& touch : recording.touches(0, recording.size())) {
      for (const ElementReading& element : known_readings(touch, classifier)) {
        ++known;
        right += shape.contains(element.position_mm) == (element.reading == Reading::in_contact);
      }
    }
  }
  // The paper's informal figure is 90%; this font and seed give 92%.
  EXPECT_GT(right, 0.89 * known);
  EXPECT_LT(right, 0.94 * known);
  // The classifier answers in most cases, here in 88% of 34,560.
  EXPECT_GT(known, 0.8 * 5 * 192 * 36);
}

}  // namespace palpate::sensor_response_test
