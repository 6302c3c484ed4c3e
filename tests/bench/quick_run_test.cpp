#include <cmath>
#include <fstream>
#include <map>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "bench_program.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::quick_run_test {

/// The value of a measurement, which must be there.
double value_of(const nlohmann::json& measured, const std::string& name) {
  for (const auto& m : measured.at("measurements")) {
    if (m.at("name") == name) {
      return m.at("value");
    }
  }
  ADD_FAILURE() << measured.at("name") << " has no '" << name << "'";
  return NAN;
}

// Some 24 seconds of a processor, for eleven measurements: a thousand touches in a row, in each of
// 50,000 bins, take five of them.
TEST(PalpateBench, QuickRunFillsTheDocumentAndKeepsTheErrorBounds) {
  const ScratchFolder folder;
  const std::string file = folder / "bench.json";
  ASSERT_EQ(run_bench("kernels --quick --json " + file), 0);
  const auto document = nlohmann::json::parse(std::ifstream(file));
  for (const char* fact : {"device", "compiler", "date", "command line"}) {
    EXPECT_FALSE(document.at(fact).get<std::string>().empty()) << fact;
  }

  std::map<std::string, nlohmann::json> cases;
  for (const auto& measured : document.at("cases")) {
    const std::string name = measured.at("name");
    EXPECT_TRUE(cases.emplace(name, measured).second) << "two cases '" << name << "'";
    EXPECT_FALSE(measured.at("measurements").empty()) << name;
    for (const auto& m : measured.at("measurements")) {
      const std::string what = name + ": " + m.at("name").get<std::string>();
      EXPECT_TRUE(std::isfinite(m.at("value").get<double>())) << what;
      const std::string unit = m.at("unit");
      EXPECT_FALSE(unit.empty()) << what;
      EXPECT_EQ(m.contains("reached"), m.contains("at_most") || m.contains("at_least")) << what;
      // The goals that are errors do not depend on how busy the machine is.
      if (unit.starts_with("nats") && m.contains("reached")) {
        EXPECT_TRUE(m.at("reached")) << what << " = " << m.at("value");
      }
    }
  }
  EXPECT_EQ(cases.size(), 11U);

  for (const char* name : {"likelihood 200x200x4", "likelihood 100x100x4", "likelihood 25x25x16"}) {
    const nlohmann::json& measured = cases.at(name);
    EXPECT_FALSE(measured.at("path").empty());
    EXPECT_LT(value_of(measured, "largest error"), 1e-4) << name;
    // Baselines that computed something else would be no baselines.
    EXPECT_LT(value_of(measured, "one-bin kernel's largest error"), 1e-4) << name;
    EXPECT_LT(value_of(measured, "CPU loop's largest error"), 1e-4) << name;
    EXPECT_GT(value_of(measured, "per bin, element and touch"), 0.0) << name;
    EXPECT_GE(value_of(measured, "device memory"), 8.0) << "two floats per bin";
  }
  for (const char* name : {"accuracy 100x100x1", "accuracy 25x25x2"}) {
    EXPECT_LT(value_of(cases.at(name), "largest error at touch 1000"), 1e-2) << name;
  }
  EXPECT_EQ(value_of(cases.at("reductions 200x200x4"), "two runs of equal bits"), 1.0);
  EXPECT_LT(value_of(cases.at("maps at 0.1 mm"), "largest error"), 1e-3);
  for (const char* name : {"map stream of one spot", "map stream of a letter"}) {
    // Increments to a few parts in 1e7, up to some tenfold cancellation of contact by no contact.
    EXPECT_LT(value_of(cases.at(name), "largest relative error"), 1e-5) << name;
  }
  const nlohmann::json& unknowns = cases.at("many unknowns");
  EXPECT_EQ(value_of(unknowns, "of 3, other bits than one by one"), 0.0);
  // Nine touches tell the letters apart, by the paper; a seed may be unlucky.
  EXPECT_GT(value_of(unknowns, "letter of the mode is right"), 90.0);
  EXPECT_GT(value_of(unknowns, "a process per unknown"), 0.0);
  EXPECT_GT(value_of(unknowns, "palpate batch by bounds"), 0.0);
  EXPECT_GT(value_of(cases.at("latency 25x25x16"), "device, by its clock"), 0.0);
}

TEST(PalpateBench, RefusesAFileThatCannotBeWrittenBeforeItMeasures) {
  const ScratchFolder folder;
  EXPECT_EQ(
      run_bench("kernels --json " + (folder / "missing/bench.json").string() + " 2>/dev/null"), 2);
}

TEST(PalpateBench, OutputThatIsLostIsAFailure) {
  const int status = std::system("'" PALPATE_BENCH "' --help >/dev/full 2>/dev/null");
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 1);
}

TEST(PalpateBench, RefusesWhatItDoesNotKnow) {
  EXPECT_EQ(run_bench("kernels --slowly 2>/dev/null"), 2);
  EXPECT_EQ(run_bench("2>/dev/null"), 2);
}

}  // namespace palpate::quick_run_test
