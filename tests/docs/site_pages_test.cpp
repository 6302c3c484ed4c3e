// Every command of the site's pages runs and ends in what the page tells. A page quotes numbers of
// one machine; on another, float32 rounds elsewhere. So the tests compare what a reader concludes,
// and the numbers of the first page but for their last digit.

#include <algorithm>
#include <cmath>
#include <iterator>
#include <sstream>

#include "document.hpp"

namespace palpate::site_pages_test {

using SitePages = DocumentTest;
using Words = std::vector<std::string>;

/// The words of each line; a coordinate and its standard deviation are two.
std::vector<Words> words_of(std::string text) {
  for (auto at = text.find("+-"); at != text.npos; at = text.find("+-", at)) {
    text.replace(at, 2, " ");
  }
  std::vector<Words> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    std::istringstream of_line(line);
    lines.emplace_back(std::istream_iterator<std::string>(of_line),
                       std::istream_iterator<std::string>());
  }
  return lines;
}

/// Equal words, but that the last digit of numbers with a point may be one off.
bool agree(const Words& quoted, const Words& printed) {
  return std::equal(quoted.begin(), quoted.end(), printed.begin(), printed.end(),
                    [](const std::string& a, const std::string& b) {
                      const std::size_t point = a.find('.');
                      return a == b ||
                             (point != a.npos && b.find('.') != b.npos &&
                              std::abs(std::stod(a) - std::stod(b)) <
                                  1.5 * std::pow(10.0, -static_cast<double>(a.size() - point - 1)));
                    });
}

/// The lines of a page's tables are printed, but for the column `dropped`.
void expect_tables(const std::string& page, const std::string& said,
                   std::initializer_list<const char*> titles) {
  std::vector<Words> printed = words_of(said);
  for (Words& words : printed) {
    // Dropped mass has one digit, and is at most 1e-4.
    std::erase_if(words, [](const std::string& w) {
      return w == "dropped" || w == "0.0001" || (w.size() == 5 && w.substr(1, 3) == "e-0");
    });
  }
  const std::string text = source_text("docs/" + page);
  for (const char* title : titles) {
    const std::size_t begin = text.find(title);
    ASSERT_NE(begin, text.npos) << title;
    for (const Words& line : words_of(text.substr(begin, text.find("```", begin) - begin))) {
      EXPECT_TRUE(std::ranges::any_of(printed, [&](const Words& p) { return agree(line, p); }))
          << testing::PrintToString(line);
    }
  }
}

// Some 15 seconds of a processor: most go into learning the sensor.
TEST_F(SitePages, StartRecognisesAnE) {
  const auto [said, complained] = run("start.md");
  EXPECT_EQ(complained, "");
  expect_tables("start.md", said, {"  touch  best", "recording   touches"});
  expect_quoted("start.md", said, {"known 0.38", "fits"});
  expect_written({"maps.png", "sheets/unknown.png"});
  const nlohmann::json record = json("result.json")[0];
  EXPECT_EQ(record["best"], "E");
  EXPECT_GT(record["identity"]["E"].get<double>(), 0.99);
  // The page: the first touch decides nothing, the second one does, and the refined pose is nearer
  // to the truth than the mode.
  const nlohmann::json& trace = record["trace"];
  EXPECT_LT(trace[0]["identity"][trace[0]["best"].get<std::string>()].get<double>(), 0.9);
  EXPECT_GT(trace[1]["identity"]["E"].get<double>(), 0.99);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_LT(trace[8]["refined"]["sd"][axis].get<double>(),
              trace[0]["refined"]["sd"][axis].get<double>());
  }
  EXPECT_LT(record["refined_error_mm"].get<double>(), record["error_mm"].get<double>());
}

// Some 13 seconds of a processor: three maps, and every command on automatic bins.
TEST_F(SitePages, HowSureTellsTheStranger) {
  const auto [said, complained] = run("how_sure.md");
  EXPECT_EQ(complained, "");
  expect_written({"sheets/stranger.png", "plan.png"});
  const nlohmann::json compared = json("result.json");
  EXPECT_EQ(compared[0]["best"], "E");
  EXPECT_FALSE(compared[0].contains("warnings"));
  EXPECT_TRUE(compared[0]["decision"]["act"]);
  EXPECT_EQ(compared[1]["best"], "(none)");
  EXPECT_EQ(compared[1]["mode"]["object"], "U");
  EXPECT_EQ(compared[1]["fit"]["verdict"], "does not fit");
  expect_quoted("how_sure.md", said,
                {"stranger.h5: do not act: (none) has more than 99.9 %",
                 "stranger.h5: unlike U: its 9 touches fit 20", "unknown.h5 E [9.43, 0.42",
                 "stranger.h5: touch again: (none) has more than 99.9 %"});
  expect_named(said, {"% of the belief unproven"});  // the budget of 1 ms
}

// Some 40 seconds of a processor, a third of them for the fit, which recognises twelve unknowns
// again for every displacement that it tries.
TEST_F(SitePages, MisplacedTouchesAreNoticedMeasuredAndAveraged) {
  const auto [said, complained] = run("misplaced.md");
  expect_quoted("misplaced.md", said + complained,
                {"unknown.7.h5: unlike U: its 8 touches fit 31",
                 "unknown.7.h5: the touches fit U where each lies some 1.3 mm",
                 "12 unknowns, 96 touches", "the standard errors are large"});
  const nlohmann::json exact = scores("exact.json");
  const nlohmann::json averaged = scores("averaged.json");
  EXPECT_EQ(exact["accuracy"], 1.0);
  EXPECT_EQ(averaged["accuracy"], 1.0);
  EXPECT_LT(averaged["refined_error_mm"]["median"].get<double>(),
            exact["refined_error_mm"]["median"].get<double>());
}

#ifdef PALPATE_PYTHON  // the page runs the module
// Some 23 seconds of a processor, for lattices of up to a million bins by the histogram.
TEST_F(SitePages, MoreBinsHelpTheModeOnly) {
  const auto [said, complained] = run("bins.md");
  EXPECT_EQ(complained, "");
  expect_quoted("bins.md", said,
                {"the pose's standard deviation is only the width of a bin",
                 "give --bins 40x40x53 or more, or --bins auto",
                 "Beyond 99 k bins per object (--bins 31x31x103 --x-mm=-15:15 --y-mm=-15:15) "
                 "neither recognition nor the refined pose improves"});
  expect_written({"sweep/sweep_own_bins.png", "sweep/sweep_own_time.svg"});
  const nlohmann::json points = json("sweep.json").at("points");
  ASSERT_EQ(points.size(), 7U);
  EXPECT_NEAR(points.at(3).at("refined_error_mm").at("mean").get<double>(), 0.275, 0.02);
  EXPECT_NEAR(points.at(6).at("refined_error_mm").at("mean").get<double>(), 0.189, 0.02);
  const auto mean = [this](const std::string& results, const char* field) {
    double sum = 0.0;
    const nlohmann::json records = json(results);
    for (const nlohmann::json& record : records) {
      sum += record[field].get<double>();
    }
    return sum / static_cast<double>(records.size());
  };
  // The page's table, with room for other rounding.
  EXPECT_NEAR(mean("auto.json", "error_mm"), 0.40, 0.03);
  EXPECT_NEAR(mean("fine.json", "error_mm"), 0.24, 0.03);
  EXPECT_NEAR(mean("coarse.json", "error_mm"), 1.19, 0.06);
  EXPECT_NEAR(mean("auto.json", "refined_error_mm"), 0.18, 0.02);
  EXPECT_NEAR(mean("fine.json", "refined_error_mm"), 0.19, 0.02);
  EXPECT_NEAR(mean("coarse.json", "refined_error_mm"), 0.96, 0.06);
  expect_named(said, {"2 maps, 62 x 71 x 200 bins each", "2 maps, 124 x 141 x 400 bins each"});
}
#endif

TEST_F(SitePages, AProgramActsOnLinesOfTouches) {
  const auto [said, complained] = run("programs.md");
  expect_quoted("programs.md", said,
                {"touch 0: E touch again\ntouch 1: E grasp it\n"
                 "touch 2: E grasp it\ntouch 3: E grasp it\n"});
  expect_written({"ros/A.yaml", "ros/E.yaml"});
  EXPECT_EQ(json("result.json")[0]["best"], "E");
  EXPECT_TRUE(json("result.json")[0].contains("none"));
}

}  // namespace palpate::site_pages_test
