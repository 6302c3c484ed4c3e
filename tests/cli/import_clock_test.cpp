// What palpate import, touches, map and check say of logs whose clocks differ.

#include <random>

#include <fmt/format.h>

#include "import_command.hpp"

namespace palpate::import_clock_test {

using nlohmann::json;

/// Uniform over [0, 1).
double part(std::mt19937& random) { return random() / 4294967296.0; }

class ClocksOfLogs : public ImportCommand {
 protected:
  /// Thirty presses of two elements, of 0.4 to 0.8 s each, and 0.5 s of travel between them; the
  /// poses' clock is so much ahead.
  void put_logs(double ahead_s) const {
    std::mt19937 random(3);
    std::string log = "time,p0,p1\n";
    std::string track = "time,x_mm,y_mm,theta_rad\n";
    double at_s = 0.0;
    const auto row = [&](double pressure, double place_mm) {
      log += fmt::format("{:.3f},{:.3f},0.2\n", at_s, pressure + 0.1 * part(random));
      track += fmt::format("{:.3f},{:.3f},0,0.1\n", at_s + ahead_s, place_mm);
      at_s += 0.02;
    };
    for (int k = 0; k < 30; ++k) {
      for (int i = 0; i < 25; ++i) {
        row(0.0, 6.0 * k + 0.24 * i);
      }
      for (double i = 20.0 + 20.0 * part(random); i > 0.0; --i) {
        row(10.0, 6.0 * (k + 1));
      }
    }
    put("log.csv", log);
    put("poses.csv", track);
  }

  const std::string with_poses_ = "--object cup --poses poses.csv";
};

TEST_F(ClocksOfLogs, ThatDifferAreSaidUntilTheirOffsetIsGiven) {
  put_logs(0.62);
  expect_named(warned(with_poses_),
               {"palpate: poses.csv: the poses' clock seems 0.6", " s ahead: in ",
                "of 30 presses the array moves, is lifted, or has no pose; with --pose-delay 0.6"});
  expect_named(done("touches o.h5 -o t.h5"),
               {" left out as not steady, clocks differ (palpate import --pose-delay 0.6"});
  const Recording touches = read_recording(folder_ / "t.h5");
  ASSERT_EQ(touches.findings.size(), 2u);
  EXPECT_EQ(touches.findings[0].what, "clock");
  EXPECT_GT(touches.findings[0].nats, 20.0);
  EXPECT_EQ(touches.findings[1].what, "dropped");
  EXPECT_EQ(touches.findings[1].options, touches.findings[0].options);
  expect_named(touches.findings[1].words, {"; the clocks differ: import with `pose-delay"});
  expect_named(remarks("map t.h5 -o cup.map.h5"), {"t.h5: the poses' clock seems"});
  const json findings = json::parse(done("check t.h5 --json -"));
  const json& clock = findings[findings.size() - 2];
  EXPECT_EQ(clock["what"], "clock");
  EXPECT_EQ(clock["flag"], "--" + touches.findings[0].options.at(0));
  expect_named(clock["words"], {"t.h5: the poses' clock seems"});
  EXPECT_EQ(findings.back()["what"], "dropped");
  EXPECT_EQ(findings.back()["nats"], 0.0);

  EXPECT_EQ(warned(with_poses_ + " --pose-delay 0.62"), "");
  expect_named(warned(with_poses_ + " --pose-delay 0.2"), {"ahead"});
  put_logs(-3600.3);
  std::filesystem::remove(folder_ / "o.h5");
  expect_refused(
      command("--poses poses.csv"),
      {"poses.csv", "finds a pose", "their offset but for 1.05 s", "--pose-delay -3600.3"});
}

TEST_F(ClocksOfLogs, ThatAgreeAreNotSaid) {
  put_logs(0.0);
  EXPECT_EQ(warned(with_poses_), "");
  expect_named(done("touches o.h5 -o t.h5"), {"30 touches in "});
  EXPECT_TRUE(read_recording(folder_ / "t.h5").findings.empty());
}

TEST_F(ClocksOfLogs, ADelayNeedsPosesWithTimes) {
  put("poses.csv", "x,y,theta\n0,0,0\n0,0,0\n0,0,0\n");
  expect_refused(command("--poses poses.csv --pose-delay 0.1"),
                 {"--pose-delay 0.1: poses.csv has no times"});
  expect_refused(command("--poses poses.csv --pose-delay nan"), {"--pose-delay nan"});
}

}  // namespace palpate::import_clock_test
