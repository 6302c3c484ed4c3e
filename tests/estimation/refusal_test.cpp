// Options and maps that are out of range are refused by the name of what is wrong.

#include <functional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "beliefs.hpp"
#include "made_up_sensors.hpp"
#include "palpate/balanced_lattice.hpp"
#include "palpate/map_builder.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"

namespace palpate::refusal_test {

TEST(MapOptions, OutOfRangeAreRefused) {
  Device device = Device::open();
  std::vector<std::pair<MapOptions, const char*>> wrong{
      {{.classifier = {.threshold = nan}}, "threshold"}, {{.sensor = {.peak = 1e-7}}, "peak"}};
  for (const double length : {0.0, -0.5, nan, infinity, 1e-7, 1.1e6, 1e154, 1e200}) {
    wrong.push_back({{.cell_mm = length}, "cell"});
    wrong.push_back({{.sensor = {.spread_mm = length}}, "spread"});
  }
  for (const auto& [options, name] : wrong) {
    expect_named(input_error([&] { const MapBuilder builder(device, options); }), {name});
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
  Device device = Device::open();
  for (const auto& [name, change] : wrong) {
    SCOPED_TRACE(name);
    Input in;
    change(in);
    const HistogramOptions bins{.lattice = in.lattice, .contact = in.contact};
    expect_named(input_error([&] { const PoseHistogram made(device, in.objects, bins); }), {name});
    const ParticleOptions particles{.particles = 10, .region = in.lattice, .contact = in.contact};
    expect_named(input_error([&] { const ParticleFilter made(device, in.objects, particles); }),
                 {name});
  }
}

TEST(HistogramOptions, OutOfRangeAreRefused) {
  Device device = Device::open();
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
    expect_named(input_error([&] { const PoseHistogram made(device, objects, options); }), {name});
  }
  objects[0].map.prior = 0.3;
  EXPECT_NO_THROW(PoseHistogram(device, objects, {.lattice = {}, .contact = {.prior = 0.25}}))
      << "maps of several priors, where one is given";
}

TEST(ParticleOptions, OutOfRangeAreRefused) {
  Device device = Device::open();
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
    expect_named(input_error([&] { const ParticleFilter made(device, three_objects(), options); }),
                 {name});
  }
}

TEST(BalancedLattice, OfAMapThatIsNotSoundIsRefused) {
  Input in;
  in.map().cell_mm = 1e200;
  expect_named(input_error([&] { balanced_lattice({}, in.objects); }), {"cell_mm"});
}

}  // namespace palpate::refusal_test
