#include <cmath>
#include <limits>

#include "support/program.hpp"
#include "support/sample_files.hpp"

// Cases of docs/hard_cases.md through the program: what the library says of them must survive
// files, options and JSON.

namespace palpate::hard_case_test {

using nlohmann::json;

class HardCaseOnTheCommandLine : public ProgramTest {
 protected:
  HardCaseOnTheCommandLine() {
    write_map(folder_ / "A.map.h5", sample_map("A"));
    write_map(folder_ / "I.map.h5", sample_map("I"));
  }
};

TEST_F(HardCaseOnTheCommandLine, SubnormalPressuresAreReadingsLikeAnyOther) {
  Recording whole = sample_unknown("A", {{2.0, -3.0}, 1.0}, 6);
  whole.pressure_unit = "raw";
  for (std::size_t i = 0; i < whole.pressure.size(); ++i) {
    whole.pressure[i] = std::min(std::floor(whole.pressure[i]), 11.0);
    // Half of the largest is a whole number, of which subnormals lose nothing.
    if (i % whole.elements() == 14) {
      whole.pressure[i] = 12.0;
    }
  }
  Recording subnormal = whole;
  for (double& pressure : subnormal.pressure) {
    pressure *= std::numeric_limits<double>::denorm_min();
  }
  write_recording(folder_ / "whole.h5", whole);
  write_recording(folder_ / "subnormal.h5", subnormal);
  const auto recognized = [&](const std::string& file, const std::string& threshold) {
    return record({file, "--maps", "A.map.h5", "I.map.h5", "--threshold", threshold, "--ratio",
                   "0.5", "--bins", "9x9x8"});
  };
  const json expected = recognized("whole.h5", "2");
  const json r = recognized("subnormal.h5", "1e-323");
  EXPECT_LT(expected["mode"]["log_likelihood"], -1.0) << "nothing was said";
  EXPECT_EQ(r["mode"], expected["mode"]);
  EXPECT_EQ(r["identity"], expected["identity"]);
}

TEST_F(HardCaseOnTheCommandLine, WeightsOfASceneMayDifferByThirtyOrders) {
  write_recording(folder_ / "u.h5", sample_unknown("A", {{2.0, -3.0}, 1.0}, 2));
  const auto with_weights = [&](const std::string& a, const std::string& i) {
    put_bytes(folder_ / "scene.yaml", "objects: [{map: A.map.h5, weight: " + a +
                                          "}, {map: I.map.h5, weight: " + i + "}]\n");
    return record({"u.h5", "--scene", "scene.yaml", "--bins", "9x9x8", "--none", "0"});
  };
  const auto log_odds = [](const json& r) {
    return std::log(r["identity"]["A"].get<double>()) - std::log(r["identity"]["I"].get<double>());
  };
  const json even = with_weights("1", "1");
  const json uneven = with_weights("1e-30", "1");
  // What the JSON's digits leave.
  EXPECT_NEAR(log_odds(uneven) - log_odds(even), -30.0 * std::log(10.0), 1e-5);
  EXPECT_EQ(uneven["best"], "I") << "two touches do not outweigh 69 nats";
}

TEST_F(HardCaseOnTheCommandLine, EvidenceAgainstEveryObjectIsNoMissingNumber) {
  for (const char* letter : {"A", "I"}) {
    OccupancyGrid map = sample_map(letter);
    map.log_odds.assign(map.log_odds.size(), -1000.0F);
    write_map(folder_ / (std::string(letter) + ".map.h5"), map);
  }
  Recording unknown = sample_unknown("A", {{2.0, -3.0}, 1.0}, 6);
  unknown.truth.reset();  // such a map has no occupied cell that a pose error could be of
  write_recording(folder_ / "u.h5", unknown);
  const json r = record(
      {"u.h5", "--maps", "A.map.h5", "I.map.h5", "--gamma", "0", "--bins", "9x9x8", "--trace"});
  // JSON has no infinities: they would be null.
  EXPECT_EQ(r.dump().find("null"), std::string::npos) << r.dump();
  EXPECT_LT(r["mode"]["log_likelihood"], -1000.0);
  EXPECT_EQ(r["identity"]["A"], 0.5);
  EXPECT_EQ(r["identity"]["I"], 0.5);
}

}  // namespace palpate::hard_case_test
