#include <map>
#include <regex>

#include "options/option.hpp"
#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::device_and_help_test {

using nlohmann::json;

using DevicesCommand = ProgramTest;

TEST_F(DevicesCommand, NamesOneChosenDevice) {
  const json devices = json::parse(done("devices --json"));
  const std::string text = done("devices");
  ASSERT_FALSE(devices.empty());
  for (const json& device : devices) {
    EXPECT_TRUE(device.at("index").is_number_integer());
    for (const char* key : {"name", "type", "driver", "vulkan", "reason"}) {
      EXPECT_FALSE(device.at(key).get<std::string>().empty()) << key;
    }
    EXPECT_TRUE(device.at("usable").is_boolean());
    EXPECT_TRUE(device.at("memory_gib").is_number() && device.at("chosen").is_boolean());
    for (const char* shown : {"name", "reason"}) {
      expect_named(text, {device[shown].get<std::string>().c_str()});
    }
  }
  EXPECT_TRUE(text.starts_with("*") || text.find("\n*") != std::string::npos) << text;
}

TEST_F(DevicesCommand, AMachineWithoutVulkanDoesAllThatNeedsNoDevice) {
  const Variable vulkan("PALPATE_VULKAN_LIBRARY", "/nonexistent/libvulkan.so.1");
  done("simulate A -o A.h5 --poses random:3");
  done("info A.h5");
  done("sensors --json");
  write_map(folder_ / "A.map.h5", sample_map("A"));
  write_recording(folder_ / "u.h5", sample_unknown("A", {}, 3));
  EXPECT_EQ(record("u.h5 --maps A.map.h5 --filter bounded")["device"], "none");
  put_bytes(folder_ / "c.csv", "x_mm,y_mm,theta_rad\n0,0,0\n2,1,0.5\n");
  done("plan u.h5 --maps A.map.h5 --candidates c.csv --filter bounded");
  for (const char* command : {"devices", "map A.h5 -o new.h5",
                              "recognize u.h5 --maps A.map.h5 --filter bounded --device 0"}) {
    expect_failed(1, command, {"install libvulkan1 and mesa-vulkan-drivers\n"});
  }
}

const std::vector<std::string> commands{"batch",    "calibrate", "check",     "devices", "evaluate",
                                        "export",   "import",    "info",      "live",    "map",
                                        "merge",    "plan",      "recognize", "record",  "sensors",
                                        "simulate", "touches",   "view"};

using ProgramHelp = ProgramTest;

TEST_F(ProgramHelp, OfACommandMentionsDefaultsFormsAndUnits) {
  for (const auto& [command, mentions] : std::initializer_list<std::pair<std::string, const char*>>{
           {"sensors", "USB (*)"},
           {"simulate", "SHAPE =1 grid random:N mm =0.7 kPa X,Y,DEG"},
           {"map", "FOLDER/ =0.5 mm quarter 0.9] =auto kPa 0.3] A:B"},
           {"recognize",
            "25x25x16 -10:10 mm 0:360 degrees X,Y 0,0 0.1] kPa 0.3] A:B histogram 10000] "
            "systematic T_object_robot slip, 1e-6"},
           {"batch", "INPUT path, label I/N SLURM_ARRAY_TASK_ID 100"},
           {"merge", "RESULTS NDJSON --partial"},
           {"plan", "grid CSV mm rad =both identity =96 =0 nats"},
           {"evaluate", "RESULTS 95 (none)"},
           {"calibrate", "YAML unit learned] =auto log_odds 7 A:B"},
           {"record", "replay:FILE simulate:SHAPE FIFO =0.5"},
           {"touches", "FRAMES kPa half =0.15 =0.1 =0.05 32"},
           {"import",
            "PRESSURES COLUMNS:ROWS:PITCH mm =bottom-left =rows frames touches =kPa mm,rad "
            "TX,TY,TZ,QX,QY,QZ,QW =auto 2.5"},
           {"export", "FILE Folder"},
           {"view", "PATH 8080 127.0.0.1"}}) {
    const std::string help = done(command + " --help");
    for (const std::string& word : CommandLine(mentions).arguments()) {
      expect_named(help, {word.c_str()});
    }
  }
  const std::string recognize = done("recognize --help");
  // Flags are grouped by what they are for.
  expect_named(recognize, {"\nOptions:\n", "\nBins and region:\n", "\nFilter:\n"});
  EXPECT_LT(recognize.find("\n  --maps "), recognize.find("\nBins and region:"));
  EXPECT_GT(recognize.find("\n  --bins "), recognize.find("\nBins and region:"));
  for (const Option& option : options()) {
    expect_named(recognize, {("--" + std::string(option.name)).c_str()});
  }
}

TEST_F(ProgramHelp, ListsTheCommandsAndTheVersion) {
  const std::string help = done("--help");
  for (const std::string& command : commands) {
    expect_named(help, {("\n  " + command).c_str()});
  }
  EXPECT_EQ(done("--version"), PALPATE_VERSION "\n");
}

// What the program says to flags that commands have lost.
TEST_F(ProgramHelp, OfFormerFlagsSaysWhatToUseInstead) {
  const std::map<std::string, std::map<std::string, std::string>> remedies{
      {"recognize",
       {{"--help-all", "give --help"},
        {"--memory-mib", "give --filter bounded"},
        {"--fit-touch-sd", "give --touch-sd-mm"}}},
      {"batch", {{"--update", "give -o a new folder"}}},
      {"calibrate", {{"--png", "draw it in Python, by palpate.calibrate"}}},
      {"check", {{"--psf-mm", "give --spread-mm"}, {"--help-all", "give --help"}}},
      {"evaluate", {{"--png", "draw it in Python, by palpate.evaluate"}}},
      {"map", {{"--psf-mm", "give --spread-mm"}}},
      {"plan", {{"--png", "read the table, or give --json"}}},
      {"touches", {{"--tare", "leave it out"}}}};
  std::string all;
  std::map<std::string, std::string> help;
  for (const std::string& command : commands) {
    all += help[command] = done(command + " --help");
  }
  const auto names = [](const std::string& text, const std::string& flag) {
    return std::regex_search(text, std::regex(flag + "(?![a-z-])"));
  };
  for (const auto& [command, flags] : remedies) {
    for (const auto& [flag, remedy] : flags) {
      EXPECT_FALSE(names(help[command], flag)) << "a row that hides a flag of today misleads";
      expect_refused({command, "a.h5", flag + "=3"},
                     {"'" + flag + "=3' is no flag of palpate " + command + "; " + remedy});
      std::smatch instead;
      if (std::regex_search(remedy, instead, std::regex("--[a-z][a-z-]*"))) {
        EXPECT_TRUE(names(all, instead.str())) << remedy;
      }
    }
  }
  expect_refused("map a.h5 --psf-mm", {"'--psf-mm' is no flag of palpate map; give"});
  expect_refused("info -- --help-all", {"--help-all: no such file"});
  expect_refused("recognize --update", {"'--update' is no flag of palpate recognize; see palpate"});
}

}  // namespace palpate::device_and_help_test
