// Values of options and of scene keys that cannot be meant, and how a command names them.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/options.hpp"
#include "learning/map_task.hpp"
#include "letter_files.hpp"
#include "options/option.hpp"
#include "recognition_flags.hpp"
#include "support/limits.hpp"

namespace palpate::cli::bad_value_test {

using testing::HasSubstr;
using testing::Not;

TEST(OptionsOfARecognition, ReadWhatTheyWriteAndRefuseTextsThatCannotBeMeant) {
  const std::tuple<std::string, std::string, std::vector<const char*>> cases[] = {
      {"bins", "6x5x4", {"x", "5", "5x5", "5x5x5x5", "0x5x5", "5x-5x5", "5x5x5.5", "autox5x5"}},
      {"x-mm", "-10:0.1", {"x", "1", "1:2:3", "10:-10", "nan:1", "0:inf", "0:1e999", "0:2e9"}},
      {"y-mm", "1e-07:2", {"x", "1", "1:2:3", "10:-10", "nan:1", "0:inf", "0:1e999", "-2e9:0"}},
      {"theta-deg", "0:360", {"x", "1", "1:2:3", "360:0", "nan:1", "0:inf", "0:1e11"}},
      {"pivot-mm", "1.5,-2", {"x", "1", "1,2,3", "nan,1", "1:2", "2e9,0"}},
      {"prior", "0.25", {"x", "0.2x", "nan", "0", "-1", "1", "1.5"}},
      {"gamma", "0.1", {"x", "nan", "-0.1", "1", "1.5"}},
      {"none", "0.5", {"x", "1x", "nan", "inf", "-1"}},
      {"threshold", "2", {"x", "1x", "nan", "inf", "-1"}},
      {"ratio", "0.3", {"x", "nan", "-1", "1", "2"}},
      {"touch-sd-mm", "1", {"x", "nan", "inf", "-1"}},
      {"touch-sd-deg", "2", {"x", "nan", "inf", "-1"}},
      {"slip-sd-mm", "3", {"x", "nan", "inf", "-1"}},
      {"slip-sd-deg", "4", {"x", "nan", "inf", "-1"}},
      {"act-below-mm", "0.3", {"x", "nan", "inf", "0", "-1"}},
      {"act-above", "0.9", {"x", "nan", "-0.1", "1.1"}},
      {"filter", "particles", {"kalman", "Histogram"}},
      {"tolerance", "1e-06", {"x", "nan", "0", "1"}},
      {"budget-ms", "5", {"x", "nan", "inf", "0"}},
      {"evidence-nats", "0.01", {"x", "nan", "inf", "0"}},
      {"particles", "100", {"0", "-1", "1000001", "ten", "1.5"}},
      {"resampling", "systematic", {"best"}},
      {"seed", "18446744073709551615", {"x", "-1", "1.5", "99999999999999999999"}},
      {"frames", "2:7", {"x", "1", "1:2:3", "3:3", "4:3", "-1:3", "1.5:3"}},
      {"touches", "3", {"x", "0", "-1", "1.5"}},
      {"augmented", "true", {"yes"}},
      {"each-frame", "true", {"yes"}},
      {"trace", "true", {"yes"}},
      {"scene", "a b.yaml", {}},
      {"sensor-model", "s.yaml", {}}};
  std::map<std::string, std::string> texts;
  for (const auto& [name, right, wrong] : cases) {
    texts[name] = right;
    for (const char* text : wrong) {
      Request request = request_with({{name, right}});
      EXPECT_TRUE(set_option(request, option_named(name), text).starts_with("give ")) << text;
      EXPECT_EQ(option_text(request, option_named(name)), right) << name << " " << text;
      EXPECT_THROW(request_with({{name, text}}), Error);
    }
  }
  for (const Option& option : options()) {
    EXPECT_TRUE(texts.contains(option.name) || option.name == std::string("device")) << option.name;
  }
  EXPECT_EQ(option_texts(request_with(texts)), texts);
  const std::map<std::string, std::string> words{
      {"bins", "fine"}, {"pivot-mm", "auto"}, {"none", "auto"}, {"filter", "auto"}};
  EXPECT_EQ(option_texts(request_with(words)), words);
  EXPECT_TRUE(option_texts({}).empty());
  EXPECT_THROW(request_with({{"speed", "1"}}), Error);
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
    EXPECT_NE(require_whole_number(wrong), "") << wrong;
  }
  Request request;
  EXPECT_EQ(set_option(request, option_named("threshold"), "1e-323"), "") << "a subnormal";
  EXPECT_EQ(require_whole_number("0"), "");
  EXPECT_EQ(require_whole_number("10"), "");
  for (const char* wrong : {"x", "1,2", "1,2,3,4", "1,2,x", "1,2,nan", "1;2;3", "2e9,0,0"}) {
    expect_named(input_error([&] { parse_pose("object-pose", wrong); }), {"object-pose", wrong});
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
      {"gamma: 0.1\n", {"objects: missing", "--maps"}},
      {"objects: [{map: maps/A.map.h5}]\narray: [[0, 0], [1, 0]]\n",
       {"u.h5", "36 elements", "array", "has 2", "leaving the key out"}}};
  for (const auto& [yaml, named] : cases) {
    put_bytes(folder_ / "scene.yaml", yaml);
    expect_refused("recognize u.h5 --scene scene.yaml --json r.json --png new", named);
  }
}

/// What cannot be meant: flags, keys of a scene, and what the refusal names.
struct Refused {
  Flags flags;
  std::string scene;
  Flags named;
};

TEST_F(RecognitionFlags, AreRefusedByNameAndValueWhereTheyCannotBeMeant) {
  std::vector<Refused> all{
      {{"--none", "v.h5"}, "", {"--none v.h5", "from 0", "or auto"}},
      {{"--filter=particles", "--none=1"}, "", {"--none 1", "--filter histogram"}},
      {{"--filter=particles", "--none"}, "", {"--none", "--filter histogram"}},
      {{}, "filter: particles\nnone: auto", {"scene.yaml: none = auto", "particles"}},
      {{"--filter=particles", "--touch-sd-mm=1"}, "", {"--touch-sd-mm", "--slip-sd-mm"}},
      {{"--filter=particles", "--touch-sd-deg=1"}, "", {"--touch-sd-deg", "--slip-sd-deg"}},
      {{}, "filter: particles\ntouch_sd: {mm: 1}", {"scene.yaml: touch_sd.mm = 1"}},
      {{"--filter=particles", "--x-mm=-4:4", "--slip-sd-mm=9"},
       "",
       {"--slip-sd-mm 9: wider than the region, 8 mm"}},
      {{"--budget-ms=9"},
       "filter: bounded\nslip_sd: {mm: 1}",
       {"--budget-ms", "where objects slip"}},
      {{"--tolerance=0.1"}, "filter: histogram", {"--tolerance", "has no effect"}},
      {{}, "bins: [5, 5, 5]\nslip_sd: {mm: 25}", {"scene.yaml: slip_sd.mm = 25: wider", "20 mm"}},
      {{}, "touch_sd: {mm: -1}", {"scene.yaml", "line 1", "'mm'", "from 0"}},
      {{}, "slip_sd: {deg: .nan}", {"'deg'", "from 0"}},
      {{}, "none: -1", {"'none' = '-1'", "from 0"}},
      {{}, "region: {theta_deg: [-10, 351]}", {"theta_deg", "wider than the full circle"}},
      {{}, "touch_sd: {rad: 0.1}", {"'rad'", "unknown key", "deg"}},
      {{}, "touch_sd: 1", {"touch_sd"}},
      {{}, "region: {x_mm: [0, 1e200]}", {"x_mm", "0:1e200"}},
      {{"--sensor-model=none.yaml"}, "", {"none.yaml", "no such file"}},
      {{"--sensor-model=" + (folder_ / "u.h5").string()}, "", {"u.h5", "and no sensor model"}}};
  for (const std::string flag :
       {"--particles=9", "--seed=1", "--resampling=systematic", "--augmented"}) {
    all.push_back({{flag}, "", {flag.substr(0, flag.find('=')), "add --filter particles"}});
  }
  for (const char* flag : {"--tolerance=0.1", "--budget-ms=5", "--evidence-nats=1"}) {
    const std::string name = std::string(flag).substr(0, std::string(flag).find('='));
    for (const std::string filter : {"histogram", "particles"}) {
      all.push_back({{flag, "--filter=" + filter},
                     "",
                     {name + ": has no effect on --filter " + filter, "or leave it out"}});
    }
  }
  for (const std::string flag :
       {"--touch-sd-mm", "--touch-sd-deg", "--slip-sd-mm", "--slip-sd-deg"}) {
    all.push_back({{flag + "=1000"}, "", {flag + " 1000: wider than the region, "}});
  }
  for (const Refused& wrong : all) {
    SCOPED_TRACE(fmt::format("{} {}", fmt::join(wrong.flags, " "), wrong.scene));
    const std::string said = refusal(wrong.flags, wrong.scene);
    for (const std::string& part : wrong.named) {
      EXPECT_THAT(said, HasSubstr(part));
    }
  }
  EXPECT_EQ(job({"--x-mm=2:2", "--touch-sd-mm=9", "--bins=9x9x8"}).task().touch_sd().mm, 9.0)
      << "an axis of one bin is not blurred; y is 20 mm long";
  recording_.pressure_unit = "raw";
  EXPECT_EQ(job({"--bins=9x9x8", "--threshold=16"}).task().classifier().threshold, 16.0);
}

TEST_F(RecognitionFlags, AreRefusedBesideASensorModelThatTakesTheirPlace) {
  const std::string model = "--sensor-model=" + (folder_ / "s.yaml").string();
  LearnedSensor sensor{.table = LearnedTable{}};
  sensor.table->shared.assign(2 * ReadingLayer::nodes, -1.0);
  write_sensor_model(folder_ / "s.yaml", sensor);
  for (const std::string option : {"gamma", "prior"}) {
    expect_named(refusal({model, "--" + option + "=0.1"}),
                 {("--" + option).c_str(), "s.yaml takes its place"});
    expect_named(refusal({}, "sensor_model: s.yaml\n" + option + ": 0.1"),
                 {("scene.yaml: " + option).c_str(), "takes its place"});
  }
  EXPECT_TRUE(job({model}).task().contact().table);
  sensor.table->layer.of = MapLayer::mean_level;
  write_sensor_model(folder_ / "s.yaml", sensor);
  expect_named(refusal({model, "--filter=bounded"}), {"map 'A'", "no mean level"});
  write_sensor_model(folder_ / "s.yaml", {.pressure_unit = "raw"});
  expect_named(refusal({model}), {"s.yaml", "pressure_unit = raw", "kPa"});
}

TEST_F(RecognitionFlags, MapsThatCannotStandTogetherAreNamed) {
  for (const char* none : {"--none=0", "--none=1"}) {
    expect_named(input_error([&] {
                   RecognitionJob(request_of({none}, "objects: [{map: A.map.h5, label: (none)}]"),
                                  std::vector{recording_});
                 }),
                 {"A.map.h5", "(none)", "label"});
  }
  OccupancyGrid other = sample_map("I");
  other.prior = 0.3;
  write_map(folder_ / "I.map.h5", other);
  expect_named(refusal({"--bins=9x9x8"}),
               {"I.map.h5", "prior 0.3 differs", "no touches", "A.map.h5", "--prior"});
  EXPECT_EQ(job({"--bins=9x9x8", "--prior=0.2"}).task().contact().prior, 0.2);
}

TEST_F(RecognitionFlags, BinsBeyondTheMachineAreRefusedWithWhatWouldHelp) {
  const std::string most = "2000000000";
  const std::string fine = "--bins=" + most + "x" + most + "x1";
  const std::string dense = "--bins=300000x300000x2";
  const std::string turning = "--bins=4x4x" + most;
  const std::string absurd = "--bins=" + most + "x" + most + "x" + most;
  const auto by = [&](const char* filter, Flags flags) {
    flags.push_back(std::string("--filter=") + filter);
    return refusal(flags);
  };
  expect_named(by("bounded", {"--bins=4000x4000x300", "--touch-sd-mm=0.5"}),
               {"MiB", "use fewer bins"});
  // Bounds would refuse these as well.
  for (const std::string& bins : {fine, dense, turning, absurd, "--bins=" + most + "x1x1",
                                  "--bins=1x" + most + "x1", "--bins=1x1x" + most}) {
    const std::string said = by("histogram", {bins});
    expect_named(said, {"bins", "use fewer"});
    EXPECT_THAT(said, Not(HasSubstr("bounded"))) << bins;
  }
  const Flags large{"--bins=4000x4000x300"};
  expect_named(by("histogram", large), {"MiB", "leave out --filter histogram: --filter bounded"});
  expect_named(refusal(large, "", "posterior"), {"MiB", "leave out --posterior: --filter bounded"});
  expect_named(refusal({large[0], "--filter=histogram"}, "", "posterior"),
               {"leave out --posterior and --filter histogram"});
}

}  // namespace palpate::cli::bad_value_test
