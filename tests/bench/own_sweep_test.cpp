// palpate-bench sweep on a user's own maps and recordings.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "bench_program.hpp"
#include "io/scratch_folder.hpp"

namespace palpate::own_sweep_test {

/// Maps of two letters in maps/, and six unknowns with their truth in unknowns/.
void make_own_data(const std::filesystem::path& folder) {
  const std::filesystem::path palpate =
      std::filesystem::path(PALPATE_BENCH).parent_path() / "palpate";
  std::ofstream(folder / "make.sh") << R"(
    cd "$2" && mkdir unknowns
    for letter in A E; do
      "$1" simulate $letter -o $letter.train.h5
      for k in 1 2 3; do
        "$1" simulate $letter -o unknowns/$letter$k.h5 --object-pose random --touches 6 --seed $k
      done
    done
    "$1" map A.train.h5 E.train.h5 -o maps/
    echo path,label > unlabelled.csv
    for k in 1 2 3; do echo unknowns/E$k.h5,unheard-of >> unlabelled.csv; done
  )";
  ASSERT_EQ(std::system(("bash -eu " + (folder / "make.sh").string() + " '" + palpate.string() +
                         "' '" + folder.string() + "' > /dev/null")
                            .c_str()),
            0);
}

/// What every point of a sweep over own data has, by rising count.
void expect_own_points(const nlohmann::json& points, std::size_t recordings) {
  ASSERT_GE(points.size(), 3U);
  std::int64_t before = 0;
  for (const auto& point : points) {
    const std::string what = point.at("count").dump() + " bins";
    EXPECT_GT(point.at("count"), before) << what;
    before = point["count"];
    EXPECT_EQ(point.at("bins_in_all"), 2 * before) << what;
    EXPECT_EQ(point.at("recordings"), recordings) << what;
    EXPECT_EQ(point.at("labelled"), recordings) << what;
    EXPECT_EQ(point.at("histogram_recordings"), 1) << what << ": a quick run";
    EXPECT_GT(point.at("sd_mm"), 0.0) << what;
    EXPECT_GT(point.at("sd_deg"), 0.0) << what;
    EXPECT_GT(point.at("seconds_histogram"), 0.0) << what;
    EXPECT_GT(point.at("seconds_bounds"), 0.0) << what;
    EXPECT_GT(point.at("device_bytes"), 0) << what;
    EXPECT_GT(point.at("host_bytes"), 0) << what;
  }
  EXPECT_LE(before, 11'000) << "--max-bins";
  const nlohmann::json& finest = points.back();
  EXPECT_EQ(finest.at("from_finest_mm").at("mean"), 0.0);
  EXPECT_EQ(finest.at("same_object"), 1.0);
  EXPECT_GT(points.front().at("from_finest_mm").at("mean"), 0.0);
}

TEST(OwnSweep, TellsHowManyBinsOwnObjectsNeed) {
  const ScratchFolder folder;
  ASSERT_NO_FATAL_FAILURE(make_own_data(folder.path()));
  const auto sweep = [&](const std::string& recordings) {
    EXPECT_EQ(run_bench("sweep --quick --max-bins 10000 --maps " + (folder / "maps").string() +
                        " --recordings " + (folder / recordings).string() +
                        " --x-mm=-12:12 --y-mm=-12:12 --json " + (folder / "s.json").string() +
                        " --plots " + (folder / "plots").string()),
              0);
    return nlohmann::json::parse(bytes_of(folder / "s.json"));
  };
  const auto document = sweep("unknowns");
  EXPECT_EQ(document.at("data"), "6 recordings, 2 maps");
  EXPECT_EQ(document.at("true_poses"), 6);
  const auto& points = document.at("points");
  expect_own_points(points, 6);
  EXPECT_EQ(points.back().at("accuracy"), 1.0);
  // Bins of 2.4 mm against bins of 1 mm.
  EXPECT_LT(points.back().at("error_mm").at("mean"),
            0.7 * points.front().at("error_mm").at("mean").get<double>());
  EXPECT_LT(document.at("auto_count"), document.at("fine_count"));
  const std::string advice = document.at("advice");
  EXPECT_NE(advice.find("--x-mm=-12:12 --y-mm=-12:12"), advice.npos) << advice;
  EXPECT_NE(advice.find("--bins auto takes"), advice.npos) << advice;
  if (const nlohmann::json& count = document.at("refined_count"); !count.is_null()) {
    EXPECT_TRUE(std::ranges::any_of(points, [&](const auto& p) { return p.at("count") == count; }));
    EXPECT_NE(count, points.back().at("count")) << "no finer run confirms the finest";
    EXPECT_TRUE(advice.starts_with("Beyond ")) << advice;
  }
  for (const char* chart : {"bins", "time"}) {
    const std::string name = "sweep_own_" + std::string(chart);
    expect_well_formed(folder / "plots" / (name + ".svg"));
    EXPECT_TRUE(bytes_of(folder / "plots" / (name + ".png")).starts_with("\x89PNG")) << chart;
  }

  const auto unlabelled = sweep("unlabelled.csv");
  EXPECT_EQ(unlabelled.at("true_poses"), 0);
  expect_own_points(unlabelled.at("points"), 3);
  EXPECT_TRUE(unlabelled["points"][0].at("error_mm").is_null());
  EXPECT_EQ(unlabelled["points"][0].at("accuracy"), 0.0) << "of a label without a map";
}

TEST(OwnSweep, RefusesWhatCannotBe) {
  const ScratchFolder folder;
  EXPECT_EQ(run_bench("sweep --maps " + folder.path().string() + " 2>/dev/null"), 2)
      << "no recordings";
  EXPECT_EQ(run_bench("sweep --recordings missing.h5 2>/dev/null"), 2) << "no maps";
  EXPECT_EQ(run_bench("sweep --maps m --recordings r --html " + (folder / "s.html").string() +
                      " 2>/dev/null"),
            2)
      << "a page of the letters";
}

}  // namespace palpate::own_sweep_test
