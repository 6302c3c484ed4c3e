// Values of flags and of scene keys that cannot be meant.

#include <algorithm>

#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::bad_value_test {

using Arguments = std::vector<std::string>;

class BadValue : public ProgramTest {
 protected:
  BadValue() {
    write_recording(folder_ / "A.h5", sample_training("A", 12));
    write_recording(folder_ / "u.h5", sample_unknown("A", {}, 3));
    write_map(folder_ / "A.map.h5", sample_map("A"));
  }

  /// Arguments with which the command succeeds.
  static Arguments good(const std::string& command) {
    if (command == "simulate") {
      return {"simulate", "A", "-o", "out.h5"};
    }
    if (command == "map") {
      return {"map", "A.h5", "-o", "new/"};
    }
    return {"recognize", "u.h5", "--maps", "A.map.h5", "--json", "r.json", "--png", "new"};
  }
};

struct Flag {
  const char* command;
  const char* flag;
  std::vector<const char*> wrong;

  friend void PrintTo(const Flag& flag, std::ostream* out) { *out << flag.flag; }
};

class BadFlag : public BadValue, public testing::WithParamInterface<Flag> {};

TEST_P(BadFlag, IsNamed) {
  const std::string flag = GetParam().flag;
  for (const char* value : GetParam().wrong) {
    Arguments arguments = good(GetParam().command);
    arguments.push_back("--" + flag + "=" + value);
    // The simulator names what it models, psf_mm, as its callers in C++ do.
    std::string name = flag;
    if (flag == "psf-mm" || flag == "noise-kpa") {
      name = flag.substr(0, 3);
    }
    expect_refused(arguments, {name, value});
  }
  Arguments empty = good(GetParam().command);
  empty.insert(empty.end(), {"--" + flag, ""});
  expect_refused(empty, {"--" + flag, "give a"});
}

INSTANTIATE_TEST_SUITE_P(
    All, BadFlag,
    testing::Values(
        Flag{"simulate", "seed", {"x", "-1", "1.5", "010", "99999999999999999999"}},
        Flag{"simulate", "poses", {"x", "random", "random:", "random:0", "random:-1", "random:x"}},
        Flag{"simulate", "psf-mm", {"x", "1x", "nan", "inf", "-1"}},
        Flag{"simulate", "noise-kpa", {"x", "1x", "nan", "inf", "-1"}},
        Flag{"simulate", "object-pose", {"x", "1,2", "1,2,3,4", "1,2,x", "1,2,nan", "1;2;3"}},
        Flag{"simulate", "touches", {"x", "0", "-1", "193", "1.5"}},
        Flag{"map", "cell-mm", {"x", "1x", "nan", "inf", "0", "-1"}},
        Flag{"map", "spread-mm", {"x", "1x", "nan", "inf", "0", "-1"}},
        Flag{"map", "touch-sd-mm", {"x", "nan", "inf", "-1"}},
        Flag{"map", "touch-sd-deg", {"x", "nan", "-1", "181"}},
        Flag{"map", "peak", {"x", "nan", "0", "-1", "1", "1.5"}},
        Flag{"map", "prior", {"x", "0.2x", "nan", "0", "-1", "1", "1.5"}},
        Flag{"map", "threshold", {"x", "1x", "nan", "inf", "-1"}},
        Flag{"map", "ratio", {"x", "nan", "-1", "1", "2"}},
        Flag{"map", "frames", {"x", "1", "1:2:3", "3:3", "4:3", "-1:3", "0:13", "1.5:3"}},
        Flag{"map", "symmetry", {"x", "-1", "1.5", "02"}},
        Flag{"recognize",
             "bins",
             {"x", "5", "5x5", "5x5x5x5", "0x5x5", "5x-5x5", "5x5x5.5", "autox5x5"}},
        Flag{"recognize", "x-mm", {"x", "1", "1:2:3", "10:-10", "nan:1", "0:inf", "0:1e999"}},
        Flag{"recognize", "y-mm", {"x", "1", "1:2:3", "10:-10", "nan:1", "0:inf", "0:1e999"}},
        Flag{"recognize", "theta-deg", {"x", "1", "1:2:3", "360:0", "nan:1", "0:inf", "0:720"}},
        Flag{"recognize", "pivot-mm", {"x", "1", "1,2,3", "nan,1", "1:2"}},
        Flag{"recognize", "prior", {"x", "0.2x", "nan", "0", "-1", "1", "1.5"}},
        Flag{"recognize", "gamma", {"x", "nan", "-0.1", "1", "1.5"}},
        Flag{"recognize", "none", {"x", "1x", "nan", "inf", "-1"}},
        Flag{"recognize", "threshold", {"x", "1x", "nan", "inf", "-1"}},
        Flag{"recognize", "ratio", {"x", "nan", "-1", "1", "2"}},
        Flag{"recognize", "frames", {"x", "1", "1:2:3", "3:3", "2:1", "-1:3", "0:4", "1.5:3"}},
        Flag{"recognize", "touches", {"x", "0", "-1", "4", "1.5"}}),
    [](const auto& test) {
      std::string name = std::string(test.param.command) + "_" + test.param.flag;
      std::replace(name.begin(), name.end(), '-', '_');
      return name;
    });

TEST_F(BadValue, TouchesOfSingleFrames) {
  Arguments arguments = good("recognize");
  arguments.insert(arguments.end(), {"--each-frame", "--touches", "1"});
  expect_refused(arguments, {"--touches", "--each-frame", "leave one"});
}

struct Scene {
  const char* name;
  const char* yaml;
  std::vector<std::string> named;

  friend void PrintTo(const Scene& scene, std::ostream* out) { *out << scene.yaml; }
};

class BadScene : public BadValue, public testing::WithParamInterface<Scene> {};

TEST_P(BadScene, IsNamed) {
  put_bytes(folder_ / "scene.yaml", GetParam().yaml);
  std::vector<std::string> named = GetParam().named;
  named.push_back("scene.yaml");
  expect_refused({"recognize", "u.h5", "--scene", "scene.yaml", "--json", "r.json", "--png", "new"},
                 named);
}

INSTANTIATE_TEST_SUITE_P(
    All, BadScene,
    testing::Values(
        Scene{"unknown_key",
              "objects: [{map: A.map.h5}]\ntreshold: 2\n",
              {"line 2", "key", "'treshold'", "unknown key", "threshold"}},
        Scene{"unknown_key_of_object",
              "objects: [{map: A.map.h5, mass: 2}]\n",
              {"line 1", "'mass'", "unknown key", "weight"}},
        Scene{"unknown_key_of_region", "region: {z_mm: [0, 1]}\n", {"'z_mm'", "unknown key"}},
        Scene{"key_twice", "gamma: 0.1\ngamma: 0.2\n", {"line 2", "'gamma'", "twice"}},
        Scene{"not_yaml", "objects: [\n", {"line", "correct the YAML"}},
        Scene{"no_objects", "gamma: 0.1\n", {"objects: missing", "--maps"}},
        Scene{"object_without_map", "objects: [{label: A}]\n", {"'map' is missing"}},
        Scene{"word_for_a_number", "gamma: much\n", {"'gamma' = 'much'", "give a number"}},
        Scene{"gamma_of_one", "gamma: 1\n", {"'gamma' = '1'", "give a number"}},
        Scene{"reversed_range", "region: {x_mm: [10, -10]}\n", {"x_mm", "reversed"}},
        Scene{"angles_that_count_twice",
              "objects: [{map: A.map.h5}]\nregion: {theta_deg: [-10, 351]}\n",
              {"theta_deg", "wider than the full circle", "at most 360 degrees"}},
        Scene{"no_bins", "bins: [0, 5, 5]\n", {"'bins'", "at least 1"}},
        Scene{"bins_in_a_word", "bins: many\n", {"'bins' = 'many'", "or auto"}},
        Scene{"none_of_less", "none: -1\n", {"'none' = '-1'", "from 0"}},
        Scene{"two_bins", "bins: [5, 5]\n", {"'bins'", "25x25x16"}},
        Scene{"no_weight", "objects: [{map: A.map.h5, weight: 0}]\n", {"weight", "above 0"}},
        Scene{"unknown_filter", "filter: kalman\n", {"filter", "kalman", "histogram"}},
        Scene{"other_array",
              "objects: [{map: A.map.h5}]\narray: [[0, 0], [1, 0]]\n",
              {"u.h5", "36 elements", "array", "has 2", "leaving the key out"}}),
    [](const auto& test) { return std::string(test.param.name); });

TEST_F(BadValue, SceneThatIsMissing) {
  expect_refused({"recognize", "u.h5", "--scene", "none.yaml"}, {"none.yaml", "no such file"});
}

}  // namespace palpate::bad_value_test
