// `palpate live` on recorded and simulated streams, without a terminal.

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <numbers>

#include <fmt/format.h>

#include "live_command.hpp"
#include "palpate/frame_recorder.hpp"
#include "palpate/virtual_sensor.hpp"

namespace palpate::live_test {

using Arguments = std::vector<std::string>;

class Live : public LiveTest {
 protected:
  /// What is believed after each touch of a recording of frames is what `touches` and `recognize`
  /// find in it afterwards.
  void expect_agreement(const std::string& frames, std::size_t touches) const {
    const Outcome outcome =
        palpate(live("replay:" + frames + ",speed=max",
                     {"--json", "live.jsonl", "--filter", "histogram"}));  // as `recognize` by auto
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const auto live = parsed(bytes_of(folder_ / "live.jsonl"));
    done({"touches", frames, "-o", "touches.h5"});
    const nlohmann::json trace =
        record({"touches.h5", "--maps", "A.map.h5", "E.map.h5", "--bins", "20x20x24", "--trace"})
            .at("trace");
    ASSERT_EQ(live.size(), touches);
    ASSERT_EQ(trace.size(), live.size());
    for (std::size_t i = 0; i < live.size(); ++i) {
      for (const auto& [key, value] : trace[i].items()) {
        if (key == "fit") {
          // What the array reads untouched is told to more than these digits by both.
          EXPECT_NEAR(live[i].at(key).at("z").get<double>(), value.at("z").get<double>(), 1e-9);
          EXPECT_EQ(live[i].at(key).at("verdict"), value.at("verdict")) << i;
          continue;
        }
        if (key == "touch_fit") {
          ASSERT_EQ(live[i].at(key).size(), value.size());
          for (std::size_t k = 0; k < value.size(); ++k) {
            EXPECT_NEAR(live[i].at(key)[k].get<double>(), value[k].get<double>(), 1e-9);
          }
          continue;
        }
        // Equal touches on one device give the same bits, one by one or together; files
        // hold pressures in float64.
        EXPECT_EQ(live[i].at(key), value) << key << " after touch " << i;
      }
    }
  }
};

// All of a record but the time that it took.
nlohmann::json timeless(nlohmann::json record) {
  EXPECT_GT(record.at("latency_ms").get<double>(), 0.0);
  record.erase("latency_ms");
  return record;
}

TEST_F(Live, RecognisesASimulatedLetter) {
  const Outcome outcome = palpate(live(unknown_e, {"--json", "-"}));
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto records = parsed(outcome.out);
  ASSERT_EQ(records.size(), 4u);
  double last_s = 0.0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    EXPECT_EQ(records[i].at("unknown"), 0u);
    EXPECT_EQ(records[i].at("touch"), i);
    EXPECT_EQ(records[i].at("frames_lost"), 0u);
    EXPECT_GT(records[i].at("time"), last_s);
    last_s = records[i].at("time");
  }
  EXPECT_EQ(records.back().at("best"), "E");
  EXPECT_EQ(records.back().at("right"), true);
  EXPECT_TRUE(records.back().contains("dropped_mass")) << "by bounds, though there are few bins";
  // A bin is 1 mm wide and 15 degrees, by which the letter's ends move about 3 mm.
  EXPECT_LT(records.back().at("refined_error_mm"), 2.0);
  EXPECT_NE(outcome.err.find("4 touches"), std::string::npos) << outcome.err;
}

TEST_F(Live, AgreesWithTouchesFoundAfterwards) {
  done({"record", "--sensor", unknown_e, "-o", "frames.h5"});
  expect_agreement("frames.h5", 4);
}

TEST_F(Live, UnknownAndHugeReadingsCostNoTouch) {
  done({"record", "--sensor", unknown_e, "-o", "frames.h5"});
  Recording frames = read_recording(folder_ / "frames.h5");
  frames.pressure[36 * 110 + 3] = frames.pressure[36 * 111 + 3] = 1e38;
  frames.pressure[36 * 215 + 9] = frames.pressure[36 * 216 + 9] = -1e38;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames.pressure[36 * i + i % 36] = std::nan("");
    if (i > 210 && i < 310) {  // the second press
      frames.pressure[36 * i + 20] = std::nan("");
    }
  }
  write_recording(folder_ / "spoilt.h5", frames);
  expect_agreement("spoilt.h5", 4);
  const auto records = parsed(bytes_of(folder_ / "live.jsonl"));
  ASSERT_EQ(records.size(), 4u);
  EXPECT_EQ(records.back().at("best"), "E");
  // 561 frames, and 99 of one element of which two or three are counted already.
  expect_named(done(live("replay:spoilt.h5,speed=max")), {"4 touches", "65", "readings unknown"});
}

// A clock that is set back by an hour: in the tare, and between the second and the third touch.
TEST_F(Live, AClockThatIsSetBackProlongsNothing) {
  done({"record", "--sensor", unknown_e, "-o", "frames.h5"});
  Recording frames = read_recording(folder_ / "frames.h5");
  frames.baseline.clear();
  for (std::size_t i = 20; i < frames.size(); ++i) {
    frames.time_s[i] -= i < 320 ? 3600.0 : 7200.0;
  }
  write_recording(folder_ / "set.h5", frames);
  const auto records = records_of("replay:set.h5,speed=max", {"--reset-after", "0.2"});
  ASSERT_EQ(records.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(records[i].at("unknown"), i);
  }
}

// A source of poses that never ends a line keeps nobody from ending the program.
TEST_F(Live, EndsWhileTheSourceOfPosesNeverDoes) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const pid_t pid = start(live("simulate:A", {"--poses", "/dev/zero"}));
    ASSERT_GT(pid, 0);
    ::kill(pid, signal);
    int status = 0;
    ::waitpid(pid, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << bytes_of(folder_ / "complained");
    std::filesystem::remove(folder_ / "said");
  }
}

TEST_F(Live, JoinsFramesWithPosesFromAFifo) {
  done({"record", "--sensor", unknown_e, "-o", "frames.h5"});
  const auto expected = records_of("replay:frames.h5,speed=max");

  // A board that does not know where it is gives this stream, too, and a robot that does.
  const auto stream =
      open_virtual_sensor("replay:" + (folder_ / "frames.h5").string() + ",speed=max");
  FrameRecorder bare(folder_ / "bare.h5", stream->description());
  std::string poses = "not a pose\n";
  for (std::size_t i = 0; !stream->ended(); ++i) {
    Frame frame = stream->next({}).value();
    const Pose pose = frame.T_robot_sensor.value();
    if (i % 5 == 0 || stream->ended()) {
      if (i == 50 || i == 300) {  // in milliseconds
        poses += fmt::format("{{\"time\": {:.17g}, \"x_mm\": 0, \"y_mm\": 0, \"theta_rad\": 0}}\n",
                             1000.0 * frame.host_time_s);
      }
      poses += fmt::format("{{\"time\": {:.17g}, \"x_mm\": {}, \"y_mm\": {}, \"theta_rad\": {}}}\n",
                           frame.host_time_s, pose.translation_mm.x, pose.translation_mm.y,
                           pose.theta_rad);
    }
    frame.T_robot_sensor.reset();
    bare.add(frame);
  }
  bare.close();
  ASSERT_EQ(::mkfifo((folder_ / "poses").c_str(), 0600), 0);
  // For reading and writing it opens at once, and all fits into it.
  const int fifo = ::open((folder_ / "poses").c_str(), O_RDWR);
  ASSERT_EQ(::write(fifo, poses.data(), poses.size()), static_cast<ssize_t>(poses.size()));

  const Outcome outcome =
      palpate(live("replay:bare.h5,speed=max", {"--poses", "poses", "--json", "live.jsonl"}));
  ::close(fifo);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("3 lines of poses were skipped"), std::string::npos) << outcome.err;
  // When it happens, each kind once, before the lines of the end.
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 3) << outcome.err;
  expect_named(outcome.err, {"palpate: poses poses, line 1: is no JSON object, and no row of CSV",
                             "palpate: poses poses, line 12: time = 1"});
  const auto records = parsed(bytes_of(folder_ / "live.jsonl"));
  ASSERT_EQ(records.size(), expected.size());
  for (std::size_t i = 0; i < records.size(); ++i) {
    // The robot stands still in the steady phase, so that poses between its own are the same but
    // for rounding.
    for (const char* key : {"x_mm", "y_mm", "theta_rad"}) {
      EXPECT_NEAR(records[i].at("pose").at(key), expected[i].at("pose").at(key), 1e-9) << key;
    }
    EXPECT_EQ(records[i].at("best"), expected[i].at("best"));
    for (const char* label : {"A", "E"}) {
      // A rounded pose moves the likelihood's float32 sums by about 1e-5 nats.
      EXPECT_NEAR(records[i].at("identity").at(label), expected[i].at("identity").at(label), 1e-3);
    }
  }

  expect_refused(live("replay:bare.h5,speed=max", {"--json", "-"}),
                 {"bare.h5", "4 touches", "--poses"});
}

TEST_F(Live, BeginsAnotherUnknownAfterAPause) {
  // From release to onset the simulated robot takes 0.3 s and more.
  const auto records = records_of(unknown_e, {"--reset-after", "0.2"});
  ASSERT_EQ(records.size(), 4u);
  for (std::size_t i = 0; i < records.size(); ++i) {
    EXPECT_EQ(records[i].at("unknown"), i);
    EXPECT_EQ(records[i].at("touch"), 0u);
  }
  const auto patient = records_of(unknown_e, {"--reset-after", "2"});
  ASSERT_EQ(patient.size(), 4u);
  EXPECT_EQ(patient.back().at("unknown"), 0u);
  EXPECT_EQ(patient.back().at("touch"), 3u);
  EXPECT_EQ(timeless(patient.front()).at("identity"), timeless(records.front()).at("identity"));
  EXPECT_NE(patient.back().at("identity"), records.back().at("identity"));
}

TEST_F(Live, PrintsALineForEachTouch) {
  const std::string out = done(live(unknown_e));
  EXPECT_EQ(out.find('\033'), std::string::npos) << "escape codes without a terminal";
  EXPECT_NE(out.find("unknown  touch  best"), std::string::npos) << out;
  EXPECT_NE(out.find("\n      1      4  E "), std::string::npos) << out;
  EXPECT_NE(out.find("4 touches"), std::string::npos) << out;
  EXPECT_NE(out.find(" 0 lost"), std::string::npos) << out;
  EXPECT_NE(out.find("from frame to estimate: median "), std::string::npos) << out;
}

// The table of a stream, the trace and the table of the touches found in it.
TEST_F(Live, SaysThePoseThatRecognizeSays) {
  done({"record", "--sensor", unknown_e, "-o", "frames.h5"});
  done({"touches", "frames.h5", "-o", "touches.h5"});
  const std::string live_out = done(live("replay:frames.h5,speed=max"));
  const Arguments call{"touches.h5", "--maps", "A.map.h5", "E.map.h5", "--bins", "20x20x24"};
  const nlohmann::json r = record(call);
  Arguments shown = call;
  shown.insert(shown.begin(), "recognize");
  shown.emplace_back("--trace");
  const std::string recognize_out = done(shown);
  const std::vector<double> pose = r.at("refined").at("T_robot_object");
  const std::vector<double> sd = r.at("refined").at("sd");
  const auto in = [&](std::size_t i, const char* between) {
    const double unit = i < 2 ? 1.0 : 180.0 / std::numbers::pi;
    return fmt::format("{:.2f}{}+-{:.2f}", pose[i] * unit, between, sd[i] * unit);
  };
  for (const std::string& out : {live_out, recognize_out}) {
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NE(out.find(" " + in(i, "")), std::string::npos) << in(i, "") << " not in\n" << out;
    }
  }
  EXPECT_NE(
      live_out.find(fmt::format("\nE ({:.1f} %): x {} mm, y {} mm, theta {} deg\ntruth: E at ",
                                100.0 * r.at("identity").at("E").get<double>(), in(0, " "),
                                in(1, " "), in(2, " "))),
      std::string::npos)
      << live_out;
  // The trace and the end of the stream say the same of the truth.
  const std::string truth = recognize_out.substr(recognize_out.find("truth: E at "));
  EXPECT_NE(live_out.find(truth.substr(0, truth.find('\n') + 1)), std::string::npos) << live_out;
  EXPECT_NE(truth.find(fmt::format("; error {:.2f} mm\n", r.at("refined_error_mm").get<double>())),
            std::string::npos)
      << truth;
}

TEST_F(Live, TakesTheFlagsOfRecognize) {
  const auto records =
      records_of(unknown_e, {"--filter", "particles", "--particles", "500", "--slip-sd-mm", "0.5"});
  ASSERT_EQ(records.size(), 4u);
  EXPECT_TRUE(records.back().contains("effective_sample_size"));
  EXPECT_FALSE(records.back().contains("refined"));
  EXPECT_FALSE(records.back().contains("touch_fit"));
}

TEST_F(Live, TellsTheFitOfEveryTouch) {
  const auto records = records_of(unknown_e, {"--none", "--touch-sd-mm", "0.5"});
  ASSERT_EQ(records.size(), 4u);
  for (std::size_t i = 0; i < records.size(); ++i) {
    ASSERT_EQ(records[i].at("touch_fit").size(), i + 1);
    EXPECT_GT(records[i].at("touch_fit").back().get<double>(), -5.0);
    EXPECT_EQ(records[i].at("none"), records[i].at("identity").at("(none)"));
  }
}

TEST_F(Live, RefusesWhatCannotBeMeant) {
  expect_refused(live("nothing"), {"--poses", "nothing"});
  expect_refused(live("nothing", {"--poses", "-"}), {"nothing"});
  expect_refused(live("simulate:A,colour=red"), {"colour"});
  expect_refused({"live", "--sensor", unknown_e}, {"--maps", "missing"});
  expect_refused({"live", "--maps", "A.map.h5"}, {"--sensor"});
  expect_refused(live(unknown_e, {"--reset-after", "0"}), {"--reset-after"});
  expect_refused(live(unknown_e, {"--tare", "-1"}), {"--tare"});
  expect_refused(live(unknown_e, {"--gamma", "1"}), {"--gamma"});
  expect_refused(live(unknown_e, {"--touch-sd-mm", "-1"}), {"--touch-sd-mm -1", "from 0"});
  expect_refused(live(unknown_e, {"--json", "E.map.h5"}), {"--json", "E.map.h5", "overwrite"});
  expect_refused(live(unknown_e, {"--json", "no/such.jsonl"}), {"--json", "no/such.jsonl"});

  done({"record", "--sensor", unknown_e, "-o", "frames,1.h5"});
  expect_refused(live("replay:frames,1.h5,speed=max", {"--json", "frames,1.h5"}),
                 {"--json", "overwrite"});
  std::ofstream(folder_ / "poses.jsonl") << "{\"time\": 1, \"x_mm\": 0, \"y_mm\": 0}\n";
  expect_refused(live(unknown_e, {"--poses", "poses.jsonl"}), {"poses.jsonl", "theta_rad"});
  write_recording(folder_ / "touches.h5", sample_unknown("A", {}, 2));
  expect_refused(live("replay:touches.h5"), {"touches.h5", "rows"});
}

TEST_F(Live, SaysWhereALineCannotBeWritten) {
  const Outcome outcome = palpate(live(unknown_e, {"--json", "/dev/full"}));
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("/dev/full"), std::string::npos) << outcome.err;
}

}  // namespace palpate::live_test
