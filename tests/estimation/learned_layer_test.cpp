// Bounded posteriors of a table over layers of maps that were sensed in part. Histograms and
// particles of such tables stand among the cases of filter_laws_test.cpp.

#include <array>

#include <gtest/gtest.h>

#include "likelihood_cases.hpp"
#include "made_up_sensors.hpp"
#include "support/certified.hpp"

namespace palpate::learned_layer_test {

class LearnedLayer : public testing::TestWithParam<MapLayer> {};

TEST_P(LearnedLayer, KeepsTheCertificateOfBounds) {
  double dropped = 0.0;
  for (std::uint64_t seed = 321; seed < 327; ++seed) {
    SCOPED_TRACE(::testing::Message() << "scene " << seed);
    const LearnedScene of = learned_scene(GetParam(), 10 * seed);
    ASSERT_EQ(of.contact.table->sets(), 4U);
    Uniform random(seed);
    const auto touches = static_cast<std::size_t>(random(1.0, 7.0));
    const Recording recording =
        random_recording(touches, static_cast<std::size_t>(random(1.0, 40.0)), seed);
    const double step_mm = std::array{0.1, 0.25, 0.8}[seed / 2 % 3];
    BoundedOptions options{.lattice = lattices_of({step_mm}, 11, 9, 4).front(),
                           .contact = of.contact};
    options.tolerance = seed % 2 == 0 ? 1e-6 : 1e-3;
    if (seed % 3 == 0) {
      options.evidence_nats = 0.1;
    }
    const Certified seen = expect_certified(of.objects, options, all_touches(recording));
    ASSERT_TRUE(seen.estimate.certificate);
    dropped = std::max(dropped, seen.estimate.certificate->dropped_mass);
  }
  EXPECT_GT(dropped, 0.0) << "no scene left a bin out";
}

INSTANTIATE_TEST_SUITE_P(OfBoth, LearnedLayer,
                         testing::Values(MapLayer::log_odds, MapLayer::mean_level),
                         [](const auto& each) {
                           return each.param == MapLayer::log_odds ? "LogOdds" : "MeanLevel";
                         });

}  // namespace palpate::learned_layer_test
