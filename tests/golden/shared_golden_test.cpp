// Tests against an independent float64 program's golden values, if they lie beside the source tree.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "palpate/files.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/pose_error.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/shared_device.hpp"
#include "support/synthetic.hpp"

namespace palpate::shared_golden_test {

using nlohmann::json;

constexpr double map_tolerance = 1e-3;       // nats per cell, by the golden values' own page
constexpr double identity_tolerance = 5e-4;  // of a probability, at every touch
constexpr double metric_tolerance = 1e-6;    // mm: float64 on both sides, printed to 16 digits

class SharedGolden : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(folder / "golden.json")) {
      GTEST_SKIP() << folder << " is not there";
    }
    std::ifstream file(folder / "golden.json");
    golden = json::parse(file);
  }

  ContactClassifier classifier() const {
    return {.threshold = golden.at("contact_threshold_kpa"), .ratio = golden.at("contact_ratio")};
  }

  std::filesystem::path folder = std::filesystem::path(PALPATE_SOURCE_DIR) / "../shared/golden";
  json golden;
};

Pose pose_from(const json& j) {
  return {{j.at(0).get<double>(), j.at(1).get<double>()}, j.at(2).get<double>()};
}

TEST_F(SharedGolden, MapsAgreeInEveryCell) {
  for (const std::string label : {"A", "E", "I", "O", "U"}) {
    const OccupancyGrid expected = read_map(folder / (label + ".map.h5"));
    const Recording training = read_recording(folder / (label + ".train.h5"));
    MapBuilder builder(shared_device(), {.cell_mm = expected.cell_mm,
                                         .sensor = {.spread_mm = golden.at("spread_mm"),
                                                    .peak = golden.at("peak"),
                                                    .prior = golden.at("prior")},
                                         .classifier = classifier()});
    builder.add(all_touches(training));
    const OccupancyGrid map = builder.build(label);
    const glm::dvec2 offset = (expected.origin_mm - map.origin_mm) / map.cell_mm;
    for (int j = 0; j < expected.ny; ++j) {
      for (int i = 0; i < expected.nx; ++i) {
        const int column = i + static_cast<int>(std::lround(offset.x));
        const int row = j + static_cast<int>(std::lround(offset.y));
        const bool inside = column >= 0 && column < map.nx && row >= 0 && row < map.ny;
        ASSERT_NEAR(inside ? map.at(column, row) : map.prior_log_odds(), expected.at(i, j),
                    map_tolerance)
            << label << ", row " << j << ", column " << i;
      }
    }
  }
}

TEST_F(SharedGolden, RecognitionAgreesInEveryBin) {
  const std::string first = golden.at("cases").at(0).at("unknown");
  const Posterior layout = read_posterior(folder / (first.substr(0, 1) + ".posterior.h5"));
  std::vector<Hypothesis> objects;
  for (const std::string& label : layout.objects) {
    objects.push_back({read_map(folder / (label + ".map.h5")), 1.0});
  }
  const HistogramOptions options{.lattice = layout.lattice,
                                 .contact = {.classifier = classifier(),
                                             .gamma = golden.at("gamma"),
                                             .prior = golden.at("prior").get<double>()}};
  PoseHistogram histogram(shared_device(), objects, options);

  for (const json& unknown : golden.at("cases")) {
    const std::string file = unknown.at("unknown");
    const Recording recording = read_recording(folder / file);
    const json& trace = unknown.at("trace");
    ASSERT_EQ(recording.size(), trace.size());
    histogram.reset();
    for (std::size_t touch = 0; touch < recording.size(); ++touch) {
      histogram.update(recording.touch(touch));
      const Estimate estimate = histogram.estimate();
      for (std::size_t i = 0; i < objects.size(); ++i) {
        EXPECT_NEAR(estimate.identity[i], trace[touch].at("identity").at(layout.objects[i]),
                    identity_tolerance)
            << file << ", touch " << touch;
      }
      EXPECT_NEAR(estimate.mode.log_likelihood, trace[touch].at("max_log_likelihood"),
                  2.0 * per_touch * static_cast<double>(touch + 1))
          << file << ", touch " << touch;
    }

    const double tolerance = per_touch * static_cast<double>(recording.size());
    const Posterior posterior = read_posterior(folder / (file.substr(0, 1) + ".posterior.h5"));
    const std::vector<double>& expected = posterior.log_likelihood;
    std::vector<double> product;
    for (std::size_t i = 0; i < objects.size(); ++i) {
      const std::vector<double> bins = histogram.log_likelihood(static_cast<int>(i));
      product.insert(product.end(), bins.begin(), bins.end());
    }
    EXPECT_LE(largest_difference(product, expected), tolerance) << file;

    // The mode may be any bin within the tolerance of the largest.
    const Mode mode = histogram.estimate().mode;
    const auto at =
        static_cast<std::size_t>(mode.object * options.lattice.bins() + mode.bin.value());
    EXPECT_GE(expected[at], *std::max_element(expected.begin(), expected.end()) - 2.0 * tolerance);
    const OccupancyGrid& map = objects[static_cast<std::size_t>(mode.object)].map;
    EXPECT_NEAR(pose_error_mm(body_of(map), map.symmetry, mode.T_object_robot,
                              pose_from(unknown.at("truth").at("T_object_robot"))),
                unknown.at("displacement_mm"), metric_tolerance)
        << file;
  }
}

TEST_F(SharedGolden, PoseErrorsAgree) {
  for (const json& pair : golden.at("metric")) {
    const std::string file = pair.at("map");
    const OccupancyGrid map = read_map(folder / file);
    EXPECT_EQ(map.symmetry, pair.at("symmetry").get<int>());
    EXPECT_NEAR(pose_error_mm(body_of(map), map.symmetry, pose_from(pair.at("estimate")),
                              pose_from(pair.at("truth"))),
                pair.at("displacement_mm"), metric_tolerance)
        << pair;
  }
}

}  // namespace palpate::shared_golden_test
