#include <algorithm>
#include <fstream>
#include <iterator>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "driver/data_folder.hpp"
#include "driver/usb_device.hpp"
#include "fake_serial_board.hpp"
#include "io/scratch_folder.hpp"
#include "palpate/driver.hpp"
#include "palpate/error.hpp"
#include "parsing/sent_frame.hpp"
#include "streamed.hpp"

namespace palpate::serial_board_test {

using testing::AllOf;
using testing::HasSubstr;

// A USB id that no profile lists.
constexpr FakeSerialBoard::Ids some_controller{.vendor = 0x2341, .product = 0x8036};
constexpr int data_interface = 3;

const Bytes tsf85_start = {0x9a, 0x00, 0x58, 0x01, 0x0a};
const Bytes tsf85_stop = {0x9a, 0x00, 0x58, 0x01, 0x00};

class SerialBoards : public testing::Test {
 protected:
  std::vector<SentFrame> frames_of(const std::string& board, int count) {
    std::vector<SentFrame> frames;
    std::generate_n(std::back_inserter(frames), count,
                    [&] { return random_frame(board, random_); });
    return frames;
  }

  /// Expects the values of these frames, in order.
  static void expect_values(Sensor& sensor, const std::vector<SentFrame>& sent) {
    const std::vector<Frame> frames = take(sensor, sent.size());
    ASSERT_EQ(frames.size(), sent.size());
    for (std::size_t i = 0; i < sent.size(); ++i) {
      ASSERT_EQ(frames[i].values, sent[i].values) << "frame " << i;
    }
  }

  FakeUsb usb_;
  std::mt19937 random_{20260721};
};

TEST_F(SerialBoards, AreListedByTheirIds) {
  FakeSerialBoard known(usb_, "A1", {});
  FakeSerialBoard unknown(usb_, "B2", some_controller, FakeSerialBoard::Union::present, 3);
  const std::vector<BoardInfo> boards = list_boards();
  ASSERT_EQ(boards.size(), 2U);
  EXPECT_EQ(boards[0].name, "tsf85:A1");
  EXPECT_EQ(boards[0].elements, 56U);
  EXPECT_EQ(boards[0].rate_hz, 100.0);
  EXPECT_EQ(boards[0].pressure_unit, "raw");
  EXPECT_TRUE(boards[0].usable) << boards[0].reason;
  EXPECT_TRUE(known.usb().has_kernel_driver(data_interface)) << "looking disturbs nobody";
  EXPECT_EQ(boards[1].name, "");
  EXPECT_EQ(boards[1].serial, "B2");
  EXPECT_FALSE(boards[1].usable);
}

TEST_F(SerialBoards, SetTheLineAndSayStartAndStop) {
  FakeSerialBoard board(usb_, "A1", {});
  {
    const auto sensor = open_board("tsf85");
    EXPECT_FALSE(board.usb().has_kernel_driver(data_interface));
    EXPECT_EQ(board.usb().received(), Bytes{});
    sensor->start();
    EXPECT_EQ(board.line_coding(), (Bytes{0x00, 0xc2, 0x01, 0x00, 0, 0, 8})) << "115200 8N1";
    EXPECT_EQ(board.line_state(), 3);
    EXPECT_EQ(board.usb().received(), tsf85_start);
    sensor->stop();
    EXPECT_EQ(board.line_state(), 0);
    Bytes both = tsf85_start;
    both.insert(both.end(), tsf85_stop.begin(), tsf85_stop.end());
    EXPECT_EQ(board.usb().received(), both);
  }
  EXPECT_TRUE(board.usb().has_kernel_driver(data_interface)) << "given back";
}

TEST_F(SerialBoards, FindTheControlInterfaceWithoutAUnionDescriptor) {
  FakeSerialBoard board(usb_, "A1", {}, FakeSerialBoard::Union::missing);
  const auto sensor = open_board("tsf85");
  sensor->start();
  EXPECT_EQ(board.line_state(), 3);
}

TEST_F(SerialBoards, HavePacketsOfTheBitsThatCount) {
  FakeSerialBoard board(usb_, "A1", {});
  const UsbContext context;
  const BulkInterface data = find_interface(usb_devices(context).at(0), LIBUSB_CLASS_DATA);
  EXPECT_EQ(data.number, data_interface);
  EXPECT_EQ(data.in_endpoint, 0x83);
  EXPECT_EQ(data.out_endpoint, 0x03);
  EXPECT_EQ(data.packet_bytes, 64U);
}

TEST_F(SerialBoards, StreamWhereverPacketsCutTheFrames) {
  FakeSerialBoard board(usb_, "A1", {});
  const auto sensor = open_board("tsf85");
  sensor->start();
  const std::vector<SentFrame> sent = frames_of("tsf85", 200);
  std::thread firmware([&] {
    std::mt19937 cuts(1);
    Bytes waiting;
    at_rate(1000.0, static_cast<int>(sent.size()), [&](int i) {
      const Bytes& bytes = sent[static_cast<std::size_t>(i)].bytes;
      waiting.insert(waiting.end(), bytes.begin(), bytes.end());
      const bool last = i + 1 == static_cast<int>(sent.size());
      while (!waiting.empty()) {
        const std::size_t packet = std::min<std::size_t>(waiting.size(), 1 + cuts() % 64);
        if (packet == waiting.size() && !last) {
          break;  // the next frame brings the rest
        }
        const auto end = waiting.begin() + static_cast<std::ptrdiff_t>(packet);
        board.usb().send_packet(Bytes(waiting.begin(), end));
        waiting.erase(waiting.begin(), end);
      }
    });
  });
  expect_values(*sensor, sent);
  firmware.join();
  sensor->stop();
  EXPECT_EQ(sensor->counters().frames, sent.size());
  EXPECT_EQ(sensor->counters().garbage_bytes, 0U);
}

TEST_F(SerialBoards, WithoutAnIdOfTheirOwnAreNamedBySerialOrPort) {
  FakeSerialBoard board(usb_, "B2", some_controller);
  try {
    open_board("flexitac");
    ADD_FAILURE() << "it could be any device";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::input);
    EXPECT_THAT(error.what(), AllOf(HasSubstr("flexitac"), HasSubstr("serial number or port")));
  }
  for (const std::string name : {"flexitac:B2", "flexitac:1-2"}) {
    const auto sensor = open_board(name);
    sensor->start();
    const std::vector<SentFrame> sent = frames_of("flexitac", 50);
    // Full packets: only the last frame's rest ends a transfer before the transfer is full.
    board.usb().send_message(stream_of(sent));
    // A marker counts once another marker follows one frame later, so that the last frame waits.
    const std::vector<SentFrame> more = frames_of("flexitac", 1);
    board.usb().send_message(more[0].bytes);
    expect_values(*sensor, sent);
  }
}

TEST_F(SerialBoards, CountWhatADamagedPacketCosts) {
  FakeSerialBoard board(usb_, "B2", some_controller);
  const auto sensor = open_board("wts:B2");
  sensor->start();
  std::vector<SentFrame> sent = frames_of("wts", 3);
  board.usb().send_message(sent[0].bytes);
  Bytes damaged = sent[1].bytes;
  damaged[40] ^= 0x10;
  board.usb().send_message(damaged);
  board.usb().send_message(sent[2].bytes);
  const std::vector<Frame> frames = take(*sensor, 2);
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_EQ(frames[0].values, sent[0].values);
  EXPECT_TRUE(frames[0].device_time_s.has_value());
  EXPECT_EQ(frames[1].values, sent[2].values);
  EXPECT_EQ(frames[1].lost_before, 1U);
  sensor->stop();
  EXPECT_EQ(sensor->counters().checksum_errors, 1U);
  EXPECT_EQ(sensor->counters().lost, 1U);
}

TEST_F(SerialBoards, AreStartedAgainWhenTheyComeBack) {
  FakeSerialBoard board(usb_, "A1", {});
  const auto sensor = open_board("tsf85:A1");
  sensor->start();
  const std::vector<SentFrame> sent = frames_of("tsf85", 2);
  // The plug is pulled within a frame.
  board.usb().send_packet(Bytes(sent[0].bytes.begin(), sent[0].bytes.begin() + 30));
  ASSERT_TRUE(becomes_true([&] { return board.usb().waiting_packets() == 0; }));
  board.usb().unplug();
  ASSERT_TRUE(becomes_true([&] { return sensor->gone(); }));
  board.usb().plug();
  ASSERT_TRUE(becomes_true([&] { return !sensor->gone(); }));
  Bytes twice = tsf85_start;
  twice.insert(twice.end(), tsf85_start.begin(), tsf85_start.end());
  EXPECT_EQ(board.usb().received(), twice);
  board.usb().send_message(sent[1].bytes);
  expect_values(*sensor, {sent[1]});
}

TEST_F(SerialBoards, ForgetHalfAFrameWhenTheyAreStartedAgain) {
  FakeSerialBoard board(usb_, "A1", {});
  const auto sensor = open_board("tsf85:A1");
  const std::vector<SentFrame> sent = frames_of("tsf85", 2);
  sensor->start();
  board.usb().send_packet(Bytes(sent[0].bytes.begin(), sent[0].bytes.begin() + 30));
  ASSERT_TRUE(becomes_true([&] { return board.usb().waiting_packets() == 0; }));
  sensor->start();
  board.usb().send_message(sent[1].bytes);
  expect_values(*sensor, {sent[1]});
  sensor->stop();
  EXPECT_EQ(sensor->counters().garbage_bytes, 0U);
}

TEST_F(SerialBoards, DoNotJoinWhatStandsOnBothSidesOfALoss) {
  FakeSerialBoard board(usb_, "A1", {});
  const auto sensor = open_board("tsf85:A1");
  const std::vector<SentFrame> sent = frames_of("tsf85", 2);
  sensor->start();
  board.usb().send_packet(Bytes(sent[0].bytes.begin(), sent[0].bytes.begin() + 30));
  board.usb().send_fault(FakeUsbDevice::Fault::protocol);
  board.usb().send_message(sent[1].bytes);
  expect_values(*sensor, {sent[1]});
  sensor->stop();
  EXPECT_EQ(sensor->counters().lost, 1U);
}

TEST_F(SerialBoards, HaveProfilesOfTheUsersOwn) {
  ScratchFolder folder;
  const std::string path = folder.path() / "mine.yaml";
  {
    std::ifstream shipped(data_folder() / "profiles" / "tsf85.yaml");
    std::string text(std::istreambuf_iterator<char>(shipped), {});
    const std::string ids = "usb: [16d0:14cc, 04b4:f232]";
    const std::size_t at = text.find(ids);
    ASSERT_NE(at, std::string::npos);
    std::ofstream(path) << text.replace(at, ids.size(), "usb: [2341:8036]");
  }
  FakeSerialBoard board(usb_, "B2", some_controller);
  for (const std::string& name : {path, path + ":B2", path + ":1-2"}) {
    const auto sensor = open_board(name);
    EXPECT_EQ(sensor->description().elements_mm.size(), 56U);
    sensor->start();
    const std::vector<SentFrame> sent = frames_of("tsf85", 3);
    board.usb().send_message(stream_of(sent));
    expect_values(*sensor, sent);
  }
  EXPECT_THROW(open_board(path + ":C3"), Error);
}

}  // namespace palpate::serial_board_test
