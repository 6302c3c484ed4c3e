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

  json recognized(const Recording& unknown, const std::string& flags) const {
    write_recording(folder_ / "u.h5", unknown);
    return record("u.h5 --bins 9x9x8 " + flags);
  }

  Recording unknown_ = sample_unknown("A", {{2.0, -3.0}, 1.0}, 6);
};

TEST_F(HardCaseOnTheCommandLine, SubnormalPressuresAreReadingsLikeAnyOther) {
  Recording whole = unknown_;
  whole.pressure_unit = "raw";
  for (std::size_t i = 0; i < whole.pressure.size(); ++i) {
    // Half of the largest is a whole number, of which subnormals lose nothing.
    whole.pressure[i] =
        i % whole.elements() == 14 ? 12.0 : std::min(std::floor(whole.pressure[i]), 11.0);
  }
  Recording subnormal = whole;
  for (double& pressure : subnormal.pressure) {
    pressure *= std::numeric_limits<double>::denorm_min();
  }
  const std::string flags = "--maps A.map.h5 I.map.h5 --ratio 0.5 --threshold ";
  const json expected = recognized(whole, flags + "2");
  const json r = recognized(subnormal, flags + "1e-323");
  EXPECT_LT(expected["mode"]["log_likelihood"], -1.0) << "nothing was said";
  EXPECT_EQ(r["mode"], expected["mode"]);
  EXPECT_EQ(r["identity"], expected["identity"]);
}

TEST_F(HardCaseOnTheCommandLine, WeightsOfASceneMayDifferByThirtyOrders) {
  const auto with_weight = [&](const std::string& weight) {
    put_bytes(folder_ / "scene.yaml",
              "objects: [{map: A.map.h5, weight: " + weight + "}, {map: I.map.h5, weight: 1}]\n");
    return recognized(unknown_, "--scene scene.yaml --none 0 --touches 2");
  };
  const auto log_odds = [](const json& r) {
    return std::log(r["identity"]["A"].get<double>()) - std::log(r["identity"]["I"].get<double>());
  };
  const json even = with_weight("1");
  const json uneven = with_weight("1e-30");
  // What the JSON's digits leave.
  EXPECT_NEAR(log_odds(uneven) - log_odds(even), -30.0 * std::log(10.0), 1e-5);
  EXPECT_EQ(uneven["best"], "I") << "two touches do not outweigh 69 nats";
}

TEST_F(HardCaseOnTheCommandLine, EvidenceAgainstEveryObjectIsNoMissingNumber) {
  for (const std::string letter : {"A", "I"}) {
    OccupancyGrid map = sample_map(letter);
    map.log_odds.assign(map.log_odds.size(), -1000.0F);
    write_map(folder_ / (letter + ".map.h5"), map);
  }
  unknown_.truth.reset();  // such a map has no occupied cell that a pose error could be of
  const json r = recognized(unknown_, "--maps A.map.h5 I.map.h5 --gamma 0 --trace");
  // JSON has no infinities: they would be null.
  EXPECT_EQ(r.dump().find("null"), std::string::npos) << r.dump();
  EXPECT_LT(r["mode"]["log_likelihood"], -1000.0);
  EXPECT_EQ(r["identity"]["A"], 0.5);
  EXPECT_EQ(r["identity"]["I"], 0.5);
}

}  // namespace palpate::hard_case_test
