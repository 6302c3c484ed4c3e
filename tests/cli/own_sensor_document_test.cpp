// Every command of docs/own_sensor.md runs, and ends in the pose that the page tells.

#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <sstream>

#include "program.hpp"

namespace palpate {
namespace {

using OwnSensorDocument = ProgramTest;

/// All blocks of shell commands of a document, in their order.
std::string commands_in(const std::string& document) {
  const std::string opening = "```sh\n";
  std::string commands;
  for (auto begin = document.find(opening); begin != document.npos;) {
    begin += opening.size();
    const auto end = document.find("```", begin);
    commands += document.substr(begin, end - begin);
    begin = document.find(opening, end);
  }
  return commands;
}

TEST_F(OwnSensorDocument, ItsCommandsFindTheUnknown) {
  const std::string document = bytes_of(PALPATE_SOURCE_DIR "/docs/own_sensor.md");
  put_bytes(folder_ / "commands.sh", commands_in(document));
  const std::filesystem::path program = PALPATE_PROGRAM;
  const std::string run = "cd '" + folder_.path().string() + "' && PATH='" +
                          program.parent_path().string() +
                          "':\"$PATH\" bash -euo pipefail commands.sh > said 2> complained";
  ASSERT_EQ(std::system(run.c_str()), 0) << bytes_of(folder_ / "complained");
  EXPECT_EQ(bytes_of(folder_ / "complained"), "") << "the logs of the page are in order";
  const std::string said = bytes_of(folder_ / "said");
  EXPECT_EQ(said.find("Suspicious"), said.npos);
  expect_named(said, {"with a pose       4161 frames", "E.h5: 40 touches in 4161 frames",
                      "A looks different after every turn"});  // as the page quotes
  for (const char* picture : {"maps.png", "sheets/unknown.png"}) {
    EXPECT_TRUE(std::filesystem::exists(folder_ / picture)) << picture;
  }

  const auto records = nlohmann::json::parse(bytes_of(folder_ / "result.json"));
  ASSERT_EQ(records.size(), 1u);
  const nlohmann::json& record = records[0];
  EXPECT_EQ(record["best"], "A");
  EXPECT_EQ(record["fit"]["verdict"], "fits");
  EXPECT_FALSE(record.contains("warnings")) << record["warnings"];
  // The truth is not in the logs: object=-446.41:26.795:-30 is T_object_robot.
  const std::array truth{400.0, 200.0, std::numbers::pi / 6.0};
  // Half an element's pitch; half an element over the 12.5 mm from the letter's middle to its ends.
  const std::array largest_error{1.0, 1.0, 1.0 / 12.5};
  const nlohmann::json& refined = record["refined"];
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const double error = refined["T_robot_object"][k].get<double>() - truth[k];
    EXPECT_LT(std::abs(error), largest_error[k]) << k;
    // Of normal errors, one in 16,000 is larger.
    EXPECT_LT(std::abs(error), 4.0 * refined["sd"][k].get<double>()) << k;
  }

  std::istringstream lines(bytes_of(folder_ / "live.json"));
  std::string line;
  nlohmann::json live;
  while (std::getline(lines, line)) {
    live = nlohmann::json::parse(line);
  }
  EXPECT_EQ(live["best"], record["best"]);
  EXPECT_EQ(live["fit"]["verdict"], record["fit"]["verdict"]);
  for (std::size_t k = 0; k < truth.size(); ++k) {
    // Equal sums in another order differ by rounding in float32.
    EXPECT_NEAR(live["refined"]["T_robot_object"][k].get<double>(),
                refined["T_robot_object"][k].get<double>(), 1e-3);
  }
}

}  // namespace
}  // namespace palpate
