#include "driver/takktile_protocol.hpp"

#include "sent_frame.hpp"
#include "support/errors.hpp"
#include "support/trials.hpp"

namespace palpate::takktile::takktile_protocol_test {

TEST(TakkTileAliveMap, HasABitPerColumnOrInTheForkAByteForEachCell) {
  const std::vector<Cell> cells = {{1, 0}, {1, 2}, {1, 4}, {7, 3}};
  EXPECT_EQ(parse_alive_map(Bytes{0, 0b10101, 0, 0, 0, 0, 0, 0b01000}), cells);
  Bytes reply(40, 0x00);
  reply[5] = reply[7] = reply[9] = reply[38] = 0xff;
  reply[10] = 0x01;  // neither
  EXPECT_EQ(parse_alive_map(reply), cells);
}

TEST(TakkTileAliveMap, RefusesWhatIsNone) {
  const std::pair<Bytes, const char*> replies[] = {{{}, " 0 bytes"},
                                                   {Bytes(7, 1), " 7 bytes"},
                                                   {Bytes(9, 1), " 9 bytes"},
                                                   {Bytes(39, 1), " 39 bytes"},
                                                   {Bytes(41, 1), " 41 bytes"},
                                                   {Bytes(8, 0), "no cell"},
                                                   {Bytes(40, 0), "no cell"},
                                                   {Bytes(8, 0x20), "0x20"}};
  for (const auto& [reply, named] : replies) {
    expect_named(error_of(Fault::system, [&] { parse_alive_map(reply); }), {named});
  }
}

TEST(TakkTileElements, LieOnAGridAboutTheOrigin) {
  const std::vector<Cell> all = parse_alive_map(Bytes(40, 0xff));
  const std::vector<glm::dvec2> elements_mm = element_positions(all);
  ASSERT_EQ(elements_mm.size(), 40u);
  glm::dvec2 sum(0.0);
  for (const glm::dvec2& element_mm : elements_mm) {
    sum += element_mm;
  }
  EXPECT_EQ(sum, glm::dvec2(0.0)) << "multiples of half the pitch are exact";
  EXPECT_EQ(elements_mm[1] - elements_mm[0], glm::dvec2(default_pitch_mm, 0));
  EXPECT_EQ(elements_mm[5] - elements_mm[0], glm::dvec2(0, default_pitch_mm));
  // A cell keeps its place when other cells are dead.
  EXPECT_EQ(element_positions(std::vector<Cell>{{7, 4}}).front(), glm::dvec2(16, 28));
}

// The example of the MPL115A2 data sheet (Freescale, "Pressure compensation"): a0 = 0x3ece,
// b1 = 0xb3f9, b2 = 0xc517, c12 = 0x33c8, Padc = 410 (0x6680), Tadc = 507 (0x7ec0). By hand:
//   a0  =  16078 / 8       = 2009.75
//   b1  = -19463 / 8192    =   -2.3758544921875
//   b2  = -15081 / 16384   =   -0.92047119140625
//   c12 = (0x33c8 >> 2) / 2^22 = 3314 / 4194304 = 0.000790119171142578
//   c12 Tadc = 0.400590419769287;  b1 + that = -1.97526407241821;  times Padc = -809.858269691467
//   + a0 = 1199.89173030853;  + b2 Tadc (-466.678894042969) = 733.212836265564
//   50 + 733.212836265564 * 65 / 1023 = 96.5873258624259 kPa; the data sheet rounds to 96.59.
constexpr std::uint8_t sheet_bytes[] = {0x3e, 0xce, 0xb3, 0xf9, 0xc5, 0x17, 0x33, 0xc8};

TEST(TakkTileCalibration, GivesTheDataSheetsExample) {
  const Calibration calibration = parse_calibration(sheet_bytes);
  EXPECT_EQ(calibration.a0, 2009.75);
  EXPECT_EQ(calibration.b1, -2.3758544921875);
  EXPECT_EQ(calibration.b2, -0.92047119140625);
  EXPECT_EQ(calibration.c12, 3314.0 / 4194304.0);
  // The hand calculation has 15 digits.
  EXPECT_NEAR(pressure_kpa(calibration, 410, 507), 96.5873258624259, 1e-11);
}

TEST(TakkTileCalibration, ReadsSignsAndIgnoresPaddedBits) {
  // c12 = 0x2000 in 14 bits = -8192; the two lowest bits are padding.
  const Calibration calibration =
      parse_calibration(Bytes{0xff, 0xff, 0x7f, 0xff, 0x80, 0x00, 0x80, 0x03});
  EXPECT_EQ(calibration.a0, -0.125);
  EXPECT_EQ(calibration.b1, 32767.0 / 8192.0);
  EXPECT_EQ(calibration.b2, -2.0);
  EXPECT_EQ(calibration.c12, -8192.0 / 4194304.0);
}

TEST(TakkTileCalibration, RefusesACellThatDoesNotAnswer) {
  for (const Bytes& reply : {Bytes{}, Bytes(7, 1), Bytes(12, 1), Bytes(8, 0x00), Bytes(8, 0xff)}) {
    error_of(Fault::system, [&] { parse_calibration(reply); });
  }
}

// kPa = 50 + P * 65 / 1023, so that a value tells which reading P was sent.
constexpr Calibration plain{.a0 = 0.0, .b1 = 1.0, .b2 = 0.0, .c12 = 0.0};

/// A frame whose cell i reads first + i, in packets.
std::vector<Bytes> packets_of(std::size_t cells, std::uint16_t first) {
  Bytes frame;
  for (std::size_t i = 0; i < cells; ++i) {
    const auto pressure = static_cast<std::uint16_t>((first + i) % 1024);
    frame.insert(frame.end(), {static_cast<std::uint8_t>(pressure >> 2),
                               static_cast<std::uint8_t>(pressure << 6), 0x80, 0x00});
  }
  std::vector<Bytes> packets;
  for (std::size_t at = 0; at <= frame.size(); at += packet_bytes) {
    const std::size_t end = std::min(frame.size(), at + packet_bytes);
    packets.emplace_back(frame.begin() + static_cast<std::ptrdiff_t>(at),
                         frame.begin() + static_cast<std::ptrdiff_t>(end));
  }
  return packets;  // the last has fewer bytes than a packet, perhaps none
}

class TakkTileFrames : public testing::TestWithParam<std::size_t> {
 protected:
  void push(const std::vector<Bytes>& packets) {
    for (const Bytes& packet : packets) {
      pushed_bytes_ += packet.size();
      if (auto frame = deframer_.push(packet, packet.size() < packet_bytes)) {
        frames_.push_back(std::move(*frame));
        framed_bytes_ += 4 * cells_;
      }
    }
  }
  void expect_frame(std::size_t index, std::uint16_t first) {
    ASSERT_GT(frames_.size(), index);
    ASSERT_EQ(frames_[index].values.size(), cells_);
    for (std::size_t i = 0; i < cells_; ++i) {
      const double raw = static_cast<double>((first + i) % 1024);
      EXPECT_NEAR(frames_[index].values[i], 50 + raw * 65 / 1023, 1e-12) << "rounding";
    }
    EXPECT_FALSE(frames_[index].device_time_s);
  }

  const std::size_t cells_ = GetParam();
  std::uint64_t garbage_bytes_ = 0;
  Deframer deframer_{std::vector<Calibration>(cells_, plain), garbage_bytes_};
  std::vector<Frame> frames_;
  std::uint64_t pushed_bytes_ = 0;
  std::uint64_t framed_bytes_ = 0;
};

TEST_P(TakkTileFrames, EndWithAShortOrAnEmptyPacketAndBeginAnewAfterReset) {
  push({Bytes{}, Bytes{}});
  EXPECT_TRUE(frames_.empty()) << "an empty packet is no frame";
  push(packets_of(cells_, 100));
  push(packets_of(cells_, 1000));
  ASSERT_EQ(frames_.size(), 2u);
  expect_frame(0, 100);
  expect_frame(1, 1000);
  EXPECT_EQ(garbage_bytes_, 0u);
  push({packets_of(cells_, 9).front().size() == packet_bytes ? Bytes(64, 1) : Bytes{}});
  deframer_.reset();
  push(packets_of(cells_, 11));
  ASSERT_EQ(frames_.size(), 3u);
  expect_frame(2, 11);
}

TEST_P(TakkTileFrames, ThatLoseAPacketAreDropped) {
  const std::vector<Bytes> whole = packets_of(cells_, 7);
  for (std::size_t lost = 0; lost < whole.size(); ++lost) {
    std::vector<Bytes> damaged = whole;
    damaged.erase(damaged.begin() + static_cast<std::ptrdiff_t>(lost));
    frames_.clear();
    push(damaged);
    EXPECT_TRUE(frames_.empty());
    push(packets_of(cells_, 200));  // lost, too, if the lost packet was the end
    frames_.clear();
    push(packets_of(cells_, 300));
    ASSERT_EQ(frames_.size(), 1u) << "not in step two frames after";
    expect_frame(0, 300);
  }
}

TEST_P(TakkTileFrames, AreNeverHalfBehindForeignPackets) {
  std::mt19937 random(59);
  for (int trial = 0; trial < trials(500); ++trial) {
    for (unsigned foreign = random() % 4; foreign > 0; --foreign) {
      Bytes packet = random_bytes(packet_bytes, random);
      damage(packet, static_cast<Damage>(random() % kinds_of_damage), random);
      push({packet});
    }
    push(packets_of(cells_, 50));
    push(packets_of(cells_, 55));
    for (const Frame& frame : frames_) {
      ASSERT_EQ(frame.values.size(), cells_);
    }
    frames_.clear();
    push(packets_of(cells_, 60));
    ASSERT_EQ(frames_.size(), 1u);
    expect_frame(0, 60);
    ASSERT_EQ(garbage_bytes_ + framed_bytes_, pushed_bytes_);
    frames_.clear();
  }
}

// Numbers of cells: one; just below, at and above the 16 of a packet; two packets; a whole board.
INSTANTIATE_TEST_SUITE_P(Cells, TakkTileFrames, testing::Values(1, 15, 16, 17, 32, 40));

}  // namespace palpate::takktile::takktile_protocol_test
