#include "driver/takktile_protocol.hpp"
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

}  // namespace palpate::takktile_test
