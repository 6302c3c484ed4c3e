#include "figures/evidence_scale.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace palpate::evidence_scale_test {

/// A row of cells with this evidence, in nats over a prior of one half.
OccupancyGrid row_of(const std::vector<float>& evidence) {
  OccupancyGrid map;
  map.prior = 0.5;
  map.nx = static_cast<int>(evidence.size());
  map.ny = 1;
  map.log_odds = evidence;
  return map;
}

double range_of(const std::vector<float>& evidence) {
  const OccupancyGrid map = row_of(evidence);
  return evidence_scale(std::span(&map, 1)).range_nats;
}

TEST(EvidenceScale, NineOfTenCellsStayWithinIt) {
  // Nine of ten up to 3.9, one far beyond; then the ninth is beyond, too.
  EXPECT_EQ(range_of({0.1F, -0.2F, 0.3F, -0.4F, 0.5F, 0.6F, 0.7F, -0.8F, 3.9F, -3.9F, 70.0F}), 4.0);
  EXPECT_EQ(range_of({0.1F, -0.2F, 0.3F, -0.4F, 0.5F, 0.6F, 0.7F, -0.8F, 3.9F, 70.0F}), 80.0);
}

TEST(EvidenceScale, IsRoundedUpToANumberWhoseHalfIsShort) {
  EXPECT_EQ(range_of({1.0F}), 1.0);
  EXPECT_EQ(range_of({1.01F}), 2.0);
  EXPECT_EQ(range_of({-5.0F}), 6.0);
  EXPECT_EQ(range_of({8.5F}), 10.0);
}

TEST(EvidenceScale, CellsWithoutEvidenceDoNotCount) {
  std::vector<float> evidence(1000, 0.0F);
  evidence.resize(2000, 0.009F);  // a remnant of a Gaussian's tail
  evidence.push_back(std::numeric_limits<float>::infinity());
  EXPECT_EQ(range_of(evidence), 1.0);
  evidence.push_back(5.5F);
  EXPECT_EQ(range_of(evidence), 6.0);
}

}  // namespace palpate::evidence_scale_test
