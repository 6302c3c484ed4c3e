// Boards that are unplugged and plugged in again, while they stream and while they are stopped.
#include <tuple>

#include "fake_takktile.hpp"
#include "palpate/driver.hpp"
#include "streamed.hpp"
#include "support/errors.hpp"

namespace palpate::hotplug_test {

using namespace std::chrono_literals;
using Layout = FakeTakktile::Layout;
using Manner = FakeUsbDevice::Manner;

/// A board of five cells and its sensor.
struct PluggedIn {
  explicit PluggedIn(FakeUsb& usb, const std::string& serial = "1", int address = 2,
                     const std::string& name = "takktile")
      : board(usb, serial, {0b11111}, Layout::bits, address), sensor(open_board(name)) {}

  void unplug() { board.usb().unplug(); }
  void unplug_and_notice() {
    unplug();
    EXPECT_TRUE(becomes_true([&] { return sensor->gone(); }));
  }
  void plug_and_notice() {
    board.usb().plug();
    EXPECT_TRUE(becomes_true([&] { return !sensor->gone(); }));
  }
  /// Streams, is unplugged, and comes back with these cells.
  void come_back_with(std::vector<std::uint8_t> alive_rows) {
    sensor->start();
    expect_frame(100);
    unplug_and_notice();
    board.replace_cells(std::move(alive_rows));
    board.usb().plug();
  }
  void expect_frame(int raw, int recalibrations = 0) {
    ASSERT_TRUE(becomes_true([&] { return board.streaming() && board.usb().seen().claimed; }));
    board.send_frame(raw);
    expect_frames(*sensor, 5, raw, 1, recalibrations);
  }
  /// Starts the sensor and expects a frame of the board that it found.
  void expect_start(int raw, int recalibrations = 0) {
    sensor->start();
    EXPECT_TRUE(board.streaming());
    EXPECT_FALSE(sensor->gone());
    expect_frame(raw, recalibrations);
    EXPECT_EQ(sensor->counters().frames, 1U);
    EXPECT_EQ(sensor->counters().reconnects, 0U) << "since start()";
  }
  std::string refusal(Fault fault) {
    return error_of(fault, [&] { sensor->start(); });
  }
  /// Expects that the board was given back, and is found once it has its cells again.
  void expect_start_with_cells() {
    EXPECT_FALSE(board.usb().seen().claimed) << "given back";
    board.replace_cells({0b11111});
    expect_start(100);
  }

  FakeTakktile board;
  std::unique_ptr<Sensor> sensor;
};

class Hotplug : public testing::Test {
 protected:
  FakeUsb usb_;
};
using Restart = Hotplug;

// A board without a serial number is known by its port.
TEST_F(Hotplug, AStreamOutlivesUnpluggingAndReadsTheCalibrationAgain) {
  for (const std::string serial : {"0012", ""}) {
    PluggedIn plugged(usb_, serial);
    EXPECT_EQ(list_boards().at(0).name, serial.empty() ? "takktile:1-2" : "takktile:0012");
    Sensor& sensor = *plugged.sensor;
    sensor.start();
    for (int round = 1; round <= 2; ++round) {
      plugged.expect_frame(100 + round, round - 1);
      plugged.board.send_frame(500);  // may be in transfer when the plug is pulled
      plugged.unplug_and_notice();
      while (sensor.next(10ms)) {
      }
      EXPECT_EQ(sensor.next(10ms), std::nullopt) << "it only times out";
      plugged.board.recalibrate();
      plugged.plug_and_notice();
      EXPECT_EQ(sensor.counters().reconnects, static_cast<std::uint64_t>(round));
    }
    plugged.expect_frame(300, 2);
  }
}

TEST_F(Hotplug, BoardsThatShareASerialNumberAreKnownByTheirPorts) {
  FakeTakktile copy(usb_, "0001", {0b11111});
  PluggedIn plugged(usb_, "0001", 3, "takktile:1-3");
  EXPECT_EQ(list_boards().at(0).name, "takktile:1-2");
  EXPECT_EQ(list_boards().at(1).name, "takktile:1-3");
  expect_named(input_error([] { open_board("takktile:0001"); }), {"takktile:1-2, takktile:1-3"});
  plugged.sensor->start();
  plugged.expect_frame(100);
  plugged.unplug_and_notice();
  plugged.plug_and_notice();
  plugged.expect_frame(101);
  EXPECT_FALSE(copy.usb().seen().claimed);
}

TEST_F(Hotplug, OtherCellsThanBeforeAreRefusedAndABoardWithoutCellsIsStillAwaited) {
  PluggedIn plugged(usb_);
  plugged.come_back_with({0b1111});
  expect_named(error_of(Fault::system,
                        [&] {
                          // The first next() may time out while the board comes back.
                          plugged.sensor->next(patience);
                          plugged.sensor->next(patience);
                        }),
               {"4 elements instead of 5"});
  plugged.expect_start_with_cells();
  plugged.come_back_with({0});
  EXPECT_FALSE(plugged.sensor->next(300ms));
  EXPECT_TRUE(plugged.sensor->gone());
  expect_named(plugged.refusal(Fault::system), {"no cell answers"});
  plugged.expect_start_with_cells();
}

TEST_F(Restart, FindsABoardThatWasPluggedInAgain) {
  for (const char* serial : {"1", ""}) {
    PluggedIn plugged(usb_, serial);
    int recalibrations = 0;
    // The last time at the address before, as after 127 other devices.
    for (const int by : {1, 1, 0}) {
      plugged.sensor->stop();
      plugged.unplug();
      plugged.board.recalibrate();
      plugged.board.usb().plug(by);
      plugged.expect_start(100, ++recalibrations);
    }
  }
}

TEST_F(Restart, FailsWhileTheBoardIsAwayAndWorksOnceItIsBack) {
  PluggedIn plugged(usb_);
  enum class Away { before_the_first_start, while_it_streams, after_it_was_noticed };
  for (const Away away :
       {Away::before_the_first_start, Away::while_it_streams, Away::after_it_was_noticed}) {
    SCOPED_TRACE(static_cast<int>(away));
    away == Away::after_it_was_noticed ? plugged.unplug_and_notice() : plugged.unplug();
    plugged.sensor->stop();
    for (int i = 0; i < 2; ++i) {
      expect_named(plugged.refusal(Fault::input), {"'takktile:1'", "not plugged in"});
      EXPECT_EQ(plugged.sensor->next(0ms), std::nullopt);
      plugged.sensor->stop();
    }
    plugged.board.usb().plug();
    plugged.expect_start(100);
  }
  plugged.unplug();
  plugged.sensor.reset();
  EXPECT_FALSE(plugged.board.usb().seen().claimed);
}

TEST_F(Restart, FindsABoardAtAnotherPortByItsSerialNumberOnlyAndNoOther) {
  for (const auto& [serial, other_serial, other_port, found] :
       {std::tuple{"1", "1", 5, true}, {"", "", 5, false}, {"1", "2", 2, false}}) {
    PluggedIn plugged(usb_, serial);
    plugged.unplug();
    FakeTakktile other(usb_, other_serial, {0b11111}, Layout::bits, other_port);
    if (found) {
      plugged.sensor->start();
      EXPECT_TRUE(other.streaming());
    } else {
      expect_named(plugged.refusal(Fault::input), {": not plugged in"});
      EXPECT_TRUE(other.usb().seen().requests.empty());
    }
    plugged.sensor->stop();
  }
}

TEST_F(Restart, TriesABoardThatDoesNotAnswerOnceMore) {
  PluggedIn plugged(usb_);
  plugged.board.usb().behave(Manner::refuses);
  expect_named(plugged.refusal(Fault::system), {"refuses the request"});
  EXPECT_EQ(plugged.board.usb().seen().urbs_under_way, 0U);
  plugged.board.usb().behave(Manner::answers);
  plugged.expect_start(100);
}

}  // namespace palpate::hotplug_test
