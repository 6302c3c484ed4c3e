// Objects that were never learned, and touches that no map explains.

#include <algorithm>

#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::recognize_doubt_test {

using nlohmann::json;

class RecognizeDoubt : public ProgramTest {
 protected:
  RecognizeDoubt() {
    write_map(folder_ / "A.map.h5", sample_map("A"));
    write_map(folder_ / "I.map.h5", sample_map("I"));
    write_recording(folder_ / "a.h5", sample_unknown("A", {{2.0, -3.0}, 1.0}, 6));
    // An O that is called by its name is no letter of the maps.
    write_recording(folder_ / "o.h5", sample_unknown("O", {{2.0, -3.0}, 1.0}, 12));
  }

  /// An A with log odds of +-1000.
  void write_sure_map() const {
    OccupancyGrid sure = sample_map("A", 0.5);  // cells of 1 mm let an A explain an O's touches
    for (float& l : sure.log_odds) {
      l *= 250.0F;
    }
    write_map(folder_ / "sure.map.h5", sure);
  }

  json with(const char* file, std::vector<std::string> flags) const {
    flags.insert(flags.begin(), {file, "--maps", "A.map.h5", "I.map.h5"});
    return record(flags);
  }
};

TEST_F(RecognizeDoubt, NoneIsOneOfTheIdentitiesUnlessItIsTakenOut) {
  EXPECT_TRUE(with("a.h5", {})["identity"].contains("(none)"));
  EXPECT_FALSE(with("a.h5", {"--none", "0"})["identity"].contains("(none)"));
  const json r = with("a.h5", {"--none", "0.5", "--bins", "25x25x48"});
  EXPECT_EQ(r["identity"].size(), 3u);
  double sum = 0.0;
  for (const auto& p : r["identity"]) {
    sum += p.get<double>();
  }
  EXPECT_NEAR(sum, 1.0, 1e-12);  // rounding
  EXPECT_EQ(r["best"], "A");
  EXPECT_EQ(r["right"], true);
}

TEST_F(RecognizeDoubt, NonesWeightMultipliesItsOdds) {
  const auto odds = [&](const char* weight) {
    const json r = with("a.h5", {"--none", weight, "--touches", "1", "--bins", "9x9x8"});
    return r["identity"]["(none)"].get<double>() / r["identity"]["A"].get<double>();
  };
  EXPECT_NEAR(odds("6") / odds("0.5"), 12.0, 1e-9);  // rounding: the same sums on the device
}

TEST_F(RecognizeDoubt, AnObjectThatWasNeverLearnedIsRightlyNone) {
  // Unsure maps excuse a lot: an A half explains most of an O's touches. Surer ones than a sensor
  // deserves explain nothing, and leave "(none)".
  write_sure_map();
  const std::string out =
      done({"recognize", "o.h5", "--maps", "sure.map.h5", "--none", "1", "--gamma", "0", "--bins",
            "25x25x36", "--trace", "--png", "sheets", "--json", "r.json"});
  const json r = json::parse(bytes_of(folder_ / "r.json"))[0];
  EXPECT_EQ(r["best"], "(none)");
  EXPECT_EQ(r["right"], true);
  EXPECT_TRUE(r["error_mm"].is_null());
  EXPECT_NE(r["mode"]["object"], "(none)") << "the best object's bin";
  EXPECT_EQ(r["trace"].back()["best"], "(none)");
  EXPECT_TRUE(r["trace"].back()["identity"].contains("(none)"));
  EXPECT_NE(out.find("(none)"), std::string::npos) << out;
  EXPECT_NE(out.find("1 of 1 right"), std::string::npos) << out;
  EXPECT_TRUE(std::filesystem::exists(folder_ / "sheets/o.png"));
}

TEST_F(RecognizeDoubt, NoneForAnObjectThatWasLearnedIsWrong) {
  const json r = with("a.h5", {"--none", "1e300", "--touches", "1"});
  EXPECT_EQ(r["best"], "(none)");
  EXPECT_EQ(r["right"], false);
}

TEST_F(RecognizeDoubt, ContradictedTouchesAreSaidToBeSo) {
  write_sure_map();
  const std::vector<std::string> call{"o.h5", "--maps", "sure.map.h5", "--gamma", "0"};
  // Where nothing fits, bounds search a large region for long.
  for (const char* filter : {"histogram", "bounded"}) {
    std::vector<std::string> by = call;
    by.insert(by.end(), {"--bins", "20x20x16", "--filter", filter});
    EXPECT_EQ(record(by)["contradicted"], true) << filter;
  }
  std::vector<std::string> shown = call;
  shown.insert(shown.begin(), "recognize");
  shown.insert(shown.end(), {"--trace", "--bins", "20x20x16"});
  const std::string out = done(shown);
  EXPECT_NE(out.find("  contradicted\n"), std::string::npos) << out;
  EXPECT_NE(out.find("o.h5: contradicted: "), std::string::npos) << out;
  EXPECT_FALSE(with("a.h5", {}).contains("contradicted"));

  std::vector<std::string> particles = call;
  particles.insert(particles.end(), {"--filter", "particles", "--x-mm=-10:10"});
  EXPECT_EQ(record(particles)["contradicted"], true);
  EXPECT_FALSE(with("a.h5", {"--filter", "particles", "--x-mm=-10:10"}).contains("contradicted"));
}

TEST_F(RecognizeDoubt, HelpSaysWhatTheWeightMeans) {
  const std::string help = done({"recognize", "--help"});
  EXPECT_NE(help.find("--none"), std::string::npos);
  EXPECT_NE(help.find("never learned"), std::string::npos) << help;
}

}  // namespace palpate::recognize_doubt_test
