#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "golden_values.hpp"
#include "palpate/pose_error.hpp"

namespace palpate::golden_test {

constexpr double map_tolerance = 1e-3;  // error allowed for a map, in nats per cell
constexpr double per_touch = 1e-4;      // error allowed for a log-likelihood, in nats per touch

GoldenValues golden_values() {
  return read_golden(std::filesystem::path(PALPATE_SOURCE_DIR) / "tests/golden/golden.json");
}

/// The file keeps ten digits, a relative 5e-10: a larger difference is a change of the reference.
void expect_reproduced(double now, double written) {
  ASSERT_NEAR(now, written, 1e-9 * std::max(1.0, std::abs(written)));
}

TEST(Golden, TheReferenceStillReproducesIt) {
  const GoldenValues written = golden_values();
  GoldenValues now = written;
  compute_expected(now);
  for (std::size_t i = 0; i < written.objects.size(); ++i) {
    ASSERT_EQ(now.objects[i].log_odds.size(), written.objects[i].log_odds.size());
    for (std::size_t cell = 0; cell < written.objects[i].log_odds.size(); ++cell) {
      expect_reproduced(now.objects[i].log_odds[cell], written.objects[i].log_odds[cell]);
    }
  }
  for (std::size_t u = 0; u < written.unknowns.size(); ++u) {
    const GoldenValues::Unknown& expected = written.unknowns[u];
    const GoldenValues::Unknown& computed = now.unknowns[u];
    ASSERT_EQ(computed.trace.size(), expected.trace.size());
    for (std::size_t touch = 0; touch < expected.trace.size(); ++touch) {
      expect_reproduced(computed.trace[touch].max_log_likelihood,
                        expected.trace[touch].max_log_likelihood);
      for (std::size_t i = 0; i < written.objects.size(); ++i) {
        expect_reproduced(computed.trace[touch].identity[i], expected.trace[touch].identity[i]);
      }
    }
    for (std::size_t i = 0; i < written.objects.size(); ++i) {
      ASSERT_EQ(computed.log_likelihood[i].size(), expected.log_likelihood[i].size());
      for (std::size_t bin = 0; bin < expected.log_likelihood[i].size(); ++bin) {
        expect_reproduced(computed.log_likelihood[i][bin], expected.log_likelihood[i][bin]);
      }
    }
    expect_reproduced(computed.error_mm, expected.error_mm);
  }
}

TEST(Golden, MapsAreWithinTheirTolerance) {
  const GoldenValues golden = golden_values();
  Device device = Device::open();
  for (const GoldenValues::Object& object : golden.objects) {
    MapBuilder builder(device, golden.map_options);
    builder.add(object.training.touches(0, object.training.size()));
    const OccupancyGrid map = builder.build(object.map.label);
    const glm::dvec2 offset = (object.map.origin_mm - map.origin_mm) / map.cell_mm;
    for (int j = 0; j < object.map.ny; ++j) {
      for (int i = 0; i < object.map.nx; ++i) {
        const int column = i + static_cast<int>(std::lround(offset.x));
        const int row = j + static_cast<int>(std::lround(offset.y));
        const bool inside = column >= 0 && column < map.nx && row >= 0 && row < map.ny;
        const double product = inside ? map.at(column, row) : map.prior_log_odds();
        ASSERT_NEAR(product, object.log_odds[static_cast<std::size_t>(j) * object.map.nx + i],
                    map_tolerance)
            << map.label << ", row " << j << ", column " << i;
      }
    }
  }
}

TEST(Golden, RecognitionIsWithinItsTolerance) {
  const GoldenValues golden = golden_values();
  Device device = Device::open();
  PoseHistogram histogram(device, hypotheses(golden), golden.histogram_options);
  for (const GoldenValues::Unknown& unknown : golden.unknowns) {
    histogram.reset();
    for (std::size_t touch = 0; touch < unknown.touches.size(); ++touch) {
      histogram.update(unknown.touches.touch(touch));
      const Estimate estimate = histogram.estimate();
      const GoldenValues::Step& expected = unknown.trace[touch];
      const double tolerance = per_touch * static_cast<double>(touch + 1);
      EXPECT_NEAR(estimate.mode.log_likelihood, expected.max_log_likelihood, tolerance);
      for (std::size_t i = 0; i < golden.objects.size(); ++i) {
        // An error of e nats on either side changes a probability p by 2 e p (1 - p) <= e / 2.
        EXPECT_NEAR(estimate.identity[i], expected.identity[i], tolerance);
      }
    }
    const double tolerance = per_touch * static_cast<double>(unknown.touches.size());
    for (std::size_t i = 0; i < golden.objects.size(); ++i) {
      const std::vector<double> product = histogram.log_likelihood(static_cast<int>(i));
      ASSERT_EQ(product.size(), unknown.log_likelihood[i].size());
      for (std::size_t bin = 0; bin < product.size(); ++bin) {
        ASSERT_NEAR(product[bin], unknown.log_likelihood[i][bin], tolerance) << "bin " << bin;
      }
    }
    const Mode mode = histogram.estimate().mode;
    EXPECT_NEAR(unknown.log_likelihood[mode.object][mode.bin.value()],
                unknown.trace.back().max_log_likelihood, 2.0 * tolerance);
    const OccupancyGrid& map = golden.objects[mode.object].map;
    EXPECT_NEAR(pose_error_mm(body_of(map), map.symmetry, mode.T_object_robot,
                              unknown.touches.truth->T_object_robot),
                unknown.error_mm, 1e-6)
        << "ten digits of some mm";
  }
}

}  // namespace palpate::golden_test
