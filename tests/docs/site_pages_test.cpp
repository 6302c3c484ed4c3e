// Every command of the site's pages runs, prints what the page quotes, and ends in what it tells.

#include "document.hpp"

namespace palpate::site_pages_test {

using SitePages = DocumentTest;

// Some 15 seconds of a processor: most go into learning the sensor.
TEST_F(SitePages, StartRecognisesAnE) {
  const auto [said, complained] = run("start.md");
  EXPECT_EQ(complained, "");
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
  expect_written({"sheets/stranger.png"});
  const nlohmann::json compared = json("result.json");
  EXPECT_EQ(compared[0]["best"], "E");
  EXPECT_FALSE(compared[0].contains("warnings"));
  EXPECT_TRUE(compared[0]["decision"]["act"]);
  EXPECT_EQ(compared[1]["best"], "(none)");
  EXPECT_EQ(compared[1]["mode"]["object"], "U");
  EXPECT_EQ(compared[1]["fit"]["verdict"], "does not fit");
  expect_named(said, {"% of the belief unproven"});  // the budget of 1 ms
}

// Some 40 seconds of a processor, a third of them for the fit, which recognises twelve unknowns
// again for every displacement that it tries.
TEST_F(SitePages, MisplacedTouchesAreNoticedMeasuredAndAveraged) {
  const auto [said, complained] = run("misplaced.md");
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
  expect_written({"sweep/sweep_own_bins.png", "sweep/sweep_own_time.svg"});
  const nlohmann::json points = json("sweep.json").at("points");
  ASSERT_EQ(points.size(), 7U);
  EXPECT_NEAR(points.at(3).at("refined_error_mm").at("mean").get<double>(), 0.275, 0.02);
  EXPECT_NEAR(points.at(6).at("refined_error_mm").at("mean").get<double>(), 0.189, 0.02);
  EXPECT_NEAR(points.at(3).at("sd_mm").get<double>(), 0.211, 0.02);
  EXPECT_NEAR(points.at(6).at("sd_mm").get<double>(), 0.144, 0.02);
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
  expect_written({"ros/A.yaml", "ros/E.yaml"});
  EXPECT_EQ(json("result.json")[0]["best"], "E");
  EXPECT_TRUE(json("result.json")[0].contains("none"));
}

}  // namespace palpate::site_pages_test
