#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "bench_program.hpp"
#include "io/scratch_folder.hpp"

namespace palpate {
namespace {

constexpr int touches = 12;  // of --quick
constexpr int trials = 20;

std::string content_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Every curve is whole, and its numbers are what they say.
void expect_sound(const nlohmann::json& filter) {
  const auto& curve = filter.at("curve");
  ASSERT_EQ(curve.size(), static_cast<std::size_t>(touches));
  for (int i = 0; i < touches; ++i) {
    const auto& point = curve[i];
    EXPECT_EQ(point.at("touches"), i + 1);
    EXPECT_GE(point.at("accuracy"), 0.0);
    EXPECT_LE(point.at("accuracy"), 1.0);
    EXPECT_LE(point.at("located"), trials);
    EXPECT_EQ(point.at("error_mm").is_null(), point.at("located") == 0);
    EXPECT_EQ(point.at("refined_error_mm").is_null(),
              filter.at("filter") != "histogram" || point.at("located") == 0);
    if (!point.at("error_mm").is_null()) {
      EXPECT_GT(point["error_mm"].at("median"), 0.0);
      EXPECT_LE(point["error_mm"].at("median"), point["error_mm"].at("p95"));
    }
  }
  EXPECT_GT(curve.back().at("mean_confidence"), curve.front().at("mean_confidence"))
      << "touches make sure";
  int estimates = 0;
  for (const auto& bin : filter.at("calibration").at("bins")) {
    estimates += bin.at("count").get<int>();
    EXPECT_GE(bin.at("mean_confidence"), bin.at("lower"));
  }
  EXPECT_EQ(estimates, trials * touches);
}

/// The paper's claims that hold with this few trials: more bins know more, and at one count the
/// histogram is ahead of the particles.
void expect_order(const std::map<std::string, nlohmann::json>& filters) {
  const auto at_end = [&](const std::string& name) { return filters.at(name).at("curve").back(); };
  const auto accuracy = [&](const std::string& name) {
    return at_end(name).at("accuracy").get<double>();
  };
  const auto error_mm = [&](const std::string& name) {
    return at_end(name).at("error_mm").at("mean").get<double>();
  };
  EXPECT_LE(accuracy("histogram 100"), accuracy("histogram 1000"));
  EXPECT_LE(accuracy("histogram 1000"), accuracy("histogram 10000"));
  EXPECT_GT(error_mm("histogram 100"), error_mm("histogram 1000"));
  EXPECT_GT(error_mm("histogram 1000"), error_mm("histogram 10000"));
  EXPECT_LT(error_mm("histogram 10000"), 1.3);
  const std::string balanced = "histogram 9295";  // 13x13x55
  EXPECT_GE(accuracy(balanced), accuracy("histogram 10000"));
  EXPECT_LT(error_mm(balanced), error_mm("histogram 10000"));
  for (const char* count : {"1000", "10000"}) {
    for (const char* particles : {"particles ", "augmented "}) {
      EXPECT_GE(accuracy(std::string("histogram ") + count),
                accuracy(std::string(particles) + count));
    }
  }
}

void expect_none_to_notice(const nlohmann::json& none) {
  ASSERT_EQ(none.size(), 2U) << "after 3 and 9 touches";
  for (const auto& run : none) {
    double lost = 0.0;
    double noticed = 0.0;
    for (const auto& point : run.at("curve")) {
      EXPECT_GE(point.at("lost"), lost) << "a larger weight loses no less";
      EXPECT_GE(point.at("noticed"), noticed);
      lost = point["lost"];
      noticed = point["noticed"];
      if (run.at("touches") == 9) {
        EXPECT_GE(noticed, lost) << "better than chance at 10^" << point.at("log10_weight");
      }
    }
    EXPECT_EQ(lost, 1.0) << "the curve shows where everything is none";
    EXPECT_EQ(noticed, 1.0);
  }
}

/// The table of every touch says the same as the curves.
void expect_table_of(const std::filesystem::path& csv,
                     const std::map<std::string, nlohmann::json>& filters) {
  std::ifstream stream(csv / "trials.csv");
  std::string line;
  std::getline(stream, line);
  EXPECT_TRUE(line.starts_with("filter,count,trial,object,touches,right,")) << line;
  std::size_t lines = 0;
  std::map<std::string, int> right_at_end;
  while (std::getline(stream, line)) {
    ++lines;
    std::stringstream cells(line);
    std::array<std::string, 6> cell;  // filter, count, trial, object, touches, right
    for (std::string& text : cell) {
      std::getline(cells, text, ',');
    }
    if (cell[4] == std::to_string(touches)) {
      right_at_end[cell[0] + " " + cell[1]] += cell[5] == "1" ? 1 : 0;
    }
  }
  EXPECT_EQ(lines, filters.size() * trials * touches);
  for (const auto& [name, filter] : filters) {
    EXPECT_DOUBLE_EQ(static_cast<double>(right_at_end[name]) / trials,
                     filter.at("curve").back().at("accuracy"))
        << name;
  }
}

void expect_pictures(const std::filesystem::path& folder) {
  for (const char* name :
       {"fig6a", "fig6b", "fig7a", "fig7b", "augmented", "errors", "calibration", "none"}) {
    const std::string png = content_of(folder / (std::string(name) + ".png"));
    EXPECT_TRUE(png.starts_with("\x89PNG")) << name;
    const std::string svg = content_of(folder / (std::string(name) + ".svg"));
    EXPECT_TRUE(svg.ends_with("</svg>\n\n") || svg.ends_with("</svg>\n")) << name;
  }
  EXPECT_NE(content_of(folder / "fig7a.svg").find("paper"), std::string::npos);
}

TEST(Experiment, QuickRunKeepsThePapersOrder) {
  const ScratchFolder folder;
  ASSERT_EQ(run_bench("experiment --quick --json " + (folder / "e.json").string() + " --csv " +
                      (folder / "csv").string() + " --plots " + (folder / "plots").string()),
            0);
  const auto document = nlohmann::json::parse(content_of(folder / "e.json"));
  EXPECT_NE(document.at("data").get<std::string>().find("simulated"), std::string::npos);
  EXPECT_FALSE(document.at("cases").empty());
  std::map<std::string, nlohmann::json> filters;
  for (const auto& filter : document.at("filters")) {
    const std::string name =
        filter.at("filter").get<std::string>() + " " + filter.at("count").dump();
    EXPECT_TRUE(filters.emplace(name, filter).second) << "two filters '" << name << "'";
    expect_sound(filter);
  }
  expect_order(filters);
  expect_none_to_notice(document.at("none"));
  expect_table_of(folder / "csv", filters);
  expect_pictures(folder / "plots");
}

TEST(Experiment, MissesGnuplotBeforeItMeasures) {
  const ScratchFolder folder;
  const std::string file = folder / "e.json";
  EXPECT_EQ(run_bench("experiment --json " + file + " --plots " + (folder / "plots").string() +
                          " 2>" + (folder / "messages").string(),
                      "PATH=/nowhere "),
            1);
  const std::string messages = content_of(folder / "messages");
  EXPECT_NE(messages.find("gnuplot"), std::string::npos) << messages;
  EXPECT_EQ(std::count(messages.begin(), messages.end(), '\n'), 1) << messages;
  EXPECT_FALSE(std::filesystem::exists(file));
}

TEST(Experiment, RefusesWhatCannotBe) {
  const ScratchFolder folder;
  EXPECT_EQ(run_bench("experiment --trials 0 2>/dev/null"), 2);
  EXPECT_EQ(run_bench("experiment --touches 193 2>/dev/null"), 2);
  std::ofstream(folder / "file") << "no folder";
  EXPECT_EQ(run_bench("experiment --csv " + (folder / "file/csv").string() + " 2>/dev/null"), 2);
  EXPECT_EQ(run_bench("experiment --csv " + (folder / "file").string() + " 2>/dev/null"), 2);
}

}  // namespace
}  // namespace palpate
