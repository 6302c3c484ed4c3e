#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "bench_program.hpp"
#include "io/scratch_folder.hpp"

namespace palpate {
namespace {

/// Every tag is closed by its own kind, in order, and no "<" or "&" stands alone.
void expect_well_formed(const std::string& text) {
  std::vector<std::string> open;
  for (std::size_t at = text.find_first_of("<&"); at != std::string::npos;
       at = text.find_first_of("<&", at + 1)) {
    if (text[at] == '&') {
      EXPECT_LE(text.find(';', at), at + 5) << text.substr(at, 20);
      continue;
    }
    const std::size_t end = text.find('>', at);
    ASSERT_NE(end, std::string::npos);
    const std::string tag = text.substr(at + 1, end - at - 1);
    ASSERT_FALSE(tag.empty());
    EXPECT_EQ(std::count(tag.begin(), tag.end(), '"') % 2, 0) << tag;
    const std::size_t first = tag.front() == '/' ? 1 : 0;
    const auto last = std::find_if_not(tag.begin() + static_cast<std::ptrdiff_t>(first), tag.end(),
                                       [](unsigned char c) { return std::isalnum(c) != 0; });
    const std::string name(tag.begin() + static_cast<std::ptrdiff_t>(first), last);
    if (tag.front() == '!') {
      continue;
    }
    if (tag.front() == '/') {
      ASSERT_FALSE(open.empty()) << tag;
      ASSERT_EQ(open.back(), name);
      open.pop_back();
    } else if (tag.back() != '/') {
      open.push_back(name);
    }
  }
  EXPECT_TRUE(open.empty());
}

void expect_sound(const nlohmann::json& point) {
  const std::string what = point.at("filter").get<std::string>() + " " + point.at("count").dump();
  EXPECT_EQ(point.at("trials").get<int>() % 5, 0) << what;
  EXPECT_GT(point.at("seconds_per_touch"), 0.0) << what;
  EXPECT_GT(point.at("seconds_per_unknown"), point["seconds_per_touch"]) << what;
  EXPECT_GT(point.at("device_bytes"), 0) << what;
  EXPECT_GE(point.at("accuracy"), 0.0) << what;
  EXPECT_LE(point.at("accuracy"), 1.0) << what;
  EXPECT_LE(point.at("expected_calibration_error"), 1.0) << what;
  ASSERT_FALSE(point.at("error_mm").is_null()) << what;
  EXPECT_LE(point["error_mm"].at("median"), point["error_mm"].at("p95")) << what;
  // The engine's goal is 1e-4; its float32 steps come to some 1e-6.
  const nlohmann::json& deviation = point.at("deviation_nats_per_touch");
  EXPECT_GT(deviation.at("largest"), 0.0) << what;
  EXPECT_LE(deviation.at("rms"), deviation["largest"]) << what;
  EXPECT_LT(deviation["largest"], 1e-4) << what;
  EXPECT_EQ(deviation.at("samples"), 1'000) << what;
}

/// Tenfold bins, less error, until the refined pose reaches its floor, which these do not.
void expect_order(const nlohmann::json& points) {
  for (const double cell_mm : {0.5, 1.0}) {
    std::map<std::int64_t, nlohmann::json> runs;
    for (const auto& point : points) {
      if (point.at("balanced") == true && point.at("cell_mm") == cell_mm) {
        runs[point.at("count")] = point;
      }
    }
    ASSERT_GE(runs.size(), 3U) << cell_mm;
    for (auto run = runs.begin(), finer = std::next(run); finer != runs.end(); ++run, ++finer) {
      for (const char* error : {"error_mm", "refined_error_mm"}) {
        EXPECT_GT(run->second.at(error).at("mean"), finer->second.at(error).at("mean"))
            << error << " from " << run->first << " to " << finer->first << " bins";
      }
      EXPECT_GT(run->second.at("nearest_bin_mm"), finer->second.at("nearest_bin_mm"));
    }
    const nlohmann::json& finest = runs.rbegin()->second;
    EXPECT_EQ(finest.at("accuracy"), 1.0);
    EXPECT_LT(finest.at("refined_error_mm").at("mean"), finest.at("error_mm").at("mean"))
        << "a pose between the bins is nearer than the bin";
  }
}

/// No front holds a point that another one beats.
void expect_fronts(const nlohmann::json& fronts) {
  ASSERT_EQ(fronts.size(), 2U);
  for (const auto& front : fronts) {
    ASSERT_FALSE(front.empty());
    for (std::size_t i = 1; i < front.size(); ++i) {
      EXPECT_GT(front[i].at("cost"), front[i - 1].at("cost"));
      EXPECT_LT(front[i].at("error"), front[i - 1].at("error"));
    }
  }
}

void expect_page(const std::string& page, const nlohmann::json& document) {
  expect_well_formed(page);
  EXPECT_TRUE(page.starts_with("<!DOCTYPE html>"));
  for (const char* outside : {"http:", "https:", "src=", "href=", "url(", "@import"}) {
    EXPECT_EQ(page.find(outside), std::string::npos) << outside;
  }
  EXPECT_EQ(page.find("nan"), std::string::npos);
  for (const char* fact : {"device", "date", "command line"}) {
    EXPECT_NE(page.find(document.at(fact).get<std::string>()), std::string::npos) << fact;
  }
  std::size_t rows = 0;
  for (std::size_t at = page.find("<tr><td"); at != std::string::npos;
       at = page.find("<tr><td", at + 1)) {
    ++rows;
  }
  EXPECT_EQ(rows, document.at("points").size());
}

TEST(Sweep, QuickRunKeepsTheOrderAndTheErrorBounds) {
  const ScratchFolder folder;
  ASSERT_EQ(run_bench("sweep --quick --json " + (folder / "s.json").string() + " --html " +
                      (folder / "s.html").string() + " --plots " + (folder / "plots").string()),
            0);
  const auto document = nlohmann::json::parse(bytes_of(folder / "s.json"));
  EXPECT_NE(document.at("data").get<std::string>().find("simulated"), std::string::npos);
  std::map<std::string, int> filters;
  for (const auto& point : document.at("points")) {
    expect_sound(point);
    ++filters[point.at("filter")];
  }
  EXPECT_EQ(filters.size(), 3U) << "histogram, particles, Augmented MCL";
  expect_order(document.at("points"));
  expect_fronts(document.at("fronts"));
  std::map<std::string, int> paths;
  for (const auto& precision : document.at("precisions")) {
    EXPECT_GT(precision.at("nanoseconds"), 0.0);
    EXPECT_LT(precision.at("deviation_nats_per_touch").at("largest"), 1e-4);
    const std::string path = precision.at("path");
    ++paths[path.substr(0, path.find(' '))];
  }
  for (const char* path : {"register", "runs", "one-bin", "CPU", "particles"}) {
    EXPECT_GT(paths[path], 0) << path;
  }
  EXPECT_TRUE(document.at("verdicts").empty()) << "the goal's lattice has more bins";
  ASSERT_EQ(document.at("knees").size(), 2U);
  for (const auto& knee : document["knees"]) {
    EXPECT_GT(knee.at("floor_mm"), 0.0);
    EXPECT_NE(knee.at("sentence").get<std::string>().find("--bins auto takes"), std::string::npos);
  }
  expect_page(bytes_of(folder / "s.html"), document);
  for (const char* chart : {"front", "precision", "bins"}) {
    const std::string svg = bytes_of(folder / "plots" / ("sweep_" + std::string(chart) + ".svg"));
    EXPECT_TRUE(svg.starts_with("<svg xmlns=")) << chart;
    EXPECT_EQ(svg.find("var("), std::string::npos) << "not every viewer knows variables";
    expect_well_formed(svg);
  }
}

TEST(Sweep, RefusesWhatCannotBe) {
  const ScratchFolder folder;
  EXPECT_EQ(run_bench("sweep --trials 0 2>/dev/null"), 2);
  EXPECT_EQ(run_bench("sweep --max-bins 10 2>/dev/null"), 2);
  EXPECT_EQ(run_bench("sweep --html " + (folder / "missing/s.html").string() + " 2>/dev/null"), 2);
  std::ofstream(folder / "file") << "no folder";
  EXPECT_EQ(run_bench("sweep --plots " + (folder / "file").string() + " 2>/dev/null"), 2);
}

}  // namespace
}  // namespace palpate
