#include <gtest/gtest.h>

#include "fake_takktile.hpp"
#include "palpate/driver.hpp"
#include "palpate/error.hpp"
#include "streamed.hpp"

namespace palpate::takktile_test {

class Takktile : public testing::Test {
 protected:
  FakeUsb usb_;
};

TEST_F(Takktile, IsListedWithElementsAndSerial) {
  FakeTakktile board(usb_, "0012", {0b11111, 0b10101});
  const std::vector<BoardInfo> boards = list_boards();
  ASSERT_EQ(boards.size(), 1U) << "the hub is none";
  EXPECT_EQ(boards[0].name, "takktile:0012");
  EXPECT_EQ(boards[0].bus, 1);
  EXPECT_EQ(boards[0].address, 2);
  EXPECT_EQ(boards[0].vendor, 0x59e3);
  EXPECT_EQ(boards[0].product, 0x74c7);
  EXPECT_EQ(boards[0].manufacturer, "TakkTile LLC");
  EXPECT_EQ(boards[0].serial, "0012");
  EXPECT_EQ(boards[0].elements, 8U);
  EXPECT_EQ(boards[0].pressure_unit, "kPa");
  EXPECT_TRUE(boards[0].usable) << boards[0].reason;
  EXPECT_FALSE(board.usb().claimed(0)) << "looking disturbs nobody";
}

TEST_F(Takktile, IsAskedWhatThePublishedFirmwareAnswers) {
  FakeTakktile board(usb_, "1", {0b00001, 0, 0b10000});
  {
    const auto sensor = open_board("takktile");
    sensor->start();
    sensor->stop();
  }
  std::vector<std::vector<int>> requests;
  for (const FakeUsbDevice::Setup& setup : board.usb().requests()) {
    EXPECT_EQ(setup.type, 0xc0) << "a vendor's request to the device, towards the host";
    requests.push_back({setup.request, setup.value, setup.index});
  }
  EXPECT_EQ(requests, (std::vector<std::vector<int>>{{0x5c, 0, 0},       // which cells are alive
                                                     {0x6c, 0, 0},       // calibration: column, row
                                                     {0x6c, 4, 2},       //
                                                     {0xc7, 120, 0xff},  // period, start
                                                     {0xc7, 0, 0}}));
}

TEST_F(Takktile, BothFirmwaresGiveTheSameElements) {
  std::vector<std::vector<glm::dvec2>> elements;
  for (const auto layout : {FakeTakktile::Layout::bits, FakeTakktile::Layout::bytes}) {
    FakeTakktile board(usb_, "1", {0b00111, 0b11000}, layout);
    const auto sensor = open_board("takktile");
    elements.push_back(sensor->description().elements_mm);
    EXPECT_EQ(elements.back().size(), 5U);
    EXPECT_EQ(sensor->description().serial, "1");
  }
  EXPECT_EQ(elements[0], elements[1]);
}

TEST_F(Takktile, FramesCarryCalibratedPressureInOrder) {
  FakeTakktile board(usb_, "1", {0b11111});
  const auto sensor = open_board("takktile");
  EXPECT_TRUE(board.usb().claimed(0));
  EXPECT_FALSE(board.streaming());
  sensor->start();
  EXPECT_TRUE(board.streaming());
  for (int i = 0; i < 10; ++i) {
    board.send_frame(400 + i);
  }
  const std::vector<Frame> frames = take(*sensor, 10);
  ASSERT_EQ(frames.size(), 10U);
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(frames[i].values.size(), 5U);
    for (const double value : frames[i].values) {
      EXPECT_NEAR(value, expected_kpa(400 + i), kpa_tolerance);
    }
    EXPECT_EQ(frames[i].lost_before, 0U);
    EXPECT_GT(frames[i].host_time_s, 1.7e9) << "seconds since the Unix epoch";
    EXPECT_GE(frames[i].host_time_s, frames[i > 0 ? i - 1 : 0].host_time_s);
  }
  sensor->stop();
  EXPECT_FALSE(board.streaming());
  EXPECT_EQ(board.usb().urbs_under_way(), 0) << "every transfer was taken back";
  EXPECT_TRUE(board.usb().claimed(0));
}

TEST_F(Takktile, KeepsUpWith200And1000FramesPerSecond) {
  FakeTakktile board(usb_, "1",
                     {0b11111, 0b11111, 0b11111, 0b11111, 0b11111, 0b11111, 0b11111, 0b11111});
  const auto sensor = open_board("takktile");
  for (const double rate_hz : {200.0, 1000.0}) {
    sensor->start();
    const int count = static_cast<int>(rate_hz / 2.0);
    std::thread firmware(
        [&] { at_rate(rate_hz, count, [&](int i) { board.send_frame(i % 1000); }); });
    const std::vector<Frame> frames = take(*sensor, static_cast<std::size_t>(count));
    firmware.join();
    ASSERT_EQ(frames.size(), static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
      ASSERT_NEAR(frames[i].values.at(39), expected_kpa(i % 1000), kpa_tolerance) << i;
    }
    sensor->stop();
    EXPECT_EQ(sensor->counters().frames, static_cast<std::uint64_t>(count));
    EXPECT_EQ(sensor->counters().lost, 0U);
    EXPECT_EQ(sensor->counters().garbage_bytes, 0U);
  }
}

TEST_F(Takktile, FramesOfWholePacketsEndWithAnEmptyOne) {
  for (const std::vector<std::uint8_t>& rows :
       {std::vector<std::uint8_t>{0b11111, 0b11111, 0b11111, 0b1},  // 64 B
        std::vector<std::uint8_t>{0b11111, 0b11111, 0b11111, 0b11111, 0b11111, 0b11111, 0b11}}) {
    FakeTakktile board(usb_, "1", rows);
    ASSERT_EQ(board.cells() % 16, 0);
    const auto sensor = open_board("takktile");
    sensor->start();
    for (int i = 0; i < 5; ++i) {
      board.send_frame(100 + i);
    }
    const std::vector<Frame> frames = take(*sensor, 5);
    ASSERT_EQ(frames.size(), 5U);
    EXPECT_EQ(static_cast<int>(frames[4].values.size()), board.cells());
    EXPECT_NEAR(frames[4].values[0], expected_kpa(104), kpa_tolerance);
  }
}

}  // namespace palpate::takktile_test
