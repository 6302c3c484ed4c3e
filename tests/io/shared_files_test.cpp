// Files that other programs wrote, where they lie beside the source tree.

#include <gtest/gtest.h>

#include <filesystem>

#include "palpate/files.hpp"

namespace palpate::shared_files_test {

const std::filesystem::path shared = std::filesystem::path(PALPATE_SOURCE_DIR) / ".." / "shared";

TEST(SharedFiles, GoldenFilesAreRead) {
  const std::filesystem::path golden = shared / "golden";
  if (!std::filesystem::exists(golden)) {
    GTEST_SKIP() << golden << " is not there";
  }
  const Recording unknown = read_recording(golden / "A.unknown.h5");
  EXPECT_EQ(unknown.size(), 9u);
  EXPECT_EQ(unknown.elements(), 36u);
  EXPECT_EQ(unknown.pressure_unit, "kPa");
  EXPECT_EQ(read_recording(golden / "A.train.h5").object, "A");
  const OccupancyGrid map = read_map(golden / "O.map.h5");
  EXPECT_EQ(map.label, "O");
  EXPECT_EQ(map.symmetry, 0);
  EXPECT_EQ(map.log_odds.size(), static_cast<std::size_t>(map.nx) * map.ny);
  const Posterior posterior = read_posterior(golden / "A.posterior.h5");
  EXPECT_EQ(posterior.objects.size(), 5u);
  EXPECT_EQ(posterior.log_likelihood.size(), 5u * 10'000);
  EXPECT_EQ(read_format(golden / "A.posterior.h5"), "palpate.posterior");
}

TEST(SharedFiles, RealPressesAreRead) {
  const std::filesystem::path presses = shared / "data" / "presses";
  if (!std::filesystem::exists(presses)) {
    GTEST_SKIP() << presses << " is not there";
  }
  for (const auto& file : std::filesystem::directory_iterator(presses)) {
    const Recording recording = read_recording(file.path());
    EXPECT_EQ(recording.object, file.path().stem());
    EXPECT_EQ(recording.pressure_unit, "raw");
    EXPECT_EQ(recording.size(), 25u);
    EXPECT_EQ(recording.elements(), 1400u);
  }
}

}  // namespace palpate::shared_files_test
