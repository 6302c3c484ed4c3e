#include <algorithm>

#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::recognize_particles_test {

using nlohmann::json;

class RecognizeParticles : public ProgramTest {
 protected:
  RecognizeParticles() {
    std::filesystem::create_directory(folder_ / "maps");
    write_map(folder_ / "maps/A.map.h5", sample_map("A"));
    write_map(folder_ / "maps/I.map.h5", sample_map("I"));
    write_recording(folder_ / "u.h5", sample_unknown("A", {{2.0, -3.0}, 1.0}, 8));
  }

  /// The record of u.h5 by particles, less what differs from run to run.
  json by_particles(std::vector<std::string> flags) const {
    flags.insert(flags.begin(), {"u.h5", "--maps", "maps", "--filter", "particles"});
    json r = record(flags);
    r.erase("seconds");
    return r;
  }
};

TEST_F(RecognizeParticles, FindTheObjectAndItsPose) {
  const json r = by_particles({"--trace"});
  EXPECT_EQ(r["best"], "A");
  EXPECT_TRUE(r["right"]);
  // 1 mm and 0.1 rad of motion noise, and of the letter's J some 60 mm^2: sqrt(2 + 0.6) mm.
  EXPECT_LT(r["error_mm"].get<double>(), 1.6);
  EXPECT_LT(r["mode"]["log_likelihood"].get<double>(), 0.0);
  ASSERT_EQ(r["trace"].size(), 8U);
  for (const json& step : r["trace"]) {
    EXPECT_GE(step["effective_sample_size"].get<double>(), 1.0);
    EXPECT_LE(step["effective_sample_size"].get<double>(), 10'000.0);
  }
  EXPECT_EQ(r["effective_sample_size"], r["trace"].back()["effective_sample_size"]);
}

TEST_F(RecognizeParticles, DefaultsAreTheDocumentedOnes) {
  EXPECT_EQ(by_particles({"--particles", "10000", "--resampling", "multinomial", "--seed", "0"}),
            by_particles({}));
}

TEST_F(RecognizeParticles, EveryFlagMatters) {
  const json bare = by_particles({});
  for (const std::vector<std::string>& flags : {std::vector<std::string>{"--particles", "9999"},
                                                {"--resampling", "systematic"},
                                                {"--augmented"},
                                                {"--seed", "1"},
                                                {"--x-mm=-9:10"},
                                                {"--pivot-mm=1.3,0"},
                                                {"--gamma=0.3"}}) {
    EXPECT_NE(by_particles(flags), bare) << flags.front();
  }
}

TEST_F(RecognizeParticles, ASceneMayAskForThem) {
  put_bytes(folder_ / "scene.yaml", "filter: particles\n");
  json r = record({"u.h5", "--maps", "maps", "--scene", "scene.yaml"});
  r.erase("seconds");
  EXPECT_EQ(r, by_particles({}));
}

TEST_F(RecognizeParticles, ThePeoplesTraceShowsTheEffectiveParticles) {
  const Outcome outcome = palpate({"recognize", "u.h5", "--maps", "maps", "--filter", "particles",
                                   "--trace", "--augmented", "--verbose"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("effective particles"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.err.find("10000 particles, multinomial resampling, random particles added"),
            std::string::npos)
      << outcome.err;
  EXPECT_EQ(outcome.out.find("no fit"), std::string::npos) << outcome.out;
}

TEST_F(RecognizeParticles, AreDrawn) {
  by_particles({"--png", "sheets"});
  EXPECT_GT(std::filesystem::file_size(folder_ / "sheets/u.png"), 10'000U)
      << "a picture of three panels";
}

}  // namespace palpate::recognize_particles_test
