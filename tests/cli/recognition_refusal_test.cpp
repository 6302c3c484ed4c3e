// Options of a recognition that cannot be meant, and what the refusal names.

#include "recognition_flags.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace palpate::cli::recognition_refusal_test {

using testing::HasSubstr;
using testing::Not;

/// What cannot be meant: flags, keys of a scene, and what the refusal names.
struct Refused {
  Flags flags;
  std::string scene;
  Flags named;
};

TEST_F(RecognitionFlags, AreRefusedByNameAndValueWhereTheyCannotBeMeant) {
  std::vector<Refused> all{
      {{"--filter=bounded", "--particles=9"}, "", {"--particles", "add --filter particles"}},
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
      {{}, "touch_sd: {rad: 0.1}", {"'rad'", "unknown key", "deg"}},
      {{}, "touch_sd: 1", {"touch_sd"}},
      {{"--y-mm=0:2e9"}, "", {"--y-mm", "0:2e9", "+-1e+09"}},
      {{"--pivot-mm=1e+200,0"}, "", {"--pivot-mm", "1e+200"}},
      {{}, "region: {x_mm: [0, 1e200]}", {"x_mm", "0:1e200"}},
      {{"--sensor-model=none.yaml"}, "", {"none.yaml", "no such file"}},
      {{"--sensor-model=" + (folder_ / "u.h5").string()}, "", {"u.h5", "and no sensor model"}}};
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
  expect_named(refusal({"--bins=9x9x8"}), {"I.map.h5", "prior", "--prior"});
  EXPECT_EQ(job({"--bins=9x9x8", "--prior=0.2"}).task().contact().prior, 0.2);
}

TEST_F(RecognitionFlags, RawPressuresNeedAThreshold) {
  recording_.pressure_unit = "raw";
  EXPECT_EQ(job({"--bins=9x9x8", "--threshold=16"}).task().classifier().threshold, 16.0);
  expect_named(refusal({"--bins=9x9x8"}), {"raw", "--threshold"});
}

TEST_F(RecognitionFlags, BinsBeyondTheMachineAreRefusedWithWhatWouldHelp) {
  const std::string most = "2000000000";
  const std::string fine = "--bins=" + most + "x" + most + "x1";
  const std::string dense = "--bins=300000x300000x2";
  const std::string turning = "--bins=4x4x" + most;
  const std::string absurd = "--bins=" + most + "x" + most + "x" + most;
  const Flags wide{"--bins=1000x1000x1000", "--x-mm=-1e9:1e9", "--y-mm=-1e9:1e9"};
  const auto by = [&](const char* filter, Flags flags) {
    flags.push_back(std::string("--filter=") + filter);
    return refusal(flags);
  };
  expect_named(by("bounded", {fine}), {"lattice", "too many", "use fewer bins"});
  expect_named(by("bounded", {dense}), {"lattice", "fewer bins along x and y"});
  expect_named(by("bounded", {turning}), {"lattice", "MiB", "fewer thetas"});
  expect_named(by("bounded", wide), {"lattice", "MiB", "narrow the region"});
  expect_named(by("bounded", {absurd}), {"lattice", "use fewer bins"});
  expect_named(by("bounded", {"--bins=4000x4000x300", "--touch-sd-mm=0.5"}),
               {"MiB", "use fewer bins"});
  // Bounds would refuse these as well.
  for (const std::string& bins : {fine, dense, turning, absurd, "--bins=" + most + "x1x1",
                                  "--bins=1x" + most + "x1", "--bins=1x1x" + most}) {
    const std::string said = by("histogram", {bins});
    expect_named(said, {"bins", "use fewer"});
    EXPECT_THAT(said, Not(HasSubstr("bounded"))) << bins;
  }
  expect_named(by("histogram", {"--bins=80000x80000x1000"}), {"80000 x 80000 x 1000 pose bins"});
  const Flags large{"--bins=4000x4000x300"};
  expect_named(by("histogram", large), {"MiB", "leave out --filter histogram: --filter bounded"});
  expect_named(refusal(large, "", "posterior"), {"MiB", "leave out --posterior: --filter bounded"});
  expect_named(refusal({large[0], "--filter=histogram"}, "", "posterior"),
               {"leave out --posterior and --filter histogram"});
}

}  // namespace palpate::cli::recognition_refusal_test
