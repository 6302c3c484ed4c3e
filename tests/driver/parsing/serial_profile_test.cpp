#include "driver/serial_profile.hpp"

#include <gtest/gtest.h>

#include "support/host_locale.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::serial_profile_test {

TEST(ShippedProfiles, AreFoundByName) {
  EXPECT_EQ(shipped_profiles(),
            (std::vector<std::string>{"anyskin", "flexitac", "flexitac12", "tsf85", "wts"}));
  for (const std::string& name : shipped_profiles()) {
    const SerialProfile profile = read_serial_profile(name);
    EXPECT_EQ(profile.pressure_unit, "raw") << name;
    EXPECT_EQ(profile.packet.elements, profile.elements_mm.size()) << name;
    EXPECT_NE(make_deframer(profile), nullptr);
  }
}

TEST(ShippedProfiles, SayWhatTheBoardsAre) {
  const SerialProfile tsf85 = read_serial_profile("tsf85");
  EXPECT_EQ(tsf85.usb, (std::vector<UsbId>{{0x16d0, 0x14cc}, {0x04b4, 0xf232}}));
  EXPECT_EQ(tsf85.line.baud, 115200u);
  EXPECT_EQ(tsf85.start, (std::vector<std::uint8_t>{0x9a, 0, 0x58, 1, 10}));
  EXPECT_EQ(tsf85.elements_mm.size(), 56u);
  EXPECT_EQ(read_serial_profile("wts").elements_mm.size(), 84u);
  EXPECT_EQ(read_serial_profile("flexitac").elements_mm.size(), 512u);
  EXPECT_EQ(read_serial_profile("flexitac12").elements_mm.size(), 384u);
  for (const char* name : {"flexitac", "flexitac12"}) {
    EXPECT_EQ(read_serial_profile(name).line.baud, 2000000u);
  }
  EXPECT_EQ(read_serial_profile("anyskin").elements_mm.size(), 5u);
}

TEST(ShippedProfiles, AreNamedWhereAnotherWasAskedFor) {
  expect_named(input_error([] { read_serial_profile("digitacts"); }),
               {"digitacts", "anyskin, flexitac, flexitac12, tsf85, wts", ".yaml"});
}

class ProfileFile : public testing::Test {
 protected:
  SerialProfile read(const std::string& yaml) {
    put_bytes(path_, yaml);
    return read_serial_profile(path_.string());
  }

  /// Expects a message of one line that names the file and these words.
  void expect_refused(const std::string& yaml, std::initializer_list<const char*> parts) {
    const std::string message = input_error([&] { read(yaml); });
    expect_named(message, {path_.c_str()});
    expect_named(message, parts);
  }

  ScratchFolder folder_;
  std::filesystem::path path_ = folder_ / "own.yaml";
};

// The least that a profile must say.
constexpr const char* head = "name: own\nelements: [[0, 0], [2, 0]]\n";
constexpr const char* packet = "packet: [{bytes: aa}, {values: u8}]\n";

std::string with(const std::string& line) { return std::string(head) + line + "\n" + packet; }
std::string with_packet(const std::string& fields) {
  return std::string(head) + "packet:\n" + fields;
}

TEST_F(ProfileFile, SaysAllThatItCan) {
  const SerialProfile profile = read(R"(
name: Own board
usb: [1209:0001, "1209:ABCD"]
line: {baud: 921600, data_bits: 7, parity: even, stop_bits: 2}
start: 01 02ff
stop: ""
unit: kPa
gain: 0.5
offset: -3
rate_hz: 250
elements:
  - [1, 2]
  - {grid: [2, 3], pitch_mm: [2, -4], center_mm: [10, 0], fastest: y}
packet:
  - bytes: aa 55
  - values: s16be
)");
  EXPECT_EQ(profile.path, path_);
  EXPECT_EQ(profile.name, "Own board");
  EXPECT_EQ(profile.usb, (std::vector<UsbId>{{0x1209, 0x0001}, {0x1209, 0xabcd}}));
  EXPECT_EQ(profile.line.baud, 921600u);
  EXPECT_EQ(profile.line.data_bits, 7);
  EXPECT_EQ(profile.line.parity, SerialLine::Parity::even);
  EXPECT_EQ(profile.line.stop_bits, 2);
  EXPECT_EQ(profile.start, (std::vector<std::uint8_t>{1, 2, 0xff}));
  EXPECT_TRUE(profile.stop.empty());
  EXPECT_EQ(profile.pressure_unit, "kPa");
  EXPECT_EQ(profile.packet.gain, 0.5);
  EXPECT_EQ(profile.packet.offset, -3.0);
  EXPECT_EQ(profile.rate_hz, 250.0);
  EXPECT_EQ(profile.elements_mm,
            (std::vector<glm::dvec2>{{1, 2}, {9, 4}, {9, 0}, {9, -4}, {11, 4}, {11, 0}, {11, -4}}));
}

TEST_F(ProfileFile, NeedsLittle) {
  const SerialProfile profile = read(with(""));
  EXPECT_TRUE(profile.usb.empty());
  EXPECT_EQ(profile.line.baud, 115200u);
  EXPECT_EQ(profile.pressure_unit, "raw");
  EXPECT_EQ(profile.rate_hz, 0.0);
}

TEST_F(ProfileFile, IsRefusedWhereItIsNone) {
  expect_named(input_error([&] { read_serial_profile((folder_ / "no.yaml").string()); }),
               {"no.yaml", "no such profile"});
  expect_named(input_error([&] { read_serial_profile(folder_.path().string()); }),
               {folder_.path().c_str(), "no such profile"});
  expect_refused("", {"line 1", "give a map with keys out of name"});
  expect_refused("just text", {"line 1", "just text", "give a map"});
  expect_refused("name: [", {"correct the YAML"});
  expect_refused(std::string(head) + packet + "---\nname: other\n",
                 {"line 4", "second document", "leave one"});
  expect_refused("name: own\n", {"'elements' is missing"});
  expect_refused(head, {"'packet' is missing"});
}

TEST_F(ProfileFile, NamesLineKeyValueAndRemedy) {
  expect_refused(with("colour: red"), {"line 3", "colour", "unknown key", "elements, packet"});
  expect_refused(with("name: twice"), {"line 3", "name", "given twice"});
  expect_refused(with("usb: [16d0-14cc]"), {"line 3", "usb[0]", "16d0-14cc", "lsusb"});
  expect_refused(with("usb: 16d0:14cc"), {"line 3", "usb", "give a list"});
  expect_refused(with("line: {baud: fast}"), {"line 3", "baud", "fast", "whole number from 50"});
  expect_refused(with("line: {speed: 9600}"), {"line 3", "speed", "baud, data_bits"});
  expect_refused(with("line: {parity: mark}"), {"parity", "mark", "none, odd, even"});
  expect_refused(with("start: 0g"), {"line 3", "start", "0g", "hexadecimal"});
  expect_refused(with("start: 012"), {"start", "012", "hexadecimal"});
  expect_refused(with("unit: psi"), {"unit", "psi", "raw, kPa"});
  expect_refused(with("gain: .nan"), {"gain", "give a number"});
  expect_refused(with("rate_hz: -1"), {"rate_hz", "-1", "from 0"});
  expect_refused("name: own\nelements: [[0, 0], [1]]\npacket: []\n",
                 {"line 2", "elements[1]", "give [x, y]"});
  expect_refused("name: own\nelements: [{grid: [2, 2]}]\npacket: []\n",
                 {"line 2", "elements[0]", "pitch_mm"});
  expect_refused("name: own\nelements: [{grid: [1024, 1024], pitch_mm: [1, 1]}]\npacket: []\n",
                 {"elements[0]", "more than 16384"});
  expect_refused("name: own\nelements: []\npacket: []\n", {"elements", "give 1 to"});
}

TEST_F(ProfileFile, SaysWhatIsWrongWithAPacket) {
  expect_refused(with_packet("  - bytes: aa\n"), {"line 4", "packet", "'values' or 'parts'"});
  expect_refused(with_packet("  - values: u8\n"), {"packet", "nothing marks a packet"});
  expect_refused(with_packet("  - bytes: aa\n  - colour: 3\n"),
                 {"line 5", "packet[1]", "unknown field", "bytes, only"});
  expect_refused(with_packet("  - bytes: aa\n  - {values: u8, colour: 3}\n"),
                 {"line 5", "colour", "unknown key", "values, stride, at"});
  expect_refused(with_packet("  - bytes: aa\n  - values: u24\n"),
                 {"line 5", "values", "u24", "u16le"});
  expect_refused(with_packet("  - bytes: aa\n  - {values: u16le, stride: 2, at: 1}\n"),
                 {"line 5", "packet[1]", "enlarge 'stride'"});
  expect_refused(with_packet("  - bytes: aa\n  - length: f32le\n  - values: u8\n"),
                 {"line 5", "length", "f32le", "u16le"});
  expect_refused(with_packet("  - bytes: aa\n  - {length: u8, most: 1}\n  - values: u8\n"),
                 {"line 5", "'most' is 1", "2 bytes"});
  expect_refused(with_packet("  - bytes: aa\n  - length: u8\n  - bytes: bb\n  - values: u8\n"),
                 {"line 6", "packet[2]", "'only'"});
  expect_refused(with_packet("  - bytes: aa\n  - values: u8\n  - length: u8\n"),
                 {"line 5", "packet[1]", "behind 'length'"});
  expect_refused(with_packet("  - bytes: aa\n  - values: u8\n  - checksum: crc16\n"),
                 {"line 6", "packet[2]", "polynomial"});
  expect_refused(with_packet("  - bytes: aa\n  - values: u8\n"
                             "  - {checksum: crc8, polynomial: 0x100}\n"),
                 {"line 6", "packet[2]", "8 bits"});
  expect_refused(with_packet("  - bytes: aa\n  - values: u8\n  - {checksum: sum8, from: 3}\n"),
                 {"line 6", "packet[2]", "only 3 bytes"});
  expect_refused(
      with_packet("  - bytes: aa\n  - values: u8\n  - {checksum: sum8, covers: after}\n"),
      {"line 6", "covers: after"});
  expect_refused(with_packet("  - bytes: aa\n  - values: u8\n  - checksum: sum8\n"
                             "  - checksum: sum8\n"),
                 {"packet", "at most once"});
  expect_refused(with_packet("  - bytes: aa\n  - {parts: u8, tags: [{tag: 1, values: 1}]}\n"),
                 {"line 5", "packet[1]", "carry 1 values", "2 elements"});
  expect_refused(with_packet("  - bytes: aa\n  - {parts: u8, tags: [{values: 2}]}\n"),
                 {"line 5", "tags[0]", "'tag' is missing"});
  expect_refused(with_packet("  - bytes: aa\n"
                             "  - {parts: u8, tags: [{tag: 1, values: 2}, {tag: 2, skip: 9}]}\n"),
                 {"line 5", "packet[1]", "differ in size"});
  expect_refused(with_packet("  - bytes: aa\n  - length: u8\n"
                             "  - {parts: u8, tags: [{tag: 1, values: 2}]}\n"),
                 {"line 5", "packet[1]", "add 'most'"});
  const std::string parts = "  - {parts: u8, tags: [{tag: 1, values: 2}]}\n";
  const std::string checksum = "  - checksum: sum8\n";
  expect_refused(with_packet("  - bytes: aa\n  - {length: u16le, most: 4097}\n" + parts),
                 {"line 5", "'most' is 4097", "at most 4096", "add 'checksum'"});
  read(with_packet("  - bytes: aa\n  - {length: u16le, most: 4096}\n" + parts));
  read(with_packet("  - bytes: aa\n  - {length: u16le, most: 65536}\n" + parts + checksum));
}

TEST_F(ProfileFile, HostProgramWithDecimalCommasReadsTheSame) {
  const std::string yaml =
      "name: own\nelements: [[1.125, -2.500], [1.500, 2]]\ngain: 1.500\noffset: -0.250\n"
      "rate_hz: 1000.500\npacket: [{bytes: aa}, {values: u8}, {checksum: crc16, polynomial: "
      "0x1021}]\n";
  const HostLocale locale;
  const SerialProfile profile = read(yaml);
  EXPECT_EQ(profile.elements_mm, (std::vector<glm::dvec2>{{1.125, -2.5}, {1.5, 2.0}}));
  EXPECT_EQ(profile.packet.gain, 1.5);
  EXPECT_EQ(profile.packet.offset, -0.25);
  EXPECT_EQ(profile.rate_hz, 1000.5);
  expect_refused(with("gain: 1,5"), {"line 3", "gain", "give a number"});
  EXPECT_EQ(shipped_profiles().size(), 5u);
  for (const std::string& name : shipped_profiles()) {
    EXPECT_NO_THROW(read_serial_profile(name));
  }
}

TEST_F(ProfileFile, WholeNumbersAreDecimalOrHexadecimal) {
  EXPECT_EQ(read(with("line: {baud: 0115200}")).line.baud, 115200u);
  EXPECT_EQ(read(with("line: {baud: 0x1c200}")).line.baud, 115200u);
  expect_refused(with("line: {baud: 0x+1c200}"), {"baud", "0x+1c200", "whole number"});
  expect_refused(with("line: {baud: 0x}"), {"baud", "0x", "whole number"});
}

}  // namespace palpate::serial_profile_test
