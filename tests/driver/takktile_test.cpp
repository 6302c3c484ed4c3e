#include "driver/usb_device.hpp"
#include "fake_takktile.hpp"
#include "palpate/driver.hpp"
#include "streamed.hpp"

namespace palpate::takktile_test {

class Takktile : public testing::Test {
 protected:
  FakeUsb usb_;
};

TEST_F(Takktile, IsAskedWhatThePublishedFirmwareAndItsForkAnswer) {
  for (const auto layout : {FakeTakktile::Layout::bits, FakeTakktile::Layout::bytes}) {
    FakeTakktile board(usb_, "1", {0b00001, 0, 0b10000}, layout);
    list_boards();
    EXPECT_FALSE(board.usb().seen().claimed) << "looking disturbs nobody";
    const std::size_t looked = board.usb().seen().requests.size();
    const auto sensor = open_board("takktile");
    const SensorDescription& description = sensor->description();
    EXPECT_EQ(description.serial, "1");
    ASSERT_EQ(description.elements_mm.size(), 2U);
    EXPECT_EQ(description.elements_mm[1] - description.elements_mm[0],
              takktile::default_pitch_mm * glm::dvec2(4, 2));
    sensor->start();
    sensor->stop();
    std::vector<std::vector<int>> requests;
    const std::vector<FakeUsbDevice::Setup> all = board.usb().seen().requests;
    for (const FakeUsbDevice::Setup& setup : std::span(all).subspan(looked)) {
      EXPECT_EQ(setup.type, 0xc0) << "a vendor's request to the device, towards the host";
      requests.push_back({setup.request, setup.value, setup.index});
    }
    EXPECT_EQ(requests, (std::vector<std::vector<int>>{{0x5c, 0, 0},  // which cells are alive
                                                       {0x6c, 0, 0},  // calibration: column, row
                                                       {0x6c, 4, 2},
                                                       {0xc7, 120, 0xff},  // period, start
                                                       {0xc7, 0, 0}}));
  }
}

TEST_F(Takktile, FramesCarryCalibratedPressureInOrder) {
  for (const std::vector<std::uint8_t>& rows :
       {std::vector<std::uint8_t>(8, 0b11111),
        // Frames of 64 and 128 bytes end with an empty packet.
        std::vector<std::uint8_t>{0b11111, 0b11111, 0b11111, 0b1},
        std::vector<std::uint8_t>{0b11111, 0b11111, 0b11111, 0b11111, 0b11111, 0b11111, 0b11}}) {
    FakeTakktile board(usb_, "1", rows);
    SCOPED_TRACE(board.cells());
    const auto sensor = open_board("takktile");
    EXPECT_TRUE(board.usb().seen().claimed);
    EXPECT_FALSE(board.streaming());
    sensor->start();
    EXPECT_TRUE(board.streaming());
    constexpr int count = 500;
    for (int i = 0; i < count; ++i) {
      board.send_frame(i);
    }
    double before_s = 1.7e9;  // since the Unix epoch
    for (const Frame& frame : expect_frames(*sensor, board.cells(), 0, count)) {
      ASSERT_EQ(frame.lost_before, 0U);
      ASSERT_GE(frame.host_time_s, std::exchange(before_s, frame.host_time_s));
    }
    sensor->stop();
    EXPECT_FALSE(board.streaming());
    EXPECT_EQ(board.usb().seen().urbs_under_way, 0U) << "every transfer was taken back";
    EXPECT_TRUE(board.usb().seen().claimed);
    EXPECT_EQ(sensor->counters().frames, std::uint64_t{count});
    EXPECT_EQ(sensor->counters().lost, 0U);
    EXPECT_EQ(sensor->counters().garbage_bytes, 0U);
  }
}

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
      {.name = "all but one", .fault = Fault::protocol, .times = ring - 1, .lost = ring - 1},
      {.name = "all", .fault = Fault::protocol, .times = ring, .lost = ring, .reconnects = 1}};
  for (const FaultCase& row : cases) {
    SCOPED_TRACE(row.name);
    sensor_->start();  // anew: what was lost before is not told
    EXPECT_EQ(frame_after(100).lost_before, 0U);
    EXPECT_EQ(board_.usb().seen().urbs_under_way, TransferRing::transfers);
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
  // Nor is it told where the loss was the last that came, nor does a frame come that was not taken.
  sensor_->start();
  board_.send_frame(1);
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
  EXPECT_EQ(frames[0].values.at(19), expected_kpa(0x101, 0x101));
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

}  // namespace palpate::takktile_test
