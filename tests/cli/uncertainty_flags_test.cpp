// Touches that lie elsewhere than reported, objects that slip, and objects that were never learned.

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::uncertainty_flags_test {

using nlohmann::json;
using Arguments = std::vector<std::string>;

class UncertaintyFlags : public ProgramTest {
 protected:
  UncertaintyFlags() {
    std::filesystem::create_directory(folder_ / "maps");
    write_map(folder_ / "maps/A.map.h5", sample_map("A"));
    write_map(folder_ / "maps/I.map.h5", sample_map("I"));
    write_recording(folder_ / "u.h5", sample_unknown("A", {{2.0, -3.0}, 1.0}, 6));
  }

  static Arguments with(Arguments flags) {
    flags.insert(flags.begin(), {"recognize", "u.h5", "--maps", "maps"});
    return flags;
  }
  /// By bounds, which need no device, where no filter is asked for; on few bins, but for particles,
  /// which have none.
  json record_with(Arguments flags) const {
    flags.insert(flags.begin(), {"u.h5", "--maps", "maps"});
    if (std::ranges::find(flags, "particles") == flags.end()) {
      flags.emplace_back("--bins=20x20x72");
    }
    if (std::ranges::none_of(flags, [](const auto& f) { return f.starts_with("--filter"); })) {
      flags.emplace_back("--filter=bounded");
    }
    json r = record(flags);
    r.erase("seconds");
    return r;
  }
  /// The record with a scene of these keys; the maps are given by flag.
  json record_in_scene(const std::string& keys) const {
    put_bytes(folder_ / "scene.yaml", keys);
    return record_with({"--scene", "scene.yaml"});
  }
  void expect_scene_refused(const std::string& keys, const Arguments& named) {
    put_bytes(folder_ / "scene.yaml", keys);
    expect_refused(with({"--scene", "scene.yaml"}), named);
  }
};

TEST_F(UncertaintyFlags, OfNothingChangeNothing) {
  const std::string by = "--filter=histogram";
  const json plain = record_with({by});
  EXPECT_EQ(
      record_with({by, "--touch-sd-mm=0", "--touch-sd-deg=0", "--slip-sd-mm=0", "--slip-sd-deg=0"}),
      plain);
  put_bytes(folder_ / "scene.yaml", "touch_sd: {mm: 0, deg: 0}\nslip_sd: {mm: 0}\n");
  EXPECT_EQ(record_with({by, "--scene", "scene.yaml"}), plain);
}

TEST_F(UncertaintyFlags, ReachTheFit) {
  const json plain = record_with({});
  const json displaced = record_with({"--touch-sd-mm", "1", "--touch-sd-deg", "5"});
  EXPECT_NE(displaced["fit"]["z"], plain["fit"]["z"]);
  EXPECT_EQ(record_in_scene("touch_sd: {mm: 1, deg: 5}\n"), displaced);
  put_bytes(folder_ / "scene.yaml", "touch_sd: {mm: 5, deg: 5}\n");
  EXPECT_EQ(record_with({"--scene", "scene.yaml", "--touch-sd-mm", "1"}), displaced)
      << "a flag overrides its key, and leaves the other alone";
}

TEST_F(UncertaintyFlags, AreRefusedWhereTheyCannotBeMeant) {
  for (const std::string flag :
       {"--touch-sd-mm", "--touch-sd-deg", "--slip-sd-mm", "--slip-sd-deg"}) {
    for (const char* value : {"-1", "nan", "inf"}) {
      expect_refused(with({flag + "=" + value}), {flag, value, "give a number from 0"});
    }
    expect_refused(with({flag, "x"}), {flag, "x", "give a number"});
    expect_refused(with({flag, ""}), {flag, "give a value"});
  }
  expect_refused(with({"--filter", "particles", "--x-mm=-4:4", "--slip-sd-mm=9"}),
                 {"--slip-sd-mm 9: wider than the region, 8 mm"});
  EXPECT_EQ(palpate(with({"--x-mm=2:2", "--touch-sd-mm=9"})).status, 0)
      << "an axis of one bin is not blurred; y is 20 mm long";
}

TEST_F(UncertaintyFlags, AreRefusedByNameWhereTheRegionIsAutomatic) {
  for (const std::string flag : {"--touch-sd-mm", "--slip-sd-mm"}) {
    expect_refused(with({flag + "=1000"}),
                   {flag + " 1000: wider than the region", " mm; give less"});
  }
  for (const std::string flag : {"--touch-sd-deg", "--slip-sd-deg"}) {
    expect_refused(with({flag + "=1000"}), {flag + " 1000: wider than the region, 360 deg"});
  }
  expect_refused({"plan", "u.h5", "--maps", "maps", "--candidates", "grid", "--touch-sd-mm=1000"},
                 {"--touch-sd-mm 1000: wider than the region"});
  expect_scene_refused("slip_sd: {mm: 1000}\n",
                       {"scene.yaml", "slip_sd.mm = 1000: wider than the region", " mm; give"});
}

TEST_F(UncertaintyFlags, SceneKeysAreRefusedByName) {
  expect_scene_refused("touch_sd: {mm: -1}\n", {"scene.yaml", "line 1", "'mm'", "from 0"});
  expect_scene_refused("slip_sd: {deg: .nan}\n", {"scene.yaml", "'deg'", "from 0"});
  expect_scene_refused("touch_sd: {rad: 0.1}\n", {"scene.yaml", "'rad'", "unknown key", "deg"});
  expect_scene_refused("touch_sd: 1\n", {"scene.yaml", "touch_sd"});
  expect_scene_refused("bins: [5, 5, 5]\nslip_sd: {mm: 25}\n",
                       {"scene.yaml", "slip_sd.mm = 25: wider than the region, 20 mm"});
}

TEST_F(UncertaintyFlags, ParticlesTakeTheSlipAsTheirMotion) {
  const Arguments particles{"--filter", "particles", "--particles", "2000"};
  const auto by_particles = [&](Arguments flags) {
    flags.insert(flags.end(), particles.begin(), particles.end());
    return record_with(flags);
  };
  const json plain = by_particles({});
  EXPECT_EQ(by_particles({"--slip-sd-mm", "1"}), plain) << "the paper's 1 mm";
  EXPECT_NE(by_particles({"--slip-sd-mm", "0.5"}), plain);
  EXPECT_NE(by_particles({"--slip-sd-deg", "1"}), plain);
}

TEST_F(UncertaintyFlags, ParticlesRefuseTheOthers) {
  const auto refused = [&](Arguments flags, const Arguments& named) {
    flags.insert(flags.end(), {"--filter", "particles"});
    expect_refused(with(flags), named);
  };
  refused({"--touch-sd-mm", "1"}, {"--touch-sd-mm", "--filter histogram"});
  refused({"--touch-sd-deg", "1"}, {"--touch-sd-deg", "--slip-sd-deg"});
  refused({"--none", "1"}, {"--none", "--filter histogram"});
  refused({"--none"}, {"--none", "--filter histogram"});
  expect_scene_refused("filter: particles\nnone: auto\n", {"scene.yaml", "none", "particles"});
  expect_scene_refused("filter: particles\ntouch_sd: {mm: 1}\n", {"scene.yaml", "touch_sd.mm"});
}

TEST_F(UncertaintyFlags, NoneWithoutANumberIsOneInTen) {
  const json usual = record_with({"--none"});
  EXPECT_EQ(usual, record_with({"--none", fmt::format("{:.17g}", 2.0 / 9.0)}))
      << "two maps of weight 1";
  EXPECT_EQ(usual, record_in_scene("none: auto\n"));
  EXPECT_EQ(usual, record_with({"--none", "--gamma", "0.1"})) << "a flag is no number";
  EXPECT_EQ(usual, record_with({"--none=auto"}));
  put_bytes(folder_ / "scene.yaml",
            "none: auto\nobjects: [{map: maps/A.map.h5, weight: 3}, {map: maps/I.map.h5}]\n");
  const json heavy =
      record({"u.h5", "--scene", "scene.yaml", "--bins=20x20x72", "--filter=bounded"});
  const json ninth = record({"u.h5", "--scene", "scene.yaml", "--bins=20x20x72", "--filter=bounded",
                             "--none", fmt::format("{:.17g}", 4.0 / 9.0)});
  EXPECT_EQ(heavy["identity"], ninth["identity"]);
}

TEST_F(UncertaintyFlags, NoneTakesNoFileForItsNumber) {
  EXPECT_EQ(palpate({"recognize", "--maps", "maps", "--none", "u.h5"}).status, 0)
      << "the recording that every call needs";
  expect_refused({"recognize", "u.h5", "--maps", "maps", "--none", "v.h5"},
                 {"--none v.h5", "from 0", "or auto"});
  for (const char* wrong : {"nan", "inf", "-1", "x"}) {
    expect_refused(with({std::string("--none=") + wrong}), {"--none", wrong, "from 0"});
  }
  expect_refused(with({"--none", ""}), {"--none", "give a"});
}

TEST_F(UncertaintyFlags, TheProbabilityOfNoneStandsBesideTheIdentity) {
  const json r = record_with({"--none", "--trace"});
  EXPECT_EQ(r["none"], r["identity"]["(none)"]);
  ASSERT_EQ(r["trace"].size(), 6u);
  for (const json& step : r["trace"]) {
    EXPECT_EQ(step.at("none"), step["identity"].at("(none)"));
  }
  EXPECT_EQ(record_with({}), record_with({"--none"})) << "the default";
  EXPECT_FALSE(record_with({"--none", "0"}).contains("none"));
  EXPECT_FALSE(record_with({"--filter", "particles"}).contains("none"));
}

TEST_F(UncertaintyFlags, OneTouchCannotTell) {
  const std::string note = "one touch cannot tell";
  const std::string few = "--bins=20x20x72";
  const std::string by = "--filter=bounded";
  EXPECT_NE(done(with({few, by, "--none", "--touches", "1"})).find(note), std::string::npos);
  const std::string frames = done(with({few, by, "--none", "--each-frame"}));
  EXPECT_NE(frames.find(note), std::string::npos);
  EXPECT_EQ(frames.find(note), frames.rfind(note)) << "once";
  EXPECT_EQ(done(with({few, by, "--none"})).find(note), std::string::npos);
  EXPECT_EQ(done(with({few, by, "--touches=1", "--none", "0"})).find(note), std::string::npos);
}

TEST_F(UncertaintyFlags, SayOnceWhatTheLatticeDoesNotResolve) {
  write_recording(folder_ / "v.h5", sample_unknown("I", {}, 3));
  const auto said = [&](Arguments flags) {
    flags.insert(flags.begin(), {"recognize", "u.h5", "v.h5", "--maps", "maps"});
    const Outcome outcome = palpate(flags);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome.err;
  };
  const std::string by = "--filter=bounded";
  const std::string narrow = said({by, "--bins", "10x10x36", "--touch-sd-mm", "0.9"});
  expect_named(narrow, {"does not resolve touch-sd of 0.9 mm", "step of x is 2 mm", "more bins"});
  EXPECT_EQ(std::count(narrow.begin(), narrow.end(), '\n'), 1) << narrow;
  expect_named(said({"--bins", "10x10x36", "--slip-sd-deg", "1"}), {"slip-sd of 1 degrees"});
  expect_named(said({by, "--bins", "10x10x36", "--pivot-mm=90,0", "--touch-sd-deg", "9"}),
               {"touch-sd", "mm from the pivot", "move the pivot near the touches, or use more"});
  EXPECT_EQ(said({by, "--bins", "25x25x48", "--touch-sd-mm", "1", "--touch-sd-deg", "5"}), "");
}

TEST_F(UncertaintyFlags, TheFitOfEachTouchStandsInTheRecordAndInTheTrace) {
  const std::string by = "--filter=histogram";  // which computes the same bits with a trace
  const json r = record_with({by, "--trace"});
  ASSERT_EQ(r["trace"].size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    const json& fits = r["trace"][i]["touch_fit"];
    ASSERT_EQ(fits.size(), i + 1);
    EXPECT_TRUE(fits.back().is_number());
  }
  EXPECT_EQ(r["touch_fit"], r["trace"][5]["touch_fit"]);
  EXPECT_EQ(record_with({by})["touch_fit"], r["touch_fit"]);
  EXPECT_NE(done(with({"--trace", "--bins=20x20x72", "--filter=bounded"})).find("touch's z"),
            std::string::npos);
  EXPECT_FALSE(record_with({"--filter=particles"}).contains("touch_fit"));
}

}  // namespace palpate::uncertainty_flags_test
