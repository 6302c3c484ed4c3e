// Options, maps and displacements that are out of range are refused by the name of what is wrong.

#include <functional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "beliefs.hpp"
#include "estimation/displacement_weights.hpp"
#include "made_up_sensors.hpp"
#include "palpate/map_builder.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"

namespace palpate::refusal_test {

TEST(MapOptions, OutOfRangeAreRefused) {
  std::vector<std::pair<MapOptions, const char*>> wrong{
      {{.classifier = {.threshold = nan}}, "threshold"}, {{.sensor = {.peak = 1e-7}}, "peak"}};
  for (const double length : {0.0, -0.5, nan, infinity, 1e-7, 1.1e6, 1e154, 1e200}) {
    wrong.push_back({{.cell_mm = length}, "cell"});
  }
  for (const auto& [options, name] : wrong) {
    expect_named(input_error([&] { MapBuilder(shared_device(), options); }), {name});
  }
}

/// What both filters are given.
struct Input {
  std::vector<Hypothesis> objects{{random_map(5, 4, 0.5, 1.0, 122), 1.0}};
  PoseLattice lattice = {};
  ContactModel contact = {};

  OccupancyGrid& map() { return objects[0].map; }
};

TEST(FilterInput, OutOfRangeIsRefused) {
  using Change = std::function<void(Input&)>;
  std::vector<std::pair<const char*, Change>> wrong{
      {"no objects", [](Input& in) { in.objects.clear(); }},
      {"19 log odds", [](Input& in) { in.map().log_odds.pop_back(); }},
      {"threshold", [](Input& in) { in.contact.classifier.threshold = nan; }},
      {"gamma", [](Input& in) { in.contact.gamma = 1.0; }},
      {"prior", [](Input& in) { in.contact.prior = 0.0; }},
      {"differs from 0.3",
       [](Input& in) { in.objects.push_back(in.objects[0]), in.map().prior = 0.3; }},
      {"2 objects, but there are 1", [](Input& in) { in.contact = random_table(2); }},
      {"pivot_mm", [](Input& in) { in.lattice.pivot_mm.x = infinity; }}};
  for (const double weight : {0.0, -1.0, nan, infinity}) {
    wrong.emplace_back("weight", [=](Input& in) { in.objects[0].weight = weight; });
  }
  for (const auto& [name, change] : wrong) {
    SCOPED_TRACE(name);
    Input in;
    change(in);
    const HistogramOptions bins{.lattice = in.lattice, .contact = in.contact};
    expect_named(input_error([&] { PoseHistogram(shared_device(), in.objects, bins); }), {name});
    const ParticleOptions particles{.particles = 10, .region = in.lattice, .contact = in.contact};
    expect_named(input_error([&] { ParticleFilter(shared_device(), in.objects, particles); }),
                 {name});
  }
}

TEST(HistogramOptions, OutOfRangeAreRefused) {
  std::vector<Hypothesis> objects = three_objects();
  std::vector<std::pair<HistogramOptions, const char*>> wrong{
      {{.lattice = {.x_mm = {-10.0, 10.0, 0}}}, "x_mm"},
      {{.lattice = {}, .touch_sd = {.mm = -1.0}}, "touch_sd mm"},
      {{.lattice = {}, .touch_sd = {.rad = nan}}, "touch_sd rad"},
      {{.lattice = {}, .slip_sd = {.mm = 30.0}}, "slip_sd mm"}};
  for (const double weight : {0.0, -1.0, nan, infinity}) {
    wrong.push_back({{.lattice = {}, .none_weight = weight}, "none_weight"});
  }
  for (const auto& [options, name] : wrong) {
    expect_named(input_error([&] { PoseHistogram(shared_device(), objects, options); }), {name});
  }
  objects[0].map.prior = 0.3;
  EXPECT_NO_THROW(
      PoseHistogram(shared_device(), objects, {.lattice = {}, .contact = {.prior = 0.25}}))
      << "maps of several priors, where one is given";
}

TEST(ParticleOptions, OutOfRangeAreRefused) {
  std::vector<std::pair<ParticleOptions, const char*>> wrong{
      {{.region = {}, .alpha_fast = 1.1}, "alpha_fast = "},
      {{.region = {.y_mm = {0.0, 2e5, 1}}}, "region y_mm = "}};
  for (const int n : {0, -1, 1'000'001}) {
    wrong.push_back({{.particles = n, .region = {}}, "particles = "});
  }
  for (const double deviation : {-1.0, nan, 1e9}) {
    wrong.push_back({{.region = {}, .motion_mm = deviation}, "motion_mm = "});
    wrong.push_back({{.region = {}, .motion_rad = deviation}, "motion_rad = "});
  }
  for (const double rate : {-0.1, 0.0, 0.5, nan}) {
    wrong.push_back({{.region = {}, .alpha_slow = rate}, "alpha_slow = "});
  }
  for (const auto& [options, name] : wrong) {
    expect_named(input_error([&] { ParticleFilter(shared_device(), three_objects(), options); }),
                 {name});
  }
}

constexpr PoseLattice region{
    .x_mm = {-10.0, 10.0, 5}, .y_mm = {-4.0, 4.0, 5}, .theta_rad = {0.0, 1.0, 5}};

void check(const DisplacementSd& sd, const PoseLattice& lattice = region) {
  validate_displacement(sd, lattice, "touch_sd");
}

TEST(DisplacementCheck, TakesWhatTheRegionHoldsAndNamesWhatCannotBeMeant) {
  for (const DisplacementSd& sd :
       {DisplacementSd{}, DisplacementSd{.mm = 8.0}, DisplacementSd{.rad = 1.0},
        DisplacementSd{.mm = 1e-300, .rad = 0.05}}) {
    EXPECT_NO_THROW(check(sd));
  }
  for (const double wrong : {-1.0, nan, infinity, 8.1}) {
    EXPECT_TRUE(input_error([&] { check({.mm = wrong}); }).starts_with("touch_sd mm = ")) << wrong;
    EXPECT_TRUE(input_error([&] { check({.rad = wrong}); }).starts_with("touch_sd rad = "));
  }
  expect_named(input_error([] { check({.mm = 8.1}); }), {"wider than the region, 8 mm"});
}

TEST(DisplacementCheck, LeavesAnAxisOfOneBinAlone) {
  PoseLattice lattice = region;
  lattice.y_mm.count = 1;
  lattice.theta_rad.count = 1;
  EXPECT_NO_THROW(check({.mm = 20.0, .rad = 100.0}, lattice));
  EXPECT_THROW(check({.mm = 20.1}, lattice), Error);
  lattice.x_mm.count = 1;
  EXPECT_NO_THROW(check({.mm = 1e6}, lattice));
}

TEST(UnresolvedDisplacement, IsBelowHalfAStep) {
  const auto said = [](const DisplacementSd& sd, const PoseLattice& lattice = region) {
    return unresolved_by_steps(sd, lattice, "touch-sd").value_or("");
  };
  // Steps of 4 mm, 1.6 mm and 0.2 rad.
  EXPECT_EQ(said({.mm = 2.0, .rad = 0.1}), "");
  EXPECT_EQ(said({}), "") << "nothing is blurred";
  expect_named(said({.mm = 1.9}), {"touch-sd of 1.9 mm: its step of x is 4 mm"});
  expect_named(said({.rad = 0.09}), {"5.16 degrees: its step of theta is 11.5 degrees"});
  PoseLattice fixed = region;
  fixed.x_mm.count = 1;
  fixed.theta_rad.count = 1;
  EXPECT_EQ(said({.mm = 1.0, .rad = 0.01}, fixed), "") << "axes of one bin are not blurred";
}

TEST(UnresolvedDisplacement, LiesFarFromThePivot) {
  PoseLattice lattice = region;
  lattice.pivot_mm = {100.0, 0.0};
  const auto said = [&](double x_mm, const DisplacementSd& sd) {
    return unresolved_at({{x_mm, 0.0}, 0.0}, sd, lattice, "touch-sd").value_or("");
  };
  // A step of 0.2 rad moves a sensor at r mm by 0.2 r mm; twice the step of x is 8 mm.
  EXPECT_EQ(said(139.0, {.mm = 1.0, .rad = 0.1}), "");
  expect_named(said(141.0, {.mm = 1.0, .rad = 0.1}), {"move the pivot near the touches"});
  EXPECT_EQ(said(141.0, {.mm = 5.0, .rad = 0.1}), "") << "10 mm";
  EXPECT_EQ(said(1000.0, {.mm = 1.0}), "") << "no angle is blurred";
}

}  // namespace palpate::refusal_test
