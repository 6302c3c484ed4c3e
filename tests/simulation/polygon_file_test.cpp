#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "palpate/error.hpp"
#include "palpate/simulation.hpp"

namespace palpate::polygon_file_test {

class PolygonFile : public testing::Test {
 protected:
  void SetUp() override {
    // A name per test: CTest runs them side by side.
    const std::string test = testing::UnitTest::GetInstance()->current_test_info()->name();
    path_ = std::filesystem::path(testing::TempDir()) / ("palpate_" + test + ".txt");
  }
  void TearDown() override { std::filesystem::remove(path_); }

  Shape read(const std::string& text) const {
    std::ofstream(path_) << text;
    return make_shape(path_.string());
  }

  void expect_refused(const std::string& text, const std::string& line, const std::string& why) {
    try {
      read(text);
      ADD_FAILURE() << "accepted: " << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), Fault::input);
      EXPECT_THAT(error.what(), testing::StartsWith(path_.string() + ":" + line));
      EXPECT_THAT(error.what(), testing::HasSubstr(why));
      EXPECT_THAT(error.what(), testing::Not(testing::HasSubstr("\n")));
    }
  }

  std::filesystem::path path_;
};

TEST_F(PolygonFile, HoldsPolygonsCommentsAndBlankLines) {
  const Shape shape = read(
      "# a square with a hole\r\n"
      "\n"
      "-5 -5\n"
      "5 -5   # right\n"
      "# a comment does not end a polygon\n"
      "+5 5e0\n"
      "\t-5 5\r\n"
      "  \n"
      "\n"
      "-1 -1\n"
      "1 -1\n"
      "0 1");
  EXPECT_EQ(shape.label, path_.stem().string());
  ASSERT_EQ(shape.polygons.size(), 2U);
  EXPECT_EQ(shape.polygons[0].size(), 4U);
  EXPECT_EQ(shape.polygons[1].size(), 3U);
  EXPECT_EQ(shape.polygons[0][2], glm::dvec2(5.0, 5.0));
  EXPECT_TRUE(shape.contains({3.0, 3.0}));
  EXPECT_FALSE(shape.contains({0.0, 0.0}));
}

TEST_F(PolygonFile, RefusesWhatIsNotAVertexNamingTheLine) {
  const std::string start = "0 0\n1 0\n";
  for (const char* bad :
       {"nan 1", "1 nan", "inf 1", "1e999 1", "1", "1 2 3", "1,2", "1 2mm", "x y"}) {
    expect_refused(start + bad + "\n", "3:", bad);
  }
}

TEST_F(PolygonFile, RefusesPolygonsThatEncloseNothingNamingTheirFirstLine) {
  expect_refused("# none\n0 0\n1 0\n", "2:", "at least 3");
  expect_refused("0 0\n1 0\n0 1\n\n4 4\n\n0 0\n1 0\n0 1\n", "5:", "at least 3");
  expect_refused("0 0\n1 1\n2 2\n3 3\n", "1:", "on one line");
}

TEST_F(PolygonFile, RefusesAFileWithoutPolygons) {
  expect_refused("", "", "no polygon");
  expect_refused("# nothing\n\n", "", "no polygon");
}

}  // namespace palpate::polygon_file_test
