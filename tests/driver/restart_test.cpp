// Tests that start() finds a board again that was unplugged and plugged in after the sensor was
// opened or stopped.
#include <future>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "driver/transfer_ring.hpp"
#include "fake_takktile.hpp"
#include "palpate/driver.hpp"
#include "palpate/error.hpp"
#include "streamed.hpp"

namespace palpate::restart_test {

using testing::AllOf;
using testing::HasSubstr;

/// The message of start()'s error; "" if it succeeds.
std::string refusal(Sensor& sensor) {
  try {
    sensor.start();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

class Restart : public testing::Test {
 protected:
  static void expect_frame(Sensor& sensor, FakeTakktile& board, int raw, int recalibrations = 0) {
    EXPECT_TRUE(board.streaming());
    EXPECT_FALSE(sensor.gone());
    board.send_frame(raw);
    const std::vector<Frame> frames = take(sensor, 1);
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_NEAR(frames[0].values.at(0), expected_kpa(raw, 512, recalibrations), kpa_tolerance);
    EXPECT_EQ(sensor.counters().frames, 1U);
    EXPECT_EQ(sensor.counters().reconnects, 0U) << "since start()";
  }

  FakeUsb usb_;
};

TEST_F(Restart, FindsABoardThatWasPluggedInAgainBeforeTheFirstStart) {
  for (const char* serial : {"1", ""}) {
    FakeTakktile board(usb_, serial, {0b11111});
    const auto sensor = open_board("takktile");
    board.usb().unplug();
    board.recalibrate();
    board.usb().plug();
    sensor->start();
    expect_frame(*sensor, board, 100, 1);
  }
}

TEST_F(Restart, FindsABoardThatWasPluggedInAgainWhileStopped) {
  FakeTakktile board(usb_, "1", {0b11111});
  const auto sensor = open_board("takktile");
  sensor->start();
  expect_frame(*sensor, board, 100);
  // The last time at the first address, as after 127 other devices.
  int recalibrations = 0;
  for (const int by : {1, 1, 0}) {
    sensor->stop();
    board.usb().unplug();
    board.recalibrate();
    board.usb().plug(by);
    sensor->start();
    expect_frame(*sensor, board, 101, ++recalibrations);
  }
}

TEST_F(Restart, SaysThatTheBoardIsNotThereUntilItIs) {
  FakeTakktile board(usb_, "1", {0b11111});
  const auto sensor = open_board("takktile");
  const auto expect_absent = [&] {
    for (int i = 0; i < 2; ++i) {
      EXPECT_THAT(refusal(*sensor), AllOf(HasSubstr("'takktile:1'"), HasSubstr("not plugged in")));
      EXPECT_EQ(sensor->next(std::chrono::milliseconds(0)), std::nullopt);
      sensor->stop();
    }
  };
  board.usb().unplug();
  expect_absent();
  board.usb().plug();
  sensor->start();
  expect_frame(*sensor, board, 100);
  sensor->stop();
  board.usb().unplug();
  expect_absent();
  board.usb().plug();
  sensor->start();
  expect_frame(*sensor, board, 101);
}

TEST_F(Restart, FindsABoardAtAnotherPortByItsSerialNumberOnly) {
  for (const char* serial : {"1", ""}) {
    FakeTakktile board(usb_, serial, {0b11111});
    const auto sensor = open_board("takktile");
    board.usb().unplug();
    FakeTakktile elsewhere(usb_, serial, {0b11111}, FakeTakktile::Layout::bits, 5);
    if (*serial != '\0') {
      sensor->start();
      expect_frame(*sensor, elsewhere, 100);
    } else {
      EXPECT_THAT(refusal(*sensor), HasSubstr("'takktile:1-2': not plugged in"));
      EXPECT_TRUE(elsewhere.usb().requests().empty());
    }
    sensor->stop();
  }
}

TEST_F(Restart, TakesNoOtherBoardInItsPlace) {
  FakeTakktile board(usb_, "1", {0b11111});
  const auto sensor = open_board("takktile");
  board.usb().unplug();
  FakeTakktile other(usb_, "2", {0b11111});  // at the same port and address
  EXPECT_THAT(refusal(*sensor), HasSubstr("'takktile:1': not plugged in"));
  EXPECT_TRUE(other.usb().requests().empty());
}

TEST_F(Restart, RefusesOtherCellsThanBefore) {
  FakeTakktile board(usb_, "1", {0b11111});
  const auto sensor = open_board("takktile");
  board.usb().unplug();
  board.replace_cells({0b1111});
  board.usb().plug();
  EXPECT_THAT(refusal(*sensor), HasSubstr("4 elements instead of 5"));
  EXPECT_FALSE(board.usb().claimed(0)) << "given back";
  board.replace_cells({0b11111});
  sensor->start();
  expect_frame(*sensor, board, 100);
}

TEST_F(Restart, FindsABoardThatIsMovedToAnotherPortWhileItStarts) {
  FakeTakktile board(usb_, "1", {0b11111});
  const auto sensor = open_board("takktile");
  const std::size_t asked = board.usb().requests().size();
  board.usb().ignore_requests(true);
  // The board appears at the new port before it leaves the old port: start() always finds it.
  FakeTakktile elsewhere(usb_, "1", {0b11111}, FakeTakktile::Layout::bits, 5);
  auto started = std::async(std::launch::async, [&] { return refusal(*sensor); });
  ASSERT_TRUE(becomes_true([&] { return board.usb().requests().size() > asked; }));
  board.usb().unplug();
  // A transfer reports the unplugging before udev does: for a moment both ports are listed.
  if (const std::string message = started.get(); !message.empty()) {
    EXPECT_THAT(message, HasSubstr("are plugged in"));
    EXPECT_EQ(refusal(*sensor), "");
  }
  expect_frame(*sensor, elsewhere, 100);
  sensor->stop();
}

TEST_F(Restart, TriesABoardThatDoesNotAnswerOnceMore) {
  FakeTakktile board(usb_, "1", {0b11111});
  const auto sensor = open_board("takktile");
  board.usb().refuse_requests(true);
  EXPECT_THAT(refusal(*sensor), HasSubstr("refuses the request"));
  EXPECT_EQ(board.usb().urbs_under_way(), 0);
  board.usb().refuse_requests(false);
  sensor->start();
  expect_frame(*sensor, board, 100);
}

TEST_F(Restart, BeginsAnewWhereItIsStartedTwice) {
  FakeTakktile board(usb_, "1", {0b11111});
  const auto sensor = open_board("takktile");
  sensor->start();
  board.send_frame(1);
  ASSERT_TRUE(becomes_true([&] { return sensor->counters().frames == 1; }));
  sensor->start();
  EXPECT_EQ(sensor->counters().frames, 0U);
  expect_frame(*sensor, board, 100);
  EXPECT_EQ(board.usb().urbs_under_way(), static_cast<int>(TransferRing::transfers));
}

TEST_F(Restart, StopsABoardThatIsGone) {
  FakeTakktile board(usb_, "1", {0b11111});
  auto sensor = open_board("takktile");
  sensor->stop();
  sensor->start();
  board.usb().unplug();
  sensor->stop();
  sensor->stop();
  EXPECT_FALSE(refusal(*sensor).empty());
  board.usb().plug();
  sensor->start();
  expect_frame(*sensor, board, 100);
  board.usb().unplug();
  ASSERT_TRUE(becomes_true([&] { return sensor->gone(); }));
  sensor->stop();
  sensor.reset();
  EXPECT_FALSE(board.usb().claimed(0));
}

}  // namespace palpate::restart_test
