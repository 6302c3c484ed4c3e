#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "palpate/simulation.hpp"
#include "support/errors.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::polygon_file_test {

class PolygonFile : public testing::Test {
 protected:
  Shape read(const std::string& text) const {
    put_bytes(path_, text);
    return make_shape(path_.string());
  }
  void expect_refused(const std::string& text, const std::string& line, const std::string& why) {
    const std::string refusal = input_error([&] { read(text); });
    EXPECT_TRUE(refusal.starts_with(path_.string() + ":" + line)) << refusal;
    expect_named(refusal, {why.c_str()});
  }

  ScratchFolder folder_;
  std::filesystem::path path_ = folder_ / "square.txt";
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

TEST_F(PolygonFile, RefusesWhatIsNotAVertexOrEnclosesNothingNamingTheLine) {
  for (const char* bad :
       {"nan 1", "1 nan", "inf 1", "1e999 1", "1", "1 2 3", "1,2", "1 2mm", "x y"}) {
    expect_refused(std::string("0 0\n1 0\n") + bad + "\n", "3:", bad);
  }
  expect_refused("# none\n0 0\n1 0\n", "2:", "at least 3");
  expect_refused("0 0\n1 0\n0 1\n\n4 4\n\n0 0\n1 0\n0 1\n", "5:", "at least 3");
  expect_refused("0 0\n1 1\n2 2\n3 3\n", "1:", "on one line");
  expect_refused("", "", "no polygon");
  expect_refused("# nothing\n\n", "", "no polygon");
}

}  // namespace palpate::polygon_file_test
