#include <cstdlib>
#include <future>
#include <random>
#include <regex>

#include <gmock/gmock.h>

#include "fake_serial_board.hpp"
#include "fake_takktile.hpp"
#include "parsing/sent_frame.hpp"
#include "support/program.hpp"

namespace palpate::sensors_command_test {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

/// Runs the program with the USB of the test.
class SensorsCommand : public ProgramTest {
 protected:
  // The options of sanitizer_options.cpp, for the program.
  SensorsCommand() { setenv("ASAN_OPTIONS", "verify_asan_link_order=0:detect_leaks=0", 1); }

  FakeUsb usb_;
};

TEST_F(SensorsCommand, TellsBoardsFromOtherDevices) {
  EXPECT_EQ(done({"sensors"}), "no USB devices\n");
  EXPECT_EQ(json::parse(done({"sensors", "--json"})), json::array());
  FakeTakktile takktile(usb_, "0012", {0b11111, 0b111});
  const FakeSerialBoard tsf85(usb_, "", {}, 3);
  const FakeSerialBoard other(usb_, "B2", {.vendor = 0x2341, .product = 0x8036}, 4);
  const FakeSerialBoard without_driver(usb_, "A1", {}, 5, /*has_driver=*/false);
  const unsigned baud_before = tsf85.port().baud();
  const json boards = json::parse(done({"sensors", "--json"}));
  ASSERT_EQ(boards.size(), 4U);
  EXPECT_EQ(tsf85.port().baud(), baud_before) << "opening it could restart the board";
  EXPECT_EQ(boards[0], json::parse(R"({
    "name": "takktile:0012", "bus": 1, "address": 2, "vendor": "59e3", "product": "74c7",
    "manufacturer": "TakkTile LLC", "product_name": "TakkTile USB", "serial": "0012",
    "serial_port": "", "elements": 8, "rate_hz": 0.0, "pressure_unit": "kPa", "usable": true, "reason": ""})"));
  EXPECT_EQ(boards[1]["name"], "tsf85:1-3") << "no serial number: named by its port";
  EXPECT_EQ(boards[1]["serial_port"], tsf85.node());
  EXPECT_EQ(boards[1]["elements"], 56);
  EXPECT_EQ(boards[1]["rate_hz"], 100.0);
  EXPECT_EQ(boards[1]["pressure_unit"], "raw");
  EXPECT_EQ(boards[1]["usable"], true);
  EXPECT_EQ(boards[2]["usable"], false);
  EXPECT_EQ(boards[2]["name"], "");
  EXPECT_THAT(boards[2]["reason"], HasSubstr("PROFILE:/dev/ttyUSB4"));
  EXPECT_EQ(boards[3]["name"], "tsf85:A1");
  EXPECT_EQ(boards[3]["usable"], false);
  EXPECT_THAT(boards[3]["reason"], HasSubstr("modprobe"));

  const std::string text = done({"sensors"});
  EXPECT_THAT(text, HasSubstr("* 59e3:74c7  takktile:0012\n"
                              "     bus 1, address 2, serial 0012\n"
                              "     8 elements, kPa, rate not known\n"));
  EXPECT_THAT(text, HasSubstr("* 16d0:14cc  tsf85:1-3\n"
                              "     bus 1, address 3, serial none, /dev/ttyUSB3\n"
                              "     56 elements, raw, 100 frames/s\n"));
  EXPECT_THAT(text, HasSubstr("  2341:8036  Maker Serial board\n"
                              "     bus 1, address 4, serial B2, /dev/ttyUSB4\n"
                              "     not known: "));
}

TEST_F(SensorsCommand, RecordsASerialBoardUntilItIsUnplugged) {
  FakeSerialBoard board(usb_, "A1", {});
  auto recording = std::async(std::launch::async, [&] {
    return palpate({"record", "--sensor", "tsf85", "--tare", "0", "-o", "frames.h5"});
  });
  EXPECT_EQ(board.port().received(5).size(), 5U) << "the command to start";
  // More than the kernel keeps for the program, so that most frames have come before the end.
  constexpr int sent = 2000;
  std::mt19937 random(1);
  for (int i = 0; i < sent; ++i) {
    board.port().send(random_frame("tsf85", random).bytes);
  }
  board.unplug();
  const Outcome outcome = recording.get();
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.err, HasSubstr("/dev/ttyUSB2: hung up: the board was unplugged"));
  const std::string info = done({"info", "frames.h5", "--close"});
  std::smatch frames;
  ASSERT_TRUE(std::regex_search(info, frames, std::regex("frames +([0-9]+)\\n"))) << info;
  EXPECT_GT(std::stoi(frames[1]), sent / 4) << "what came is kept";
}

TEST_F(SensorsCommand, SaysWhyABoardCannotBeUsedAndNothingThatATerminalObeys) {
  FakeTakktile board(usb_, "\x1b[2J", {0b11111});
  EXPECT_THAT(done({"sensors"}), Not(HasSubstr("\x1b")));
  EXPECT_EQ(json::parse(done({"sensors", "--json"})).size(), 1U);
  board.usb().behave(FakeUsbDevice::Manner::refuses);
  EXPECT_THAT(done({"sensors"}), HasSubstr("     not usable: USB device 59e3:74c7 at 1-2: request "
                                           "0x5C: it refuses the request"));
}

}  // namespace palpate::sensors_command_test
