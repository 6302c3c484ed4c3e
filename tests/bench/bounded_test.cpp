#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "bench_program.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::bounded_test {

nlohmann::json quick_run(const ScratchFolder& folder, const std::string& part) {
  const std::string file = (folder / (part + ".json")).string();
  EXPECT_EQ(run_bench("bounded --quick --part " + part + " --json " + file), 0);
  return nlohmann::json::parse(std::ifstream(file));
}

/// Every case has measurements with a unit and a finite value.
void expect_sound_cases(const nlohmann::json& document) {
  EXPECT_FALSE(document.at("cases").empty());
  std::map<std::string, int> names;
  for (const auto& measured : document.at("cases")) {
    const std::string name = measured.at("name");
    EXPECT_EQ(++names[name], 1) << "two cases '" << name << "'";
    EXPECT_FALSE(measured.at("measurements").empty()) << name;
    for (const auto& m : measured.at("measurements")) {
      EXPECT_TRUE(std::isfinite(m.at("value").get<double>())) << name << ": " << m.at("name");
      EXPECT_FALSE(m.at("unit").get<std::string>().empty()) << name << ": " << m.at("name");
    }
  }
}

/// The certificates of answers that had the time they needed.
void expect_within_tolerance(const nlohmann::json& answers, std::size_t count) {
  EXPECT_EQ(answers.at("milliseconds").size(), count);
  for (const auto& dropped : answers.at("dropped_mass")) {
    EXPECT_LE(dropped, 1e-6);
  }
  for (const auto& bins : answers.at("bins_evaluated")) {
    EXPECT_GT(bins, 0.0);
  }
}

TEST(Bounded, AnswersOnAnyNumberOfThreadsWithinTheTolerance) {
  const ScratchFolder folder;
  const auto document = quick_run(folder, "speed");
  expect_sound_cases(document);
  ASSERT_EQ(document.at("speed").size(), 2U);
  for (const auto& size : document["speed"]) {
    expect_within_tolerance(size.at("all_threads"), 3);
    expect_within_tolerance(size.at("one_thread"), 3);
    EXPECT_EQ(size["all_threads"].at("bins_evaluated"), size["one_thread"].at("bins_evaluated"))
        << "the search does not depend on the threads";
    EXPECT_EQ(size.at("dense_seconds").size(), 3U);
  }
}

TEST(Bounded, IsCertainOfTheModeWithinTheTolerance) {
  const ScratchFolder folder;
  const auto document = quick_run(folder, "mode");
  expect_sound_cases(document);
  ASSERT_EQ(document.at("mode").size(), 2U) << "two tolerances";
  expect_within_tolerance(document["mode"][0].at("answers"), 3);
  EXPECT_EQ(document["mode"][0]["answers"].at("mode_certain"), 3);
}

TEST(Bounded, AnswersAfterEveryTouch) {
  const ScratchFolder folder;
  const auto document = quick_run(folder, "streaming");
  expect_sound_cases(document);
  ASSERT_EQ(document.at("streaming").size(), 9U);
  for (const auto& touch : document["streaming"]) {
    EXPECT_EQ(touch.at("milliseconds").size(), 3U);
    for (const auto& dropped : touch.at("dropped_mass")) {
      EXPECT_GE(dropped, 0.0);
      EXPECT_LE(dropped, 1.0) << "also where the budget ends the search";
    }
  }
}

TEST(Bounded, TellsWhereItSearches) {
  const ScratchFolder folder;
  const auto search = quick_run(folder, "search").at("search");
  const auto& bins = search.at("bins");
  double before = search.at("bins_in_all");
  ASSERT_EQ(search.at("stages").size(), 3U);
  for (const auto& stage : search["stages"]) {
    EXPECT_FALSE(stage.at("blocks").empty());
    for (const auto& block : stage["blocks"]) {
      const auto [level, x, nx, y, ny, thetas] = block.get<std::array<int, 6>>();
      EXPECT_GE(level, 0);
      EXPECT_TRUE(x >= 0 && nx > 0 && x + nx <= bins[0]);
      EXPECT_TRUE(y >= 0 && ny > 0 && y + ny <= bins[1]);
      EXPECT_TRUE(thetas > 0 && thetas <= bins[2]);
    }
    EXPECT_LT(stage.at("bins_evaluated"), before) << "touches leave fewer places";
    before = stage["bins_evaluated"];
  }
}

TEST(Bounded, TakesMemoryThatIsMeasured) {
  const ScratchFolder folder;
  const auto document = quick_run(folder, "large");
  expect_sound_cases(document);
  ASSERT_EQ(document.at("large").size(), 2U) << "two pivots";
  for (const auto& scene : document["large"]) {
    expect_within_tolerance(scene.at("answers"), 3);
    EXPECT_GT(scene.at("host_bytes"), 0);
  }
}

TEST(Bounded, RefusesWhatCannotBe) {
  EXPECT_EQ(run_bench("bounded --part nonsense 2>/dev/null"), 2);
}

}  // namespace palpate::bounded_test
