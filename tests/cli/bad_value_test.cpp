// Values of options and of scene keys that cannot be meant, and how a command names them.

#include "cli/options.hpp"
#include "learning/map_request.hpp"
#include "letter_files.hpp"
#include "options/option.hpp"
#include "palpate/simulation.hpp"
#include "support/limits.hpp"

namespace palpate::bad_value_test {

TEST(BadValue, OptionsOfARecognitionRefuseTextsThatCannotBeMeant) {
  const std::pair<const char*, std::vector<const char*>> cases[] = {
      {"bins", {"x", "5", "5x5", "5x5x5x5", "0x5x5", "5x-5x5", "5x5x5.5", "autox5x5"}},
      {"x-mm", {"x", "1", "1:2:3", "10:-10", "nan:1", "0:inf", "0:1e999", "0:2e9"}},
      {"y-mm", {"x", "1", "1:2:3", "10:-10", "nan:1", "0:inf", "0:1e999", "-2e9:0"}},
      {"theta-deg", {"x", "1", "1:2:3", "360:0", "nan:1", "0:inf", "0:1e11"}},
      {"pivot-mm", {"x", "1", "1,2,3", "nan,1", "1:2", "2e9,0"}},
      {"prior", {"x", "0.2x", "nan", "0", "-1", "1", "1.5"}},
      {"gamma", {"x", "nan", "-0.1", "1", "1.5"}},
      {"none", {"x", "1x", "nan", "inf", "-1"}},
      {"threshold", {"x", "1x", "nan", "inf", "-1"}},
      {"ratio", {"x", "nan", "-1", "1", "2"}},
      {"touch-sd-mm", {"x", "nan", "inf", "-1"}},
      {"touch-sd-deg", {"x", "nan", "inf", "-1"}},
      {"slip-sd-mm", {"x", "nan", "inf", "-1"}},
      {"slip-sd-deg", {"x", "nan", "inf", "-1"}},
      {"act-below-mm", {"x", "nan", "inf", "0", "-1"}},
      {"act-above", {"x", "nan", "-0.1", "1.1"}},
      {"filter", {"kalman", "Histogram"}},
      {"tolerance", {"x", "nan", "0", "1"}},
      {"budget-ms", {"x", "nan", "inf", "0"}},
      {"evidence-nats", {"x", "nan", "inf", "0"}},
      {"particles", {"0", "-1", "1000001", "ten", "1.5"}},
      {"resampling", {"best"}},
      {"seed", {"x", "-1", "1.5", "99999999999999999999"}},
      {"frames", {"x", "1", "1:2:3", "3:3", "4:3", "-1:3", "1.5:3"}},
      {"touches", {"x", "0", "-1", "1.5"}}};
  for (const auto& [name, wrong] : cases) {
    for (const char* text : wrong) {
      Request request;
      EXPECT_TRUE(set_option(request, option_named(name), text).starts_with("give ")) << text;
      EXPECT_EQ(option_text(request, option_named(name)), "") << name << " " << text;
    }
  }
}

TEST(BadValue, OptionsOfAMapRefuseNumbersThatCannotBeMeant) {
  const auto refused = [](const char* name, auto member, auto value) {
    MapRequest request;
    request.*member = value;
    expect_named(input_error([&] { request.validate(); }), {name});
  };
  for (const double wrong : {nan, infinity, 0.0, -1.0, 1e200, 1e-200, 1e-07, 2e6}) {
    refused("cell-mm", &MapRequest::cell_mm, wrong);
    refused("spread-mm", &MapRequest::spread_mm, wrong);
  }
  for (const double wrong : {0.0, -1.0, 1.0, 1.5}) {
    refused("peak", &MapRequest::peak, wrong);
  }
  for (const char* wrong : {"x", "0.2x", "nan", "0", "-1", "1", "1.5"}) {
    refused("prior", &MapRequest::prior, wrong);
  }
  for (const char* wrong :
       {"x", "-1", "1.5", "02", "I=2,I=3", "I=", "2,I=2", "I=-1", "99999999999"}) {
    refused("symmetry", &MapRequest::symmetry, wrong);
  }
  for (const char* wrong : {"middle", "1,2", "1,2,3,4", "1,2,x"}) {
    refused("origin", &MapRequest::origin, wrong);
  }
  MapRequest off;
  off.shared.touch_sd_deg = 181.0;
  expect_named(input_error([&] { off.validate(); }), {"touch-sd-deg 181", "give 0 to 180"});
}

TEST(BadValue, TextsOfNumbersAndPosesAreReadWhole) {
  for (const char* wrong : {"x", "-1", "1.5", "010", "1x", "", "99999999999999999999"}) {
    EXPECT_NE(cli::require_whole_number(wrong), "") << wrong;
  }
  Request request;
  EXPECT_EQ(set_option(request, option_named("threshold"), "1e-323"), "") << "a subnormal";
  EXPECT_EQ(cli::require_whole_number("0"), "");
  EXPECT_EQ(cli::require_whole_number("10"), "");
  for (const char* wrong : {"x", "1,2", "1,2,3,4", "1,2,x", "1,2,nan", "1;2;3"}) {
    expect_named(input_error([&] { parse_pose("object-pose", wrong); }), {"object-pose", wrong});
  }
  for (const double wrong : {nan, infinity, -1.0}) {
    for (const SensorModel& model : {SensorModel{.psf_mm = wrong}, {.noise_kpa = wrong}}) {
      EXPECT_NE(input_error([&] { Simulator(make_shape("A"), model, digitacts_array(), 1); }), "");
    }
  }
}

using BadValueOnTheCommandLine = LetterFiles;

TEST_F(BadValueOnTheCommandLine, IsNamedWithItsFlag) {
  const std::string simulate = "simulate A -o out.h5";
  const std::string map = "map A.h5 -o new/";
  const std::string recognize = "recognize u.h5 --maps maps --json r.json --png new";
  const std::tuple<std::string, std::string, std::vector<const char*>> cases[] = {
      {simulate, "--seed", {"010"}},
      {simulate, "--poses", {"x", "random", "random:", "random:0", "random:-1", "random:x"}},
      {simulate, "--object-pose", {"1,2"}},
      {simulate, "--touches", {"0", "193", "1.5"}},
      {simulate, "--noise-kpa", {"1x"}},
      {map, "--cell-mm", {"1x", "0"}},
      {map, "--threshold", {"-1"}},
      {map, "--frames", {"3:3", "0:49"}},
      {recognize, "--gamma", {"1"}},
      {recognize, "--filter", {"kalman"}},
      {recognize, "--theta-deg", {"0:720"}},
      {recognize, "--frames", {"0:7"}},
      {recognize, "--touches", {"7"}}};
  for (const auto& [command, flag, wrong] : cases) {
    for (const char* value : wrong) {
      expect_refused(command + " " + flag + "=" + value, {flag, value});
    }
    std::vector<std::string> empty = CommandLine(command).arguments();
    empty.insert(empty.end(), {flag, ""});
    expect_refused(empty, {flag, "give a"});
  }
  expect_refused("simulate Ampersand -o out.h5", {"'Ampersand'", "give A to Z"});
}

TEST_F(BadValueOnTheCommandLine, IsNamedWithItsScene) {
  const std::pair<const char*, std::vector<std::string>> cases[] = {
      {"gamma: 0.1\ntreshold: 2\n", {"line 2", "'treshold'", "unknown key", "threshold"}},
      {"gamma: 0.1\n", {"objects: missing", "--maps"}},
      {"objects: [{map: maps/A.map.h5}]\nnone: -1\n", {"'none' = '-1'", "from 0"}},
      {"objects: [{map: maps/A.map.h5}]\nregion: {theta_deg: [-10, 351]}\n",
       {"theta_deg", "wider than the full circle", "at most 360 degrees"}},
      {"objects: [{map: maps/A.map.h5}]\narray: [[0, 0], [1, 0]]\n",
       {"u.h5", "36 elements", "array", "has 2", "leaving the key out"}}};
  for (const auto& [yaml, named] : cases) {
    put_bytes(folder_ / "scene.yaml", yaml);
    expect_refused("recognize u.h5 --scene scene.yaml --json r.json --png new", named);
  }
}

}  // namespace palpate::bad_value_test
