#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fake_takktile.hpp"
#include "palpate/driver.hpp"
#include "palpate/error.hpp"
#include "streamed.hpp"

namespace palpate::hotplug_test {

using testing::HasSubstr;

class Hotplug : public testing::Test {
 protected:
  void expect_frame(Sensor& sensor, FakeTakktile& board, int raw, int recalibrations = 0) {
    ASSERT_TRUE(becomes_true([&] { return board.streaming() && board.usb().claimed(0); }));
    board.send_frame(raw);
    const std::vector<Frame> frames = take(sensor, 1);
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_NEAR(frames[0].values.at(0), expected_kpa(raw, 512, recalibrations), kpa_tolerance);
  }

  FakeUsb usb_;
};

TEST_F(Hotplug, BoardsAppearAndDisappearInTheList) {
  EXPECT_TRUE(list_boards().empty());
  {
    FakeTakktile board(usb_, "1", {0b1});
    EXPECT_EQ(list_boards().size(), 1U);
    board.usb().unplug();
    EXPECT_TRUE(list_boards().empty());
    board.usb().plug();
    EXPECT_EQ(list_boards().at(0).address, 3);
  }
  EXPECT_TRUE(list_boards().empty());
}

TEST_F(Hotplug, AStreamOutlivesUnpluggingAndReadsTheCalibrationAgain) {
  FakeTakktile board(usb_, "0012", {0b11111});
  const auto sensor = open_board("takktile:0012");
  sensor->start();
  for (int round = 1; round <= 3; ++round) {
    expect_frame(*sensor, board, 100 + round, round - 1);
    board.send_frame(500);  // may be in transfer when the plug is pulled
    board.usb().unplug();
    ASSERT_TRUE(becomes_true([&] { return sensor->gone(); }));
    while (sensor->next(std::chrono::milliseconds(10))) {
    }
    EXPECT_EQ(sensor->next(std::chrono::milliseconds(10)), std::nullopt) << "it only times out";
    board.recalibrate();
    board.usb().plug();
    ASSERT_TRUE(becomes_true([&] { return !sensor->gone(); }));
    EXPECT_EQ(sensor->counters().reconnects, static_cast<std::uint64_t>(round));
  }
  expect_frame(*sensor, board, 300, 3);
}

TEST_F(Hotplug, AnotherBoardDoesNotTakeThePlace) {
  FakeTakktile board(usb_, "1", {0b11111});
  const auto sensor = open_board("takktile");
  sensor->start();
  expect_frame(*sensor, board, 100);
  board.usb().unplug();
  ASSERT_TRUE(becomes_true([&] { return sensor->gone(); }));
  FakeTakktile other(usb_, "2", {0b11111}, FakeTakktile::Layout::bits, 9);
  // Long enough for the sensor to look several times; the arrival makes it look at once.
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_TRUE(sensor->gone());
  EXPECT_TRUE(other.usb().requests().empty());
  board.usb().plug();
  ASSERT_TRUE(becomes_true([&] { return !sensor->gone(); }));
  expect_frame(*sensor, board, 101);
}

TEST_F(Hotplug, ABoardWithoutSerialIsKnownByItsPort) {
  FakeTakktile board(usb_, "", {0b11111});
  EXPECT_EQ(list_boards().at(0).name, "takktile:1-2");
  const auto sensor = open_board("takktile:1-2");
  sensor->start();
  expect_frame(*sensor, board, 100);
  board.usb().unplug();
  ASSERT_TRUE(becomes_true([&] { return sensor->gone(); }));
  board.usb().plug();
  ASSERT_TRUE(becomes_true([&] { return !sensor->gone(); }));
  expect_frame(*sensor, board, 101);
}

TEST_F(Hotplug, BoardsThatShareASerialNumberAreKnownByTheirPorts) {
  FakeTakktile board(usb_, "0001", {0b11111});
  FakeTakktile copy(usb_, "0001", {0b11111}, FakeTakktile::Layout::bits, 3);
  EXPECT_EQ(list_boards().at(0).name, "takktile:1-2");
  EXPECT_EQ(list_boards().at(1).name, "takktile:1-3");
  try {
    open_board("takktile:0001");
    ADD_FAILURE() << "it could be either";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("name one: takktile:1-2, takktile:1-3"));
  }
  const auto sensor = open_board("takktile:1-3");
  sensor->start();
  expect_frame(*sensor, copy, 100);
  copy.usb().unplug();
  ASSERT_TRUE(becomes_true([&] { return sensor->gone(); }));
  copy.usb().plug();
  ASSERT_TRUE(becomes_true([&] { return !sensor->gone(); }));
  expect_frame(*sensor, copy, 101);
  EXPECT_FALSE(board.usb().claimed(0));
}

TEST_F(Hotplug, OtherCellsThanBeforeAreRefused) {
  FakeTakktile board(usb_, "1", {0b11111});
  const auto sensor = open_board("takktile");
  sensor->start();
  expect_frame(*sensor, board, 100);
  board.usb().unplug();
  ASSERT_TRUE(becomes_true([&] { return sensor->gone(); }));
  board.replace_cells({0b1111});
  board.usb().plug();
  try {
    // The first next() may time out while the board comes back.
    for (int i = 0; i < 2; ++i) {
      sensor->next(patience);
    }
    ADD_FAILURE() << "the board was taken for the old one";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), palpate::Fault::system);
    EXPECT_THAT(error.what(), HasSubstr("4 elements instead of 5"));
  }
}

TEST_F(Hotplug, StopsAndGoesWhileTheBoardIsAway) {
  FakeTakktile board(usb_, "1", {0b11111});
  auto sensor = open_board("takktile");
  sensor->start();
  expect_frame(*sensor, board, 100);
  board.usb().unplug();
  ASSERT_TRUE(becomes_true([&] { return sensor->gone(); }));
  sensor->stop();
  EXPECT_THROW(sensor->start(), Error);
  board.usb().plug();
  sensor->start();
  EXPECT_FALSE(sensor->gone());
  expect_frame(*sensor, board, 101);
  board.usb().unplug();
  sensor.reset();
}

TEST_F(Hotplug, TwoBoardsStreamAtOnce) {
  FakeTakktile left(usb_, "L", {0b11111});
  FakeTakktile right(usb_, "R", {0b111}, FakeTakktile::Layout::bits, 3);
  const auto l = open_board("takktile:L");
  const auto r = open_board("takktile:R");
  EXPECT_EQ(l->description().elements_mm.size(), 5U);
  EXPECT_EQ(r->description().elements_mm.size(), 3U);
  l->start();
  r->start();
  constexpr int count = 40;
  std::thread firmware([&] {
    at_rate(200.0, count, [&](int i) {
      left.send_frame(i);
      right.send_frame(500 + i);
    });
  });
  const std::vector<Frame> from_left = take(*l, count);
  const std::vector<Frame> from_right = take(*r, count);
  firmware.join();
  ASSERT_EQ(from_left.size(), static_cast<std::size_t>(count));
  ASSERT_EQ(from_right.size(), static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    EXPECT_NEAR(from_left[i].values.at(4), expected_kpa(i), kpa_tolerance);
    EXPECT_NEAR(from_right[i].values.at(2), expected_kpa(500 + i), kpa_tolerance);
  }
  // One board is unplugged; the other board's stream continues.
  right.usb().unplug();
  ASSERT_TRUE(becomes_true([&] { return r->gone(); }));
  expect_frame(*l, left, 700);
  EXPECT_FALSE(l->gone());
}

}  // namespace palpate::hotplug_test
