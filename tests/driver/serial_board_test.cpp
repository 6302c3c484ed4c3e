#include <sys/stat.h>

#include <algorithm>
#include <random>

#include <fmt/format.h>

#include "driver/device.hpp"
#include "fake_serial_board.hpp"
#include "ordinary_user.hpp"
#include "palpate/driver.hpp"
#include "parsing/sent_frame.hpp"
#include "streamed.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::serial_board_test {

// A USB id that no profile lists: that of a CH340.
constexpr FakeSerialBoard::Ids some_chip{.vendor = 0x1a86, .product = 0x7523};

const Bytes tsf85_start = {0x9a, 0x00, 0x58, 0x01, 0x0a};
const Bytes tsf85_stop = {0x9a, 0x00, 0x58, 0x01, 0x00};

class SerialBoards : public testing::Test {
 protected:
  std::vector<SentFrame> frames_of(const std::string& board, std::size_t count) {
    return random_frames(board, count, random_);
  }

  /// Sends frames through the port and expects their values from the sensor, in order. A format
  /// without checksum believes a frame once the next begins: its last frame only comes `after`.
  void expect_stream(Sensor& sensor, const FakePort& port, const std::string& board,
                     std::size_t count, std::size_t after = 0) {
    std::vector<SentFrame> sent = frames_of(board, count + after);
    port.send(stream_of(sent));
    sent.resize(count);
    expect_values(sensor, sent);
  }
  static void expect_values(Sensor& sensor, const std::vector<SentFrame>& sent) {
    const std::vector<Frame> frames = take(sensor, sent.size());
    ASSERT_EQ(frames.size(), sent.size());
    for (std::size_t i = 0; i < sent.size(); ++i) {
      ASSERT_EQ(frames[i].values, sent[i].values) << "frame " << i;
    }
  }

  static void expect_refused(Fault fault, const std::string& name,
                             std::initializer_list<const char*> parts) {
    SCOPED_TRACE(name);
    expect_named(error_of(fault, [&] { open_board(name); }), parts);
  }

  /// A profile of the user's own.
  std::string own_profile(const std::string& yaml) const {
    put_bytes(folder_ / "mine.yaml", yaml);
    return (folder_ / "mine.yaml").string();
  }

  ScratchFolder folder_;
  FakeUsb usb_;
  std::mt19937 random_{20260721};
};

TEST_F(SerialBoards, SetTheLineSayStartAndStopAndStreamWithoutALoss) {
  const FakeSerialBoard board(usb_, "A1", {});
  const auto sensor = open_board("tsf85");
  EXPECT_EQ(sensor->description().serial, "A1");
  EXPECT_EQ(board.port().baud(), 115200U);
  EXPECT_FALSE(board.port().two_stop_bits());
  for (int i = 0; i < 2; ++i) {
    sensor->start();
    EXPECT_EQ(board.port().received(tsf85_start.size()), tsf85_start);
    // More bytes than the kernel keeps: reads cut the frames anywhere.
    expect_stream(*sensor, board.port(), "tsf85", 200);
    sensor->stop();
    EXPECT_EQ(board.port().received(tsf85_stop.size()), tsf85_stop);
    EXPECT_EQ(sensor->counters().frames, 200U);
    EXPECT_EQ(sensor->counters().lost, 0U);
    EXPECT_EQ(sensor->counters().garbage_bytes, 0U);
  }
}

TEST_F(SerialBoards, TakeEveryBaudRate) {
  const FakePort port(usb_);
  for (const unsigned baud : {9600U, 250000U, 2000000U, 12345678U}) {
    const std::string path = own_profile(
        fmt::format("{{name: Mine, line: {{baud: {}, stop_bits: 2}}, elements: [[0, 0]],"
                    " packet: [bytes: aa55, values: u8]}}",
                    baud));
    const auto sensor = open_board(path + ":" + port.node());
    EXPECT_EQ(port.baud(), baud);
    EXPECT_TRUE(port.two_stop_bits());
  }
}

// Their frames hold every byte, also those that a terminal would take for itself.
TEST_F(SerialBoards, WithoutAnIdOfTheirOwnAreNamedBySerialPortOrPath) {
  const FakeSerialBoard board(usb_, "B2", some_chip);
  expect_refused(Fault::input, "flexitac", {"flexitac", "serial number, port or device file"});
  for (const std::string& which : {std::string("B2"), std::string("1-2"), board.node()}) {
    const auto sensor = open_board("flexitac:" + which);
    EXPECT_EQ(sensor->description().serial, "B2");
    sensor->start();
    expect_stream(*sensor, board.port(), "flexitac", 50, 1);
  }
}

TEST_F(SerialBoards, AreToldApart) {
  const FakeSerialBoard one(usb_, "A1", {});
  const FakeSerialBoard other(usb_, "A1", {}, 3);
  const FakeSerialBoard third(usb_, "A3", {}, 4);
  expect_refused(Fault::input, "tsf85", {"tsf85:1-2, tsf85:1-3, tsf85:A3"});
  expect_refused(Fault::input, "tsf85:A1", {"tsf85:1-2, tsf85:1-3"});
  for (const auto& [name, board] : {std::pair("tsf85:1-3", &other), {"tsf85:A3", &third}}) {
    open_board(name)->start();
    EXPECT_EQ(board->port().received(tsf85_start.size()), tsf85_start);
  }
}

TEST_F(SerialBoards, WithTwoPortsAreNamedByTheirPaths) {
  const FakeSerialBoard board(usb_, "A1", {});
  usb_.add("P: /devices/pci0000:00/usb1/1-2/1-2:1.0/tty/ttyUSB7\nE: SUBSYSTEM=tty\n");
  expect_refused(Fault::input, "tsf85:A1", {"tsf85:/dev/ttyUSB2, tsf85:/dev/ttyUSB7"});
  open_board("tsf85:/dev/ttyUSB2")->start();
  EXPECT_EQ(list_boards().at(0).name, "tsf85:/dev/ttyUSB2");
}

TEST_F(SerialBoards, CountWhatADamagedPacketCosts) {
  const FakePort port(usb_);
  const auto sensor = open_board("wts:" + port.node());
  sensor->start();
  std::vector<SentFrame> sent = frames_of("wts", 3);
  sent[1].bytes[40] ^= 0x10;
  port.send(sent[0].bytes);
  std::vector<Frame> frames = take(*sensor, 1);
  port.send(stream_of({sent[1], sent[2]}));
  std::ranges::move(take(*sensor, 1), std::back_inserter(frames));
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_EQ(frames[0].values, sent[0].values);
  EXPECT_TRUE(frames[0].device_time_s.has_value());
  EXPECT_GT(frames[0].host_time_s, 1.7e9) << "seconds since the Unix epoch";
  EXPECT_EQ(frames[0].lost_before, 0U);
  EXPECT_EQ(frames[1].values, sent[2].values);
  EXPECT_EQ(frames[1].lost_before, 1U);
  sensor->stop();
  EXPECT_EQ(sensor->counters().checksum_errors, 1U);
  EXPECT_EQ(sensor->counters().lost, 1U);
  sensor->start();
  EXPECT_EQ(sensor->counters().checksum_errors, 0U);
}

TEST_F(SerialBoards, ThatAreUnpluggedEndTheStreamUntilItIsStartedAgain) {
  for (const std::string kind : {"tsf85", "flexitac"}) {
    FakeSerialBoard board(usb_, "A1", {});
    const auto sensor = open_board(kind + ":A1");
    sensor->start();
    const auto drain = [&] {
      while (sensor->next(patience)) {
      }
    };
    for (int i = 0; i < 3; ++i) {
      expect_stream(*sensor, board.port(), kind, 2, 1);
      board.unplug();
      for (int j = 0; j < 2; ++j) {
        expect_named(error_of(Fault::system, drain), {"unplugged"});
      }
      expect_named(input_error([&] { sensor->start(); }), {"not plugged in"});
      sensor->stop();
      board.plug();
      sensor->start();
      EXPECT_EQ(sensor->counters().frames, 0U);
    }
    sensor->stop();
    board.unplug();
    board.plug();
    sensor->start();
    expect_stream(*sensor, board.port(), kind, 1, 1);
    board.unplug();
    sensor->stop();
  }
}

TEST_F(SerialBoards, ForgetWhatCameBeforeTheyAreStarted) {
  FakePort port(usb_);
  port.watch();
  const auto sensor = open_board("tsf85:" + port.node());
  const std::vector<SentFrame> sent = frames_of("tsf85", 3);
  port.send(sent[0].bytes);
  const int waiting = static_cast<int>(sent[0].bytes.size());
  ASSERT_TRUE(becomes_true([&] { return port.unread() == waiting; }));
  sensor->start();
  port.send(Bytes(sent[1].bytes.begin(), sent[1].bytes.begin() + 30));
  ASSERT_TRUE(becomes_true([&] { return port.unread() == 0; }));
  sensor->start();
  port.send(sent[2].bytes);
  expect_values(*sensor, {sent[2]});
  sensor->stop();
  EXPECT_EQ(sensor->counters().garbage_bytes, 0U);
}

TEST_F(SerialBoards, AreOpenedByOneProgramAtATime) {
  const FakePort port(usb_);
  const auto sensor = open_board("tsf85:" + port.node());
  expect_refused(Fault::system, "tsf85:" + port.node(), {port.node().c_str(), "in use"});
  sensor->start();
  EXPECT_EQ(port.received(tsf85_start.size()), tsf85_start) << "undisturbed";
}

TEST_F(SerialBoards, WithoutPermissionNameTheGroup) {
  const FakePort port(usb_);
  chmod(port.node().c_str(), 0);
  const OrdinaryUser user;
  expect_refused(Fault::system, "tsf85:" + port.node(), {port.node().c_str(), "sudo usermod -aG "});
}

TEST_F(SerialBoards, OfAnotherPathAreTheUsersMistake) {
  expect_refused(Fault::input, "tsf85:/dev/ttyUSB99", {"/dev/ttyUSB99", "not plugged in"});
  expect_refused(Fault::input, "tsf85:/dev/zero", {"/dev/zero", "no serial port"});
  expect_refused(Fault::input, "tsf85:C3", {"not plugged in"});
}

TEST_F(SerialBoards, HaveProfilesOfTheUsersOwn) {
  std::string text = bytes_of(data_folder() / "profiles" / "tsf85.yaml");
  const std::string ids = "usb: [16d0:14cc, 04b4:f232]";
  const std::string path =
      own_profile(text.replace(text.find(ids), ids.size(), "usb: [1a86:7523]"));
  const FakeSerialBoard other(usb_, "A1", {}, 3);
  const FakeSerialBoard board(usb_, "B2", some_chip);
  for (const std::string& name : {path, path + ":B2", path + ":1-2", path + ":" + board.node()}) {
    const auto sensor = open_board(name);
    EXPECT_EQ(sensor->description().elements_mm.size(), 56U);
    sensor->start();
    expect_stream(*sensor, board.port(), "tsf85", 3);
  }
  expect_refused(Fault::input, path + ":C3", {"not plugged in"});
  expect_refused(Fault::input, path + ":A1", {});  // which is another kind of board
}

}  // namespace palpate::serial_board_test
