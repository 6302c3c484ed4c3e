#include "palpate/map_builder.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "beliefs.hpp"
#include "likelihood_cases.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate::map_builder_test {

// What the method allows a map with a finite support to differ from the uncut sum, in nats.
constexpr double map_tolerance = 1e-3;
// Two orders of adding the same increments: both are summed in two floats, and rounded to one
// float32 below 64 nats, whose last digit is 4e-6.
constexpr double rounding = 1e-5;

OccupancyGrid build(std::span<const Touch> touches, const MapOptions& options = {}) {
  MapBuilder builder(shared_device(), options);
  builder.add(touches);
  return builder.build("made up");
}

/// Expects the map of a recording to be the uncut sum, around the map too, and its origin to be a
/// whole multiple of the cell.
void expect_reference(const std::string& name, const Recording& recording,
                      const MapOptions& options) {
  const std::vector<Touch> touches = all_touches(recording);
  const OccupancyGrid map = build(touches, options);
  EXPECT_LT(map_error(map, touches, options), map_tolerance) << name;
  for (const double origin_mm : {map.origin_mm.x, map.origin_mm.y}) {
    EXPECT_EQ(origin_mm, map.cell_mm * std::round(origin_mm / map.cell_mm)) << name;
  }
}

TEST(MapBuilder, AgreesWithTheUncutSum) {
  for (const std::size_t elements : {1U, 7U, 36U, 37U, 63U, 65U, 256U, 1400U}) {
    expect_reference(fmt::format("{} elements", elements), random_recording(2, elements, elements),
                     {.cell_mm = 1.0});
  }
  const Recording recording = random_recording(1, 36, 8);
  for (const double cell_mm : {0.1, 0.37, 0.5, 1.0, 5.0}) {
    for (const double spread_mm : {0.25, 0.5, 2.0}) {
      expect_reference(fmt::format("cells of {} mm, spread {} mm", cell_mm, spread_mm), recording,
                       {.cell_mm = cell_mm, .sensor = {.spread_mm = spread_mm}});
    }
  }
  for (const double peak : {0.05, 0.5, 0.9, 0.99}) {
    for (const double prior : {0.01, 0.2, 0.5, 0.95}) {
      expect_reference(fmt::format("peak {}, prior {}", peak, prior), recording,
                       {.cell_mm = 0.5, .sensor = {.peak = peak, .prior = prior}});
    }
  }
  for (const bool along_x : {true, false}) {
    Recording row = random_recording(1, 65, 10);
    row.T_robot_sensor[0] = {};
    for (std::size_t k = 0; k < 65; ++k) {
      const double at_mm = 5.0 * static_cast<double>(k);
      row.elements_mm[k] = along_x ? glm::dvec2(at_mm, 0.1) : glm::dvec2(0.1, at_mm);
    }
    expect_reference(along_x ? "65 x 1 cells" : "1 x 65 cells", row, {.cell_mm = 5.0});
  }
  expect_reference("far from the origin", moved(recording, {{1e6, -1e6}, 1e6 * two_pi + 2.0}), {});
  expect_reference("an array that changes and has dead elements", changing_array(), {});
}

TEST(MapBuilder, CoversTheKnownElementsAndTheirSupportAndNoMore) {
  Recording recording = random_recording(1, 3, 15);
  recording.T_robot_sensor[0] = {};
  recording.elements_mm = {{0.0, 0.0}, {10.0, 4.0}, {500.0, 500.0}};
  recording.pressure = {20.0, 0.0, 3.0};  // In Contact, No Contact, Unknown
  const MapOptions options;
  const OccupancyGrid map = build(all_touches(recording), options);
  const glm::dvec2 last = map.centre_mm(map.nx - 1, map.ny - 1);
  // 8 spreads are beyond any increment that counts.
  EXPECT_GT(map.origin_mm.x, -8.0 * 0.5);
  EXPECT_GT(map.origin_mm.y, -8.0 * 0.5);
  EXPECT_LT(last.x, 10.0 + 8.0 * 0.5);
  EXPECT_LT(last.y, 4.0 + 8.0 * 0.5);
  EXPECT_EQ(map.label, "made up");
  EXPECT_EQ(map.prior, options.sensor.prior);
  EXPECT_EQ(map.symmetry, 1);
}

void expect_same_map(const OccupancyGrid& a, const OccupancyGrid& b, double tolerance) {
  ASSERT_EQ(a.origin_mm, b.origin_mm);
  ASSERT_EQ(a.nx, b.nx);
  ASSERT_EQ(a.ny, b.ny);
  for (std::size_t i = 0; i < a.log_odds.size(); ++i) {
    ASSERT_NEAR(a.log_odds[i], b.log_odds[i], tolerance) << "cell " << i;
  }
}

TEST(MapBuilder, OrderAndGroupingOfTouchesDoNotMatter) {
  const Recording recording = random_recording(24, 36, 17);
  const std::vector<Touch> touches = all_touches(recording);
  const std::vector<Touch> reversed(touches.rbegin(), touches.rend());
  const OccupancyGrid map = build(touches);
  expect_same_map(map, build(reversed), rounding);
  MapBuilder builder(shared_device(), {});
  for (const Touch& touch : touches) {
    builder.add(std::span(&touch, 1));
  }
  expect_same_map(map, builder.build("made up"), 0.0);
  expect_same_map(map, builder.build("made up"), 0.0);
}

TEST(MapBuilder, TouchesOfOneSpotKeepTheirDigitsAsTheyAddUp) {
  // Rounding errors of equal increments all have one sign: a plain float32 sum would drift, the
  // more the more sums there are, of single touches above all.
  constexpr int batches = 2;
  constexpr int batch_size = 70'000;  // more than llvmpipe's loops may count
  constexpr int one_by_one = 10'000;
  for (const Reading reading : {Reading::in_contact, Reading::no_contact}) {
    std::vector<glm::dvec2> elements{{0.13, 0.07}};
    std::vector<double> pressure{10.0};
    if (reading == Reading::no_contact) {
      // An element that is alone reads the largest pressure, which is never No Contact.
      elements.emplace_back(20.13, 0.07);
      pressure = {0.1, 10.0};
    }
    const MapOptions options{.cell_mm = 0.25};
    const Touch touch{.T_robot_sensor = {}, .elements_mm = elements, .pressure = pressure};
    const std::vector<Touch> batch(batch_size, touch);
    MapBuilder builder(shared_device(), options);
    for (int i = 0; i < batches; ++i) {
      builder.add(batch);
    }
    for (int i = 0; i < one_by_one; ++i) {
      builder.add(std::span(&touch, 1));
    }
    const OccupancyGrid map = builder.build("spot");
    double worst = 0.0;
    for (int j = 0; j < map.ny; ++j) {
      for (int i = 0; i < map.nx; ++i) {
        const glm::dvec2 d = map.centre_mm(i, j) - elements.front();
        if (d.x > 10.0) {
          break;  // the other element's cells
        }
        const double expected =
            map.prior_log_odds() +
            1.0 * (batches * batch_size + one_by_one) *
                reference::increment(reading, std::hypot(d.x, d.y), options.sensor);
        worst =
            std::max(worst, std::abs(map.at(i, j) - expected) / (1e-3 + 5e-6 * std::abs(expected)));
      }
    }
    EXPECT_LT(worst, 1.0) << "of 1e-3 nats, for what is cut off, and a relative 5e-6";
  }
}

TEST(MapBuilder, OfTouchesOneOfWhichCannotBeMappedNoneIsTakenIn) {
  Recording recording = random_recording(4, 36, 176);
  const std::vector<Touch> sound = all_touches(recording);
  const OccupancyGrid map = build(std::span(sound).first(2));
  Device least = lowered_device([](gpu::Limits& limits) { limits.storage_range = 1 << 27; });
  MapBuilder builder(least, {});
  builder.add(std::span(sound).first(1));
  const auto refuse = [&](const Pose& T_robot_sensor, const char* says) {
    std::vector<Touch> touches(sound.begin() + 1, sound.end());
    touches[2].T_robot_sensor = T_robot_sensor;
    expect_named(input_error([&] { builder.add(touches); }), {says});
  };
  refuse({{infinity, 0.0}, 0.0}, "T_robot_sensor is not finite");
  refuse({{1e300, 0.0}, 0.0}, "touch 2: an element at [1e+300");
  refuse({{-1.1e9, 0.0}, 0.0}, "within 1e+09 mm");
  refuse({{1e9 - 10.0, 0.0}, 0.0}, "use larger cells");  // too many cells to count
  refuse({{1e4, 1e4}, 0.0}, "use larger cells");         // more than the device binds
  builder.add(std::span(sound).subspan(1, 1));
  expect_same_map(builder.build("made up"), map, 0.0);
  expect_named(input_error([&] { builder.build("(none)"); }), {"(none)"});
}

TEST(MapBuilder, GrowsWithWhatIsTouched) {
  const Recording recording = random_recording(3, 4, 177);
  std::vector<Touch> touches = all_touches(recording);
  // Touched from left to right, in cells of 8 bytes: what is needed in the end just fits.
  const MapOptions options{.cell_mm = 0.25};
  touches[0].T_robot_sensor = {{0.0, 0.0}, 0.0};
  touches[1].T_robot_sensor = {{10.0, 0.0}, 0.0};
  touches[2].T_robot_sensor = {{80.0, 0.0}, 0.0};
  const OccupancyGrid map = build(touches, options);
  Device least =
      lowered_device([&](gpu::Limits& limits) { limits.storage_range = map.log_odds.size() * 8; });
  MapBuilder builder(least, options);
  for (const Touch& touch : touches) {
    builder.add(std::span(&touch, 1));
    builder.build("made up");
  }
  expect_same_map(builder.build("made up"), map, map_tolerance);
}

TEST(MapBuilder, TouchesWithoutAKnownElementMakeNoMap) {
  Recording recording = random_recording(2, 36, 21);
  recording.pressure.assign(recording.pressure.size(), 0.0);
  for (const std::vector<Touch>& touches : {std::vector<Touch>{}, all_touches(recording)}) {
    expect_named(input_error([&] { build(touches); }), {"'made up'", "threshold"});
  }
}

/// One touch of a 20 x 20 mm array of 0.5 mm pitch; a disc about its centre is in contact.
Recording touch_of_disc(double radius_mm) {
  Recording recording;
  recording.T_robot_sensor.resize(1);
  for (int j = -20; j <= 20; ++j) {
    for (int i = -20; i <= 20; ++i) {
      recording.elements_mm.emplace_back(0.5 * i, 0.5 * j);
      recording.pressure.push_back(std::hypot(0.5 * i, 0.5 * j) < radius_mm ? 10.0 : 0.0);
    }
  }
  return recording;
}

/// The fraction of the modelled area that lies nearest to elements in contact. The evidence of the
/// outermost rows, 2.5 elements' 2 * 0.9 exp(-d^2 / (2 * 0.5^2)), fades to 1e-3 at d = 2 mm.
double fraction(const Recording& recording) {
  constexpr double edge_mm = 20.0 + 2.0 * 2.0;
  const auto in_contact = std::count(recording.pressure.begin(), recording.pressure.end(), 10.0);
  return 0.25 * static_cast<double>(in_contact) / (edge_mm * edge_mm);
}

double estimate(std::vector<Recording> recordings) {
  std::vector<ObjectTouches> touches;
  for (const Recording& recording : recordings) {
    touches.push_back({"disc", all_touches(recording)});
  }
  // No cell of 0.2 mm lies halfway between two elements, where contact and no contact cancel out.
  return estimate_prior(shared_device(), touches, {.cell_mm = 0.2});
}

TEST(EstimatePrior, IsTheAreaOfAllObjectsOverTheModelledArea) {
  for (const double radius_mm : {4.0, 6.0, 8.0}) {
    const Recording recording = touch_of_disc(radius_mm);
    // The corners of a disc of square elements lose up to 3% of its area to their neighbours.
    EXPECT_NEAR(estimate({recording}) / fraction(recording), 1.0, 0.04) << radius_mm;
  }
  // Equal modelled areas: the pooled fraction is the mean.
  const double small = estimate({touch_of_disc(3.0)});
  const double large = estimate({touch_of_disc(8.0)});
  EXPECT_NEAR(estimate({touch_of_disc(3.0), touch_of_disc(8.0)}), (small + large) / 2.0, 1e-3)
      << "the half cell that keeps fractions from 0 and 1";
}

TEST(EstimatePrior, StaysBetweenZeroAndOne) {
  Recording all = touch_of_disc(100.0);
  EXPECT_LT(estimate({all}), 1.0);
  EXPECT_GT(estimate({all}), 0.99);
  // A dead element hides the only contact; the largest pressure of the rest makes them No Contact
  // or, the largest itself, Unknown.
  Recording none = touch_of_disc(0.0);
  none.pressure.front() = 1.0;
  EXPECT_GT(estimate({none}), 0.0);
  EXPECT_LT(estimate({none}), 0.01);
  expect_named(input_error([] { estimate({}); }), {"objects = 0: give at least one"});
  const OccupancyGrid drawn{.drawn = true, .nx = 1, .ny = 1, .log_odds = {1.0F}};
  expect_named(input_error([&] { with_prior(shared_device(), drawn, 2.0); }), {"'prior' = 2"});
}

}  // namespace palpate::map_builder_test
