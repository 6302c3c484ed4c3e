#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "bench_program.hpp"
#include "io/scratch_folder.hpp"

namespace palpate::experiment_test {

constexpr int touches = 12;  // of --quick
constexpr int trials = 20;
const std::string balanced = "histogram 9295";  // 13x13x55

using Filters = std::map<std::string, nlohmann::json>;

/// Filters of a document by their names and counts, such as "histogram 1000".
Filters by_name(const nlohmann::json& list) {
  Filters filters;
  for (const auto& filter : list) {
    const std::string name =
        filter.at("filter").get<std::string>() + " " + filter.at("count").dump();
    EXPECT_TRUE(filters.emplace(name, filter).second) << "two filters '" << name << "'";
  }
  return filters;
}

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
    const double accuracy = point.at("accuracy");
    const double low = point.at("accuracy_low");
    const double high = point.at("accuracy_high");
    EXPECT_TRUE(0.0 <= low && low <= accuracy && accuracy <= high && high <= 1.0)
        << low << ", " << accuracy << ", " << high;
    // Of 20 trials: from 0.16, where all are right, to 0.40, where half are.
    EXPECT_TRUE(high - low > 0.15 && high - low < 0.41) << low << ", " << high;
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

/// What trials.csv says of one filter after one touch of one trial.
struct TrialTouch {
  bool right = false;
  std::optional<double> error_mm;
};
using Trials = std::vector<std::vector<TrialTouch>>;  ///< [trial][touch]

std::map<std::string, Trials> read_trials(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  EXPECT_EQ(line, "filter,count,trial,object,touches,right,confidence,error_mm,refined_error_mm");
  std::map<std::string, Trials> filters;
  while (std::getline(stream, line)) {
    std::stringstream cells(line);
    std::array<std::string, 8> cell;
    for (std::string& text : cell) {
      std::getline(cells, text, ',');
    }
    Trials& of_filter = filters[cell[0] + " " + cell[1]];
    of_filter.resize(std::max(of_filter.size(), std::stoul(cell[2]) + 1));
    std::vector<TrialTouch>& trial = of_filter[std::stoul(cell[2])];
    trial.push_back({.right = cell[5] == "1", .error_mm = {}});
    EXPECT_EQ(trial.size(), std::stoul(cell[4])) << "a touch is missing: " << line;
    if (!cell[7].empty()) {
      trial.back().error_mm = std::stod(cell[7]);
    }
  }
  return filters;
}

/// The table of every touch says the same as the curves.
void expect_table_of(const std::map<std::string, Trials>& table, const Filters& filters) {
  ASSERT_EQ(table.size(), filters.size());
  for (const auto& [name, filter] : filters) {
    const Trials& of_filter = table.at(name);
    ASSERT_EQ(of_filter.size(), static_cast<std::size_t>(trials)) << name;
    for (int touch = 0; touch < touches; ++touch) {
      const auto right = std::count_if(
          of_filter.begin(), of_filter.end(),
          [&](const std::vector<TrialTouch>& trial) { return trial.at(touch).right; });
      EXPECT_DOUBLE_EQ(static_cast<double>(right) / trials,
                       filter.at("curve")[touch].at("accuracy"))
          << name << " after " << touch + 1 << " touches";
    }
  }
}

/// What the paper says of identity, as far as so few trials can tell: all of them right, or a lead
/// of half of what was measured.
void expect_identity(const Filters& filters) {
  const auto accuracy = [&](const std::string& name, int after) {
    return filters.at(name).at("curve")[after - 1].at("accuracy").get<double>();
  };
  for (int after = 9; after <= touches; ++after) {
    EXPECT_EQ(accuracy(balanced, after), 1.0) << "as the paper's 10,000 bins, after " << after;
  }
  EXPECT_EQ(accuracy("histogram 1000", touches), 1.0);
  EXPECT_LT(accuracy("histogram 100", touches), 0.95) << "bins of 90 degrees";
  const auto mean_accuracy = [&](const std::string& name) {
    double sum = 0.0;
    for (int after = 1; after <= touches; ++after) {
      sum += accuracy(name, after);
    }
    return sum / touches;
  };
  for (const char* particles : {"particles 1000", "augmented 1000"}) {
    EXPECT_GT(mean_accuracy("histogram 1000"), mean_accuracy(particles) + 0.1) << particles;
  }
}

/// More bins err less, and balanced ones least, in the trials that both locate at the end.
void expect_finer_bins_to_err_less(const std::map<std::string, Trials>& table) {
  const auto expect_ratio = [&](const std::string& coarse, const std::string& fine,
                                double at_most) {
    double coarse_mm = 0.0;
    double fine_mm = 0.0;
    int both = 0;
    for (int trial = 0; trial < trials; ++trial) {
      const TrialTouch& a = table.at(coarse)[trial].back();
      const TrialTouch& b = table.at(fine)[trial].back();
      if (a.error_mm && b.error_mm) {
        coarse_mm += *a.error_mm;
        fine_mm += *b.error_mm;
        ++both;
      }
    }
    EXPECT_GE(both, trials / 2) << coarse << ", " << fine;
    EXPECT_LT(fine_mm, at_most * coarse_mm) << coarse << ", " << fine;
  };
  // Measured: 0.26, 0.46 and 0.77.
  expect_ratio("histogram 100", "histogram 1000", 0.6);
  expect_ratio("histogram 1000", "histogram 10000", 0.7);
  expect_ratio("histogram 10000", balanced, 0.9);
}

/// An array that is not where it is reported costs accuracy of the pose, the more the further.
void expect_pose_noise_to_cost(const nlohmann::json& pose_noise, const Filters& exact) {
  ASSERT_EQ(pose_noise.size(), 2U);
  std::map<std::string, double> error_mm;
  for (const auto& [name, filter] : exact) {
    error_mm[name] = filter.at("curve").back().at("error_mm").at("mean");
  }
  double translation_mm = 0.0;
  for (const auto& noisy : pose_noise) {
    EXPECT_GT(noisy.at("translation_mm"), translation_mm);
    translation_mm = noisy["translation_mm"];
    const Filters filters = by_name(noisy.at("filters"));
    EXPECT_EQ(filters.size(), 3U);
    for (const auto& [name, filter] : filters) {
      ASSERT_EQ(filter.at("curve").size(), static_cast<std::size_t>(touches));
      const double noisy_mm = filter["curve"].back().at("error_mm").at("mean");
      EXPECT_GT(noisy_mm, 1.05 * error_mm.at(name)) << name << ", " << translation_mm << " mm";
      error_mm[name] = noisy_mm;
    }
  }
}

void expect_pictures(const std::filesystem::path& folder) {
  for (const char* name : {"fig6a", "fig6b", "fig7a", "fig7b", "augmented", "errors", "refined",
                           "pose_noise", "calibration"}) {
    const std::string png = content_of(folder / (std::string(name) + ".png"));
    EXPECT_TRUE(png.starts_with("\x89PNG")) << name;
    const std::string svg = content_of(folder / (std::string(name) + ".svg"));
    EXPECT_TRUE(svg.ends_with("</svg>\n")) << name;
  }
}

TEST(Experiment, QuickRunKeepsThePapersOrder) {
  const ScratchFolder folder;
  ASSERT_EQ(run_bench("experiment --quick --json " + (folder / "e.json").string() + " --csv " +
                      (folder / "csv").string() + " --plots " + (folder / "plots").string()),
            0);
  const auto document = nlohmann::json::parse(content_of(folder / "e.json"));
  EXPECT_NE(document.at("data").get<std::string>().find("simulated"), std::string::npos);
  EXPECT_FALSE(document.at("cases").empty());
  const Filters filters = by_name(document.at("filters"));
  for (const auto& [name, filter] : filters) {
    expect_sound(filter);
  }
  const std::map<std::string, Trials> table = read_trials(folder / "csv/trials.csv");
  expect_table_of(table, filters);
  expect_identity(filters);
  expect_finer_bins_to_err_less(table);
  expect_pose_noise_to_cost(document.at("pose_noise"), filters);
  expect_pictures(folder / "plots");
  expect_no_file_written_twice("experiment --csv " + (folder / "csv").string(), folder / "csv");
  expect_no_file_written_twice("experiment --plots " + (folder / "plots").string(),
                               folder / "plots");
}

TEST(Experiment, RefusesWhatCannotBe) {
  const ScratchFolder folder;
  EXPECT_EQ(run_bench("experiment --trials 0 2>/dev/null"), 2);
  EXPECT_EQ(run_bench("experiment --touches 193 2>/dev/null"), 2);
  std::ofstream(folder / "file") << "no folder";
  EXPECT_EQ(run_bench("experiment --csv " + (folder / "file/csv").string() + " 2>/dev/null"), 2);
  EXPECT_EQ(run_bench("experiment --csv " + (folder / "file").string() + " 2>/dev/null"), 2);
}

}  // namespace palpate::experiment_test
