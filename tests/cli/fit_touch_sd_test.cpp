#include <map>

#include "program.hpp"
#include "sample_files.hpp"

namespace palpate::fit_touch_sd_test {

using nlohmann::json;

class FitTouchSd : public ProgramTest {
 protected:
  FitTouchSd() {
    std::filesystem::create_directory(folder_ / "maps");
    write_map(folder_ / "maps/A.map.h5", sample_map("A"));
    write_map(folder_ / "maps/I.map.h5", sample_map("I"));
    write_recording(folder_ / "u.h5", sample_unknown("A", {{2.0, -3.0}, 1.0}, 4));
    write_recording(folder_ / "v.h5", sample_unknown("I", {{1.0, 2.0}, 0.3}, 4));
  }

  const std::vector<std::string> fit_{"recognize", "u.h5",           "v.h5",       "--maps",
                                      "maps",      "--fit-touch-sd", "--touches=2"};
};

TEST_F(FitTouchSd, ReportsTheDeviationsAndTheFlagsToPaste) {
  std::vector<std::string> with_json = fit_;
  with_json.insert(with_json.end(), {"--json", "fit.json"});
  const std::string text = done(with_json);
  const json fit = json::parse(bytes_of(folder_ / "fit.json"));
  EXPECT_EQ(fit["unknowns"], 2);
  EXPECT_EQ(fit["touches"], 4);
  EXPECT_GE(fit["touch_sd"]["mm"], 0.0);
  EXPECT_GE(fit["touch_sd"]["deg"], 0.0);
  EXPECT_EQ(fit["exact"]["mm"], fit["touch_sd"]["mm"] == 0.0);
  EXPECT_EQ(text.find("cannot be told from 0") != std::string::npos,
            fit["exact"]["mm"] || fit["exact"]["deg"])
      << text;
  EXPECT_NE(text.find("\n" + fit["flags"].get<std::string>() + "\n"), std::string::npos) << text;
  EXPECT_NE(text.find("fewer than 3 touches"), std::string::npos) << text;
}

TEST_F(FitTouchSd, SearchesByBoundsOnTheHost) {
  std::vector<std::string> bounded = fit_;
  bounded.insert(bounded.end(), {"--filter", "bounded", "--json", "fit.json"});
  done(bounded);
  const json fit = json::parse(bytes_of(folder_ / "fit.json"));
  EXPECT_EQ(fit["device"], "none");
  EXPECT_EQ(fit["touches"], 4);
}

TEST_F(FitTouchSd, IsRefusedBesideFlagsOfOneResult) {
  for (const char* flag : {"--trace", "--posterior=p.h5", "--png=pictures", "--filter=particles",
                           "--budget-ms=9", "--evidence-nats=1"}) {
    std::vector<std::string> with_flag = fit_;
    with_flag.emplace_back(flag);
    expect_refused(with_flag, {"--fit-touch-sd"});
  }
  expect_refused({"recognize", "u.h5", "--maps", "maps", "--fit-touch-sd", "--each-frame"},
                 {"--each-frame", "--fit-touch-sd"});
}

TEST_F(FitTouchSd, IsRefusedBesideOtherUncertainties) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> refused{
      {"--touch-sd-mm=1", {"--touch-sd-mm"}},    {"--touch-sd-deg=3", {"--touch-sd-deg"}},
      {"--slip-sd-mm=0.5", {"--slip-sd-mm"}},    {"--slip-sd-deg=2", {"--slip-sd-deg"}},
      {"--none=2", {"--none", "maps' objects"}},
  };
  for (const auto& [flag, named] : refused) {
    std::vector<std::string> with_flag = fit_;
    with_flag.push_back(flag);
    std::vector<std::string> words = named;
    words.emplace_back("--fit-touch-sd");
    expect_refused(with_flag, words);
  }
}

TEST_F(FitTouchSd, IsRefusedWhereTheSceneHasOtherUncertainties) {
  for (const auto& [keys, named] : std::map<std::string, std::string>{
           {"touch_sd: {mm: 1, deg: 3}\n", "scene's touch_sd"},
           {"slip_sd: {mm: 0.5}\n", "scene's slip_sd"},
           {"none: 2\n", "scene's none"},
       }) {
    put_bytes(folder_ / "scene.yaml", keys);
    std::vector<std::string> with_scene = fit_;
    with_scene.insert(with_scene.end(), {"--scene", "scene.yaml"});
    expect_refused(with_scene, {"--fit-touch-sd", named});
  }
}

}  // namespace palpate::fit_touch_sd_test
