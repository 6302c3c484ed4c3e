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
    return expect_frames(*sensor_, 20, raw).at(0);
  }

  FakeUsb usb_;
  FakeTakktile board_{usb_, "1", {0b11111, 0b11111, 0b11111, 0b11111}};
  std::unique_ptr<Sensor> sensor_ = open_board("takktile");
};

struct FaultCase {
  const char* name;
  Fault fault;
  int times;
  std::uint64_t lost;  ///< frames
  std::uint64_t reconnects = 0;
};

TEST_F(TransferFault, CostsAFrameATransferAndAsManyInARowAsTransfersOpenTheBoardAnew) {
  const FaultCase cases[] = {
      {.name = "a stall, which is cleared", .fault = Fault::stall, .times = 3, .lost = 0},
      {.name = "an overflow", .fault = Fault::overflow, .times = 1, .lost = 1},
      {.name = "fewer than transfers",
       .fault = Fault::protocol,
       .times = ring - 1,
       .lost = ring - 1},
      {.name = "all", .fault = Fault::protocol, .times = ring, .lost = ring, .reconnects = 1}};
  for (const FaultCase& row : cases) {
    SCOPED_TRACE(row.name);
    sensor_->start();  // anew: what was lost before is not told
    EXPECT_EQ(frame_after(100).lost_before, 0U);
    const FakeUsbDevice::Seen before = board_.usb().seen();
    board_.usb().send_fault(row.fault, row.times);
    ASSERT_TRUE(becomes_true([&] { return sensor_->counters().reconnects == row.reconnects; }));
    EXPECT_EQ(frame_after(101).lost_before, row.lost);
    EXPECT_EQ(frame_after(102).lost_before, 0U);
    EXPECT_FALSE(sensor_->gone());
    sensor_->stop();  // what is lost is counted after its frame is there
    const SensorCounters counters = sensor_->counters();
    EXPECT_EQ(counters.frames, 3U);
    EXPECT_EQ(counters.lost, row.lost);
    EXPECT_EQ(counters.reconnects, row.reconnects);
    EXPECT_EQ(counters.stalls, row.fault == Fault::stall ? 3U : 0U);
    EXPECT_EQ(counters.overflows, row.fault == Fault::overflow ? 1U : 0U);
    const FakeUsbDevice::Seen after = board_.usb().seen();
    EXPECT_EQ(after.halts_cleared - before.halts_cleared, row.fault == Fault::stall ? 3 : 0);
    EXPECT_EQ(after.requests.size() > before.requests.size() + 10, row.reconnects > 0)
        << "the calibration is read again";
  }
  // Nor is it told where the loss was the last that came.
  sensor_->start();
  board_.usb().send_fault(Fault::overflow);
  ASSERT_TRUE(becomes_true([&] { return sensor_->counters().lost == 1; }));
  sensor_->start();
  EXPECT_EQ(frame_after(103).lost_before, 0U);
  EXPECT_EQ(sensor_->counters().lost, 0U);
}

TEST_F(TransferFault, AnEndpointThatStallsForEverDoesNotHangTheProgram) {
  board_.usb().send_fault(Fault::stall, 10 * ring);
  ASSERT_TRUE(becomes_true([&] { return sensor_->counters().reconnects >= 2; }));
  sensor_->stop();
  EXPECT_GE(sensor_->counters().stalls, 2U * ring);
  EXPECT_EQ(board_.usb().seen().urbs_under_way, 0);
}

TEST_F(TransferFault, ABoardThatPausesWithinAFrameIsWaitedFor) {
  board_.usb().send(Bytes(64, 0x40), /*end=*/false);
  ASSERT_TRUE(becomes_true([&] { return sensor_->counters().timeouts >= 1; }));
  EXPECT_FALSE(sensor_->gone());
  board_.usb().send(Bytes(16, 0x40));
  const std::vector<Frame> frames = take(*sensor_, 1);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_NEAR(frames[0].values.at(19), expected_kpa(0x101, 0x101), kpa_tolerance);
  EXPECT_EQ(frames[0].lost_before, 0U);
  EXPECT_EQ(sensor_->counters().garbage_bytes, 0U);
  EXPECT_EQ(sensor_->counters().reconnects, 0U);
}

TEST_F(TransferFault, FramesOfAnotherLengthAreCountedAndPassedOver) {
  board_.usb().send({});  // is no frame
  EXPECT_EQ(frame_after(100).lost_before, 0U);
  // A cell is missing; two frames without the end of the first; more than two.
  for (const std::size_t bytes : {76, 160, 320}) {
    board_.usb().send(Bytes(bytes));
  }
  EXPECT_EQ(frame_after(101).lost_before, 3U);
  sensor_->stop();
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

}  // namespace palpate::transfer_fault_test
