#include "driver/transfer_ring.hpp"
#include "fake_takktile.hpp"
#include "palpate/driver.hpp"
#include "streamed.hpp"

namespace palpate::transfer_fault_test {

using Fault = FakeUsbDevice::Fault;

constexpr int ring = static_cast<int>(TransferRing::transfers);

/// A board that streams frames of 80 bytes.
class TransferFault : public testing::Test {
 protected:
  TransferFault() { sensor_->start(); }

  /// Sends a frame and expects that it arrives.
  Frame frame_after(int raw) {
    board_.send_frame(raw);
    const std::vector<Frame> frames = take(*sensor_, 1);
    EXPECT_EQ(frames.size(), 1U);
    EXPECT_NEAR(frames.at(0).values.at(19), expected_kpa(raw), kpa_tolerance);
    return frames.at(0);
  }

  FakeUsb usb_;
  FakeTakktile board_{usb_, "1", {0b11111, 0b11111, 0b11111, 0b11111}};
  std::unique_ptr<Sensor> sensor_ = open_board("takktile");
};

TEST_F(TransferFault, AStallIsClearedAndTheStreamGoesOn) {
  frame_after(100);
  for (int i = 1; i <= 3; ++i) {
    board_.usb().send_fault(Fault::stall);
    frame_after(100 + i);
    EXPECT_EQ(board_.usb().seen().halts_cleared, i);
  }
  sensor_->stop();
  EXPECT_EQ(sensor_->counters().stalls, 3U);
  EXPECT_EQ(sensor_->counters().frames, 4U);
  EXPECT_EQ(sensor_->counters().reconnects, 0U);
}

TEST_F(TransferFault, AnOverflowCostsOneFrameWhichIsNotToldAfterANewStart) {
  frame_after(100);
  board_.usb().send_fault(Fault::overflow);
  EXPECT_EQ(frame_after(101).lost_before, 1U);
  EXPECT_EQ(frame_after(102).lost_before, 0U);
  board_.usb().send_fault(Fault::overflow);
  ASSERT_TRUE(becomes_true([&] { return sensor_->counters().lost == 2; }));
  EXPECT_EQ(sensor_->counters().overflows, 2U);
  sensor_->start();
  EXPECT_EQ(frame_after(103).lost_before, 0U);
  EXPECT_EQ(sensor_->counters().lost, 0U);
  EXPECT_EQ(sensor_->counters().overflows, 0U);
}

TEST_F(TransferFault, FewerErrorsInARowThanTransfersAreSurvived) {
  for (int i = 0; i < 3; ++i) {
    board_.usb().send_fault(Fault::protocol, ring - 1);
    EXPECT_EQ(frame_after(100 + i).lost_before, static_cast<std::uint64_t>(ring - 1));
  }
  EXPECT_EQ(sensor_->counters().reconnects, 0U);
  EXPECT_FALSE(sensor_->gone());
}

TEST_F(TransferFault, AsManyErrorsInARowAsTransfersOpenTheBoardAnew) {
  frame_after(100);
  const std::size_t requests = board_.usb().seen().requests.size();
  board_.usb().send_fault(Fault::protocol, ring);
  ASSERT_TRUE(becomes_true([&] { return sensor_->counters().reconnects == 1; }));
  EXPECT_GT(board_.usb().seen().requests.size(), requests + 10) << "calibration is read again";
  EXPECT_EQ(frame_after(101).lost_before, static_cast<std::uint64_t>(ring));
}

TEST_F(TransferFault, AnEndpointThatStallsForEverDoesNotHangTheProgram) {
  board_.usb().send_fault(Fault::stall, 10 * ring);
  ASSERT_TRUE(becomes_true([&] { return sensor_->counters().reconnects >= 2; }));
  sensor_->stop();
  EXPECT_GE(sensor_->counters().stalls, 2U * ring);
  EXPECT_EQ(board_.usb().seen().urbs_under_way, 0);
}

TEST_F(TransferFault, ASilentBoardTimesOutAndIsWaitedFor) {
  frame_after(100);
  ASSERT_TRUE(becomes_true([&] { return sensor_->counters().timeouts >= 1; }));
  EXPECT_FALSE(sensor_->gone());
  EXPECT_EQ(frame_after(101).lost_before, 0U);
  EXPECT_EQ(sensor_->counters().reconnects, 0U);
}

TEST_F(TransferFault, APauseWithinAFrameCostsNothing) {
  board_.usb().send(Bytes(64, 0x40), /*end=*/false);
  ASSERT_TRUE(becomes_true([&] { return sensor_->counters().timeouts >= 1; }));
  board_.usb().send(Bytes(16, 0x40));
  const std::vector<Frame> frames = take(*sensor_, 1);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_NEAR(frames[0].values.at(19), expected_kpa(0x101, 0x101), kpa_tolerance);
  EXPECT_EQ(sensor_->counters().garbage_bytes, 0U);
}

TEST_F(TransferFault, FramesOfAnotherLengthAreCountedAndPassedOver) {
  board_.usb().send({});  // is no frame
  EXPECT_EQ(frame_after(100).lost_before, 0U);
  // A cell is missing; two frames without the end of the first; more than two.
  for (const std::size_t bytes : {76, 160, 320}) {
    board_.usb().send(Bytes(bytes));
  }
  EXPECT_EQ(frame_after(101).lost_before, 3U);
  EXPECT_EQ(sensor_->counters().lost, 3U);
  EXPECT_EQ(sensor_->counters().garbage_bytes, 76U + 160U + 320U);
}

TEST_F(TransferFault, TheOldestFramesGoWhereNobodyTakesThem) {
  constexpr int sent = 1100;
  constexpr int kept = 1024;
  for (int i = 0; i < sent; ++i) {
    board_.send_frame(i % 1000);
  }
  ASSERT_TRUE(becomes_true([&] {
    const SensorCounters counters = sensor_->counters();
    return counters.frames + counters.lost == sent;
  }));
  EXPECT_EQ(sensor_->counters().lost, static_cast<std::uint64_t>(sent - kept));
  const std::vector<Frame> frames = take(*sensor_, kept);
  ASSERT_EQ(frames.size(), static_cast<std::size_t>(kept));
  EXPECT_EQ(frames[0].lost_before, static_cast<std::uint64_t>(sent - kept));
  EXPECT_NEAR(frames[0].values[0], expected_kpa(sent - kept), kpa_tolerance);
  EXPECT_EQ(frames[1].lost_before, 0U);
  EXPECT_NEAR(frames.back().values[0], expected_kpa((sent - 1) % 1000), kpa_tolerance);
}

TEST_F(TransferFault, StopsAndStartsAnew) {
  frame_after(100);
  for (int i = 0; i < 3; ++i) {
    sensor_->stop();
    EXPECT_FALSE(board_.streaming());
    EXPECT_EQ(board_.usb().seen().urbs_under_way, 0);
    EXPECT_EQ(sensor_->next(std::chrono::milliseconds(0)), std::nullopt);
    sensor_->start();
    EXPECT_TRUE(board_.streaming());
    EXPECT_EQ(sensor_->counters().frames, 0U);
    frame_after(200 + i);
  }
}

}  // namespace palpate::transfer_fault_test
