#include <numbers>

#include <fmt/format.h>

#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::scene_test {

using nlohmann::json;

const Pose true_pose{{2.0, -3.0}, 1.0};

class SceneFile : public ProgramTest {
 protected:
  SceneFile() {
    std::filesystem::create_directory(folder_ / "scene");
    write_map(folder_ / "scene/A.map.h5", sample_map("A"));
    write_map(folder_ / "scene/I.map.h5", sample_map("I"));
    write_recording(folder_ / "u.h5", sample_unknown("A", true_pose, 6));
  }

  /// The record of u.h5 with this scene, which lies beside its maps, and these flags.
  json with_scene(const std::string& yaml, std::vector<std::string> flags = {}) const {
    put_bytes(folder_ / "scene/scene.yaml", yaml);
    flags.insert(flags.begin(), {"u.h5", "--scene", "scene/scene.yaml"});
    return record(flags);
  }
  json with_flags(std::vector<std::string> flags) const {
    flags.insert(flags.begin(), {"u.h5", "--maps", "scene/A.map.h5", "scene/I.map.h5"});
    return record(flags);
  }
};

const std::string both_maps = "objects: [{map: A.map.h5}, {map: I.map.h5}]\n";

// What two runs have to agree on.
void expect_same(const json& a, const json& b) {
  EXPECT_EQ(a["mode"], b["mode"]);
  EXPECT_EQ(a["identity"], b["identity"]);
  EXPECT_EQ(a["error_mm"], b["error_mm"]);
}

struct Setting {
  const char* name;
  const char* key;
  const char* flag;

  friend void PrintTo(const Setting& setting, std::ostream* out) { *out << setting.flag; }
};

/// Recognises by bounds, which need no device, but where filter and device are what is set.
class SceneSetting : public SceneFile, public testing::WithParamInterface<Setting> {
 protected:
  static std::vector<std::string> with_filter(std::vector<std::string> flags) {
    if (std::string(GetParam().name) != "filter" && std::string(GetParam().name) != "device") {
      flags.emplace_back("--filter=bounded");
    }
    return flags;
  }
};

class SceneKey : public SceneSetting {};

TEST_P(SceneKey, DoesWhatItsFlagDoes) {
  expect_same(with_scene(both_maps + GetParam().key, with_filter({})),
              with_flags(with_filter({GetParam().flag})));
}

INSTANTIATE_TEST_SUITE_P(
    All, SceneKey,
    testing::Values(Setting{"threshold", "threshold: 5", "--threshold=5"},
                    Setting{"ratio", "ratio: 0.6", "--ratio=0.6"},
                    Setting{"gamma", "gamma: 0.3", "--gamma=0.3"},
                    Setting{"prior", "prior: 0.35", "--prior=0.35"},
                    Setting{"x_mm", "region: {x_mm: [-4, 9]}", "--x-mm=-4:9"},
                    Setting{"y_mm", "region: {y_mm: [-4, 9]}", "--y-mm=-4:9"},
                    Setting{"theta_deg", "region: {theta_deg: [10, 80]}", "--theta-deg=10:80"},
                    Setting{"pivot_mm", "region: {pivot_mm: [3, -2]}", "--pivot-mm=3,-2"},
                    Setting{"bins", "bins: [8, 9, 10]", "--bins=8x9x10"},
                    Setting{"none", "none: 0.5", "--none=0.5"},
                    Setting{"auto_none", "none: auto", "--none"},
                    Setting{"touch_sd", "touch_sd: {mm: 1}", "--touch-sd-mm=1"},
                    Setting{"filter", "filter: histogram", "--filter=histogram"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST_F(SceneFile, ObjectsSlipAsByTheFlags) {
  expect_same(with_scene(both_maps + "slip_sd: {deg: 9}\nbins: [9, 9, 40]\n"),
              with_flags({"--slip-sd-deg=9", "--bins=9x9x40"}));
}

class SceneOverride : public SceneSetting {};

TEST_P(SceneOverride, AFlagOverridesItsKey) {
  const std::vector<std::string> flags = with_filter({GetParam().flag});
  expect_same(with_scene(both_maps + GetParam().key, flags), with_flags(flags));
}

INSTANTIATE_TEST_SUITE_P(
    All, SceneOverride,
    testing::Values(Setting{"threshold", "threshold: 90", "--threshold=3"},
                    Setting{"ratio", "ratio: 0.9", "--ratio=0.2"},
                    Setting{"gamma", "gamma: 0.9", "--gamma=0.2"},
                    Setting{"prior", "prior: 0.9", "--prior=0.2"},
                    Setting{"x_mm", "region: {x_mm: [8, 9]}", "--x-mm=-8:8"},
                    Setting{"y_mm", "region: {y_mm: [8, 9]}", "--y-mm=-8:8"},
                    Setting{"theta_deg", "region: {theta_deg: [200, 210]}", "--theta-deg=0:180"},
                    Setting{"pivot_mm", "region: {pivot_mm: [90, 90]}", "--pivot-mm=1,1"},
                    Setting{"bins", "bins: [1, 1, 1]", "--bins=12x12x12"},
                    Setting{"auto_bins", "bins: auto", "--bins=12x12x12"},
                    Setting{"none", "none: 1e300", "--none=0.5"},
                    Setting{"none_by_auto", "none: 1e300", "--none"},
                    Setting{"touch_sd", "touch_sd: {mm: 5}", "--touch-sd-mm=1"},
                    Setting{"filter", "filter: particles", "--filter=histogram"},
                    Setting{"device", "device: no such device", "--device=0"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST_F(SceneFile, MapsOverrideObjects) {
  const json r = with_scene("objects: [{map: missing.map.h5}]\n", {"--maps", "scene/A.map.h5"});
  EXPECT_EQ(r["best"], "A");
}

TEST_F(SceneFile, PathsAreRelativeToTheScene) {
  std::filesystem::create_directory(folder_ / "scene/below");
  std::filesystem::rename(folder_ / "scene/A.map.h5", folder_ / "scene/below/A.map.h5");
  EXPECT_EQ(with_scene("objects: [{map: below/A.map.h5}]\n")["best"], "A");
}

TEST_F(SceneFile, WeightsMultiplyTheOdds) {
  const std::vector<std::string> unsure{"--touches", "1", "--bins", "9x9x8"};
  const json even = with_scene(both_maps, unsure);
  const json weighted =
      with_scene("objects: [{map: A.map.h5, weight: 3}, {map: I.map.h5, weight: 0.5}]\n", unsure);
  const auto odds = [](const json& r) {
    return r["identity"]["A"].get<double>() / r["identity"]["I"].get<double>();
  };
  EXPECT_NEAR(odds(weighted) / odds(even), 6.0, 1e-4);  // the device sums in floats
  EXPECT_EQ(with_scene("objects: [{map: A.map.h5, weight: 3}]\n", {"--filter=bounded"})["mode"],
            with_scene("objects: [{map: A.map.h5}]\n", {"--filter=bounded"})["mode"])
      << "the log-likelihood is without prior weights";
}

TEST_F(SceneFile, LabelOverridesTheMaps) {
  const json r = with_scene("objects: [{map: A.map.h5, label: roof}, {map: I.map.h5}]\n");
  EXPECT_TRUE(r["identity"].contains("roof"));
  EXPECT_EQ(r["mode"]["object"], "roof");
  EXPECT_EQ(r["best"], "roof");
  EXPECT_EQ(r["right"], false) << "the truth is named A";
}

TEST_F(SceneFile, SymmetryOverridesTheMaps) {
  write_recording(folder_ / "u.h5", sample_unknown("I", true_pose, 6));
  // The I turned by half a turn about its centre: the angle is out by 180 degrees, or by nothing.
  const double turned_deg = (true_pose.theta_rad + std::numbers::pi) * 180.0 / std::numbers::pi;
  const std::vector<std::string> turned{fmt::format("--theta-deg={0}:{0}", turned_deg)};
  const auto error = [&](const char* symmetry) {
    return with_scene(fmt::format("objects: [{{map: I.map.h5, symmetry: {}}}]\n", symmetry),
                      turned)["error_mm"]
        .get<double>();
  };
  EXPECT_GT(error("1"), 10.0) << "2 sqrt(J) of a 25 mm bar";
  const double of_half_turns = error("2");
  EXPECT_LT(of_half_turns, 1.2) << "the diagonal of a bin of 0.8 mm";
  EXPECT_DOUBLE_EQ(error("0"), of_half_turns);
}

class SceneArray : public SceneFile {
 protected:
  SceneArray() : usual_(with_flags({})), coarse_(with_flags(coarse_bins_)) {
    Recording recording = read_recording(folder_ / "u.h5");
    for (glm::dvec2& element : recording.elements_mm) {
      element *= 3.0;  // a wrong array, for the scene to correct
      list_ += fmt::format("{}[{}, {}]", list_.empty() ? "" : ", ", element.x / 3, element.y / 3);
      file_ += fmt::format("{} {}\n", element.x / 3, element.y / 3);
    }
    write_recording(folder_ / "u.h5", recording);
  }

  // Where nothing fits, as with a wrong array, many bins take long.
  const std::vector<std::string> coarse_bins_{"--bins=25x25x16"};
  json usual_;
  json coarse_;
  std::string list_;
  std::string file_ = "# x y in mm\n";
};

TEST_F(SceneArray, TakesThePlaceOfTheRecordings) {
  EXPECT_NE(with_flags(coarse_bins_)["mode"], coarse_["mode"]);
  expect_same(with_scene(both_maps + "array: digitacts\n"), usual_);
  put_bytes(folder_ / "scene/array.txt", file_);
  for (const std::string& array : {std::string("array.txt"), "[" + list_ + "]"}) {
    const json r = with_scene(both_maps + "array: " + array + "\n");
    EXPECT_EQ(r["T_robot_object"], usual_["T_robot_object"]) << array;
    // Tripled and divided by three, positions may differ by a rounding.
    EXPECT_NEAR(r["mode"]["log_likelihood"].get<double>(),
                usual_["mode"]["log_likelihood"].get<double>(), 1e-3);
  }
}

}  // namespace palpate::scene_test
