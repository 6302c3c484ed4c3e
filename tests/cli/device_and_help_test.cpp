#include <algorithm>
#include <set>
#include <sstream>

#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::device_and_help_test {

using nlohmann::json;

using DevicesCommand = ProgramTest;

TEST_F(DevicesCommand, JsonNamesOneChosenDevice) {
  const json devices = json::parse(done({"devices", "--json"}));
  ASSERT_FALSE(devices.empty());
  int chosen = 0;
  for (const json& device : devices) {
    EXPECT_TRUE(device.at("index").is_number_integer());
    for (const char* key : {"name", "type", "driver", "vulkan", "reason"}) {
      EXPECT_FALSE(device.at(key).get<std::string>().empty()) << key;
    }
    EXPECT_TRUE(device.at("usable").is_boolean());
    EXPECT_GT(device.at("memory_gib").get<double>(), 0.0);
    chosen += device.at("chosen").get<bool>() ? 1 : 0;
  }
  EXPECT_EQ(chosen, 1);
}

TEST_F(DevicesCommand, TextMarksTheChosenDevice) {
  const json devices = json::parse(done({"devices", "--json"}));
  const std::string text = done({"devices"});
  for (const json& device : devices) {
    EXPECT_NE(text.find(device["name"].get<std::string>()), std::string::npos) << text;
    EXPECT_NE(text.find(device["reason"].get<std::string>()), std::string::npos) << text;
  }
  EXPECT_TRUE(text.starts_with("*") || text.find("\n*") != std::string::npos) << text;
}

TEST_F(DevicesCommand, AMachineWithoutVulkanDoesAllThatNeedsNoDevice) {
  const Variable vulkan("PALPATE_VULKAN_LIBRARY", "/nonexistent/libvulkan.so.1");
  done({"simulate", "A", "-o", "A.h5", "--poses", "random:3"});
  done({"info", "A.h5"});
  done({"sensors", "--json"});
  write_map(folder_ / "A.map.h5", sample_map("A"));
  write_recording(folder_ / "u.h5", sample_unknown("A", {}, 3));
  EXPECT_EQ(record({"u.h5", "--maps", "A.map.h5", "--filter", "bounded"})["device"], "none");
  put_bytes(folder_ / "c.csv", "x_mm,y_mm,theta_rad\n0,0,0\n2,1,0.5\n");
  done({"plan", "u.h5", "--maps", "A.map.h5", "--candidates", "c.csv", "--filter", "bounded"});
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"devices"},
        {"map", "A.h5", "-o", "new.h5"},
        {"recognize", "u.h5", "--maps", "A.map.h5", "--filter", "bounded", "--device", "0"}}) {
    const Outcome outcome = palpate(arguments);
    EXPECT_EQ(outcome.status, 1);
    EXPECT_EQ(outcome.out, "");
    EXPECT_TRUE(outcome.err.ends_with("install libvulkan1 and mesa-vulkan-drivers\n"))
        << outcome.err;
    EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
  }
}

struct Help {
  const char* command;
  std::vector<const char*> mentions;  ///< flags with their defaults and units

  friend void PrintTo(const Help& help, std::ostream* out) { *out << help.command; }
};

class CommandHelp : public ProgramTest, public testing::WithParamInterface<Help> {};

TEST_P(CommandHelp, MentionsEveryFlagWithDefaultAndUnit) {
  const std::string help = done({GetParam().command, "--help"});
  for (const char* part : GetParam().mentions) {
    EXPECT_NE(help.find(part), std::string::npos) << "'" << part << "' not in\n" << help;
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, CommandHelp,
    testing::Values(
        Help{"devices", {"--json"}}, Help{"sensors", {"--json", "USB", "(*)"}},
        Help{"simulate",
             {"SHAPE", "-o,", "--seed", "=1", "--poses", "grid", "random:N", "--psf-mm", "mm",
              "--noise-kpa", "=0.7", "kPa", "--object-pose", "X,Y,DEG", "random", "--touches"}},
        Help{"map",
             {"RECORDING",   "-o,",           "FOLDER/", "--cell-mm",     "=0.5",      "mm",
              "--spread-mm", "a quarter",     "--peak",  "default: 0.9]", "--prior",   "=auto",
              "--threshold", "2 kPa",         "--ratio", "0.3",           "--frames",  "A:B",
              "--symmetry",  "--label",       "--png",   "--device",      "--unposed", "--max-maps",
              "--mirror",    "--sensor-model"}},
        Help{"recognize",
             {"RECORDING",      "--maps",      "--scene",     "--bins",      "25x25x16",
              "--x-mm",         "-10:10",      "--y-mm",      "mm",          "--theta-deg",
              "0:360",          "degrees",     "--pivot-mm",  "X,Y",         "0,0",
              "--prior",        "--gamma",     "0.1",         "--threshold", "2 kPa",
              "--ratio",        "0.3",         "--frames",    "A:B",         "--touches",
              "--each-frame",   "--filter",    "histogram",   "--particles", "10000",
              "--resampling",   "systematic",  "--augmented", "--seed",      "--trace",
              "--json",         "--posterior", "--png",       "--device",    "T_object_robot",
              "bounded",        "100000",      "--tolerance", "1e-6",        "--budget-ms",
              "--evidence-nats"}},
        Help{"batch",
             {"INPUT", "-o,", "path, frames and label", "--maps", "--shard", "I/N",
              "SLURM_ARRAY_TASK_ID", "--chunk", "100", "--threads", "--each-frame", "--trace"}},
        Help{"merge", {"RESULTS", "-o,", "NDJSON", "--partial"}},
        Help{"plan",
             {"RECORDING", "--maps", "--candidates", "grid", "CSV", "mm", "rad", "--goal", "=both",
              "identity", "--samples", "=96", "--plan-seed", "=0", "--json", "nats"}},
        Help{"evaluate", {"RESULTS", "--json", "95 %", "(none)"}},
        Help{"calibrate",
             {"RECORDING", "-o,", "YAML", "--maps", "--unposed", "--threshold", "pressure unit",
              "[default: learned]", "--ratio", "--layer", "=auto", "log_odds", "--levels",
              "[default: 7 ", "--frames", "A:B", "--sensor-model"}},
        Help{"record",
             {"--sensor", "replay:FILE", "simulate:SHAPE", "-o,", "--seconds", "--poses", "FIFO",
              "--tare", "=0.5", "--object"}},
        Help{"touches",
             {"FRAMES", "-o,", "--onset", "2 kPa", "--release", "half", "--steady", "=0.15",
              "--min-steady-s", "=0.1", "--smooth-s", "=0.05", "--drift-s", "2 to 32"}},
        Help{"import",
             {"PRESSURES",
              "--poses",
              "--array",
              "COLUMNS:ROWS:PITCH",
              "mm",
              "--first-element",
              "=bottom-left",
              "--order",
              "=rows",
              "--dead",
              "-o,",
              "--rows",
              "frames",
              "touches",
              "--pressure-unit",
              "=kPa",
              "--pose-unit",
              "mm,rad",
              "--time-unit",
              "--time-column",
              "--pressure-columns",
              "--pose-columns",
              "TX,TY,TZ,QX,QY,QZ,QW",
              "--plane",
              "=auto",
              "--largest-gap-s",
              "2.5 times",
              "--rate",
              "--object",
              "--truth"}},
        Help{"export", {"FILE", "-o,", "Folder"}}, Help{"info", {"FILE"}},
        Help{"view", {"PATH", "--page", "8080", "--page-address", "127.0.0.1"}}),
    [](const auto& test) { return std::string(test.param.command); });

using ProgramHelp = ProgramTest;

TEST_F(ProgramHelp, ListsTheCommands) {
  const std::string help = done({"--help"});
  for (const char* command :
       {"devices", "sensors", "record", "touches", "simulate", "map", "recognize", "live", "batch",
        "merge", "evaluate", "calibrate", "plan", "info", "import", "export", "view"}) {
    EXPECT_NE(help.find(std::string("\n  ") + command), std::string::npos) << help;
  }
}

TEST_F(ProgramHelp, GroupsFlagsByWhatTheyAreFor) {
  const std::string help = done({"recognize", "--help"});
  for (const char* group : {"\nOptions:\n", "\nBins and region:\n", "\nFilter:\n"}) {
    EXPECT_NE(help.find(group), std::string::npos) << help;
  }
  EXPECT_LT(help.find("\n  --maps "), help.find("\nBins and region:"));
  EXPECT_GT(help.find("\n  --bins "), help.find("\nBins and region:"));
}

TEST_F(ProgramHelp, WhatIsNoCommandOrFlagIsNamed) {
  EXPECT_EQ(palpate({"touch-the-moon"}).err,
            "palpate: 'touch-the-moon' is no command or flag; see palpate --help\n");
  expect_refused({"map", "--spread"}, {"'--spread' is no flag", "see palpate map --help"});
}

TEST_F(ProgramHelp, VersionIsTheProjects) { EXPECT_EQ(done({"--version"}), PALPATE_VERSION "\n"); }

}  // namespace palpate::device_and_help_test
