#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "bench_program.hpp"
#include "io/scratch_folder.hpp"

namespace palpate::beliefs_test {

nlohmann::json quick_run(const ScratchFolder& folder, const std::string& part) {
  const std::string file = (folder / (part + ".json")).string();
  EXPECT_EQ(run_bench("beliefs --quick --part " + part + " --json " + file + " --plots " +
                      (folder / "plots").string()),
            0);
  return nlohmann::json::parse(std::ifstream(file));
}

/// A field of the one record that has these values.
double value_where(const nlohmann::json& records, const nlohmann::json& values,
                   const std::string& pointer) {
  double value = 0.0;
  int found = 0;
  for (const auto& record : records) {
    bool alike = true;
    for (const auto& [name, wanted] : values.items()) {
      alike = alike && record.at(name) == wanted;
    }
    if (alike) {
      value = record.at(nlohmann::json::json_pointer(pointer));
      ++found;
    }
  }
  EXPECT_EQ(found, 1) << values;
  return value;
}

void expect_files(const ScratchFolder& folder, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    EXPECT_GT(std::filesystem::file_size(folder / "plots" / name), 1000U) << name;
  }
}

TEST(Beliefs, OfMisplacedTouchesAreLessSureOfThemselvesWhereAveraged) {
  const ScratchFolder folder;
  const auto records = quick_run(folder, "misplaced").at("misplaced");
  EXPECT_EQ(records.size(), 16U) << "two displacements, four counts of touches, two beliefs";
  for (const double noise_mm : {1.0, 2.0}) {
    const auto after_12 = [&](const char* belief, const char* field) {
      return value_where(records, {{"noise_mm", noise_mm}, {"touches", 12}, {"belief", belief}},
                         field);
    };
    // Of ten unknowns; over 200 the plain belief's is five times that of the averaged one or more.
    EXPECT_GT(after_12("as if exact", "/normalised_error/mean"),
              2.0 * after_12("averaged", "/normalised_error/mean"));
    EXPECT_LT(after_12("averaged", "/refined_mm/mean"), noise_mm * 1.5);
  }
  expect_files(folder, {"misplaced.png", "misplaced.svg", "sureness.png", "sureness.svg",
                        "misplaced_unknown.png"});
}

TEST(Beliefs, TellHowFarTouchesAreMisplaced) {
  const ScratchFolder folder;
  const auto records = quick_run(folder, "touch-sd").at("touch-sd");
  ASSERT_EQ(records.size(), 1U);
  const auto& fit = records.at(0);
  EXPECT_EQ(fit.at("true").at("mm"), 1.0);
  // Ten unknowns of six touches leave standard errors of 8 and 25 %; these are more than two.
  EXPECT_NEAR(fit.at("fitted").at("mm"), 1.0, 0.3);
  EXPECT_NEAR(fit.at("fitted").at("rad"), 0.05, 0.03);
  EXPECT_GT(fit.at("gain_nats"), 0.0);
}

TEST(Beliefs, CallUnlearnedShapesNoneMoreOftenWithTouches) {
  const ScratchFolder folder;
  const auto records = quick_run(folder, "none").at("none");
  const auto exact_after = [&](int touches, const char* field) {
    return value_where(records, {{"name", "exact, ±10 mm"}, {"touches", touches}}, field);
  };
  // Twenty letters and 16 shapes; over 200 and 160 none calls less than 1 % and more than 90 %.
  EXPECT_LE(exact_after(9, "/learned_called_none"), 0.1);
  EXPECT_GE(exact_after(15, "/unlearned_called_none"), 0.75);
  EXPECT_GE(exact_after(9, "/told_apart"), 0.9);
  expect_files(folder, {"none.png", "none.svg"});
}

TEST(Beliefs, FollowAnObjectThatSlips) {
  const ScratchFolder folder;
  const auto document = quick_run(folder, "slip");
  const auto& followed = document.at("slip").at(0);
  EXPECT_EQ(followed.at("belief"), "with slip_sd");
  EXPECT_EQ(followed.at("curve").size(), 12U);
  // After twelve touches on bins of 1 mm and 4.8 degrees.
  EXPECT_LT(followed.at("curve").back().at("mode_mm"), 2.0);
  expect_files(folder, {"slip.png", "slip.svg"});
}

TEST(Beliefs, LearnFromPlannedTouchesNoLessThanFromRandomOnes) {
  const ScratchFolder folder;
  const auto records = quick_run(folder, "plan").at("plan");
  const auto entropy_after_3 = [&](const char* order) {
    return value_where(records, {{"order", order}}, "/curve/2/entropy/mean");
  };
  // Five unknowns; over 100 planned touches leave 0.4 nats less.
  EXPECT_LT(entropy_after_3("planned"), entropy_after_3("random") + 0.5);
  expect_files(folder, {"plan.png", "plan.svg"});
}

TEST(Beliefs, CostWhatIsMeasured) {
  const ScratchFolder folder;
  const auto document = quick_run(folder, "cost");
  EXPECT_FALSE(document.at("cases").empty());
  for (const auto& measured : document.at("cases")) {
    for (const auto& m : measured.at("measurements")) {
      EXPECT_GT(m.at("value"), 0.0) << measured.at("name") << ": " << m.at("name");
    }
  }
}

TEST(Beliefs, RefuseWhatCannotBe) {
  EXPECT_EQ(run_bench("beliefs --trials 0 2>/dev/null"), 2);
  EXPECT_EQ(run_bench("beliefs --part nonsense 2>/dev/null"), 2);
}

}  // namespace palpate::beliefs_test
