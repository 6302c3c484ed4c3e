#include "driver/serial_profile.hpp"

#include <sstream>

#include "receiver.hpp"
#include "support/host_locale.hpp"
#include "support/scratch_folder.hpp"
#include "support/trials.hpp"

namespace palpate::serial_profile_test {

TEST(ShippedProfiles, AreFoundByNameAndSayWhatTheBoardsAre) {
  const HostLocale locale;
  const std::pair<const char*, std::size_t> boards[] = {
      {"anyskin", 5}, {"flexitac", 512}, {"flexitac12", 384}, {"tsf85", 56}, {"wts", 84}};
  std::vector<std::string> names;
  for (const auto& [name, elements] : boards) {
    SCOPED_TRACE(name);
    names.emplace_back(name);
    const SerialProfile profile = read_serial_profile(name);
    EXPECT_EQ(profile.pressure_unit, "raw");
    EXPECT_EQ(profile.elements_mm.size(), elements);
    EXPECT_EQ(profile.packet.elements, elements);
    EXPECT_EQ(profile.line.baud, names.back().starts_with("flexitac") ? 2000000u : 115200u);
  }
  EXPECT_EQ(shipped_profiles(), names);
  const SerialProfile tsf85 = read_serial_profile("tsf85");
  EXPECT_EQ(tsf85.usb, (std::vector<UsbId>{{0x16d0, 0x14cc}, {0x04b4, 0xf232}}));
  EXPECT_EQ(tsf85.start, (std::vector<std::uint8_t>{0x9a, 0, 0x58, 1, 10}));
  expect_named(input_error([] { read_serial_profile("digitacts"); }),
               {"digitacts", "anyskin, flexitac, flexitac12, tsf85, wts"});
}

// The least that a profile must say.
const std::string head = "name: own\nelements: [[0, 0], [2, 0]]\n";
const std::string packet = "packet: [{bytes: aa}, {values: u8}]\n";

class ProfileFile : public testing::Test {
 protected:
  SerialProfile read(const std::string& yaml) {
    put_bytes(path_, yaml);
    return read_serial_profile(path_.string());
  }

  using Rows = std::initializer_list<std::pair<std::string, const char*>>;

  /// Expects that profiles, each with such a part, are refused by their path and this place in it.
  void expect_refused(const std::string& before, const Rows& rows, const std::string& behind) {
    for (const auto& [part, place] : rows) {
      SCOPED_TRACE(part);
      expect_named(input_error([&] { read(before + part + behind); }), {path_.c_str(), place});
    }
  }

  ScratchFolder folder_;
  std::filesystem::path path_ = folder_ / "own.yaml";
};

// Also in a program whose numbers have decimal commas
TEST_F(ProfileFile, SaysAllThatItCan) {
  const HostLocale locale;
  const SerialProfile profile = read(R"(
name: Own board
usb: [1209:0001, "1209:ABCD"]
line: {baud: 0921600, data_bits: 0x7, parity: even, stop_bits: 2}
start: 01 02ff
stop: ""
unit: kPa
gain: 0.5
offset: -3.250
rate_hz: 1000.500
elements:
  - [1.125, 2.500]
  - {grid: [2, 3], pitch_mm: [2, -4], center_mm: [10, 0], fastest: y}
packet:
  - bytes: aa 55
  - values: s16be
)");
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
  EXPECT_EQ(profile.packet.offset, -3.25);
  EXPECT_EQ(profile.rate_hz, 1000.5);
  EXPECT_EQ(
      profile.elements_mm,
      (std::vector<glm::dvec2>{{1.125, 2.5}, {9, 4}, {9, 0}, {9, -4}, {11, 4}, {11, 0}, {11, -4}}));
}

TEST_F(ProfileFile, NeedsLittle) {
  const SerialProfile profile = read(head + packet);
  EXPECT_TRUE(profile.usb.empty());
  EXPECT_EQ(profile.line.baud, 115200u);
  EXPECT_EQ(profile.pressure_unit, "raw");
  EXPECT_EQ(profile.rate_hz, 0.0);
}

TEST_F(ProfileFile, IsRefusedWhereItIsNone) {
  for (const std::filesystem::path& path : {folder_ / "no.yaml", folder_.path()}) {
    expect_named(input_error([&] { read_serial_profile(path.string()); }),
                 {path.c_str(), "cannot be read as a profile"});
  }
  expect_refused(
      "",
      {{"", "line 1: 'the profile': give a map"},
       {"just text", "line 1: 'the profile' = 'just text': give a map"},
       {"name: [", "correct the YAML"},
       {head + packet + "---\nname: other\n", "line 4: a second document"},
       {"name: own\n", "'elements' is missing"},
       {head, "'packet' is missing"},
       {"name: own\nelements: [[0, 0], [1]]\npacket: []\n", "line 2: 'elements[1]': give [x, y]"},
       {"name: own\nelements: [{grid: [2, 2]}]\npacket: []\n", "line 2: 'elements[0]': a grid has"},
       {"name: own\nelements: [{grid: [1024, 1024], pitch_mm: [1, 1]}]\npacket: []\n",
        "'elements[0]': more than 16384"},
       {"name: own\nelements: []\npacket: []\n", "'elements': give 1 to"}},
      "");
}

TEST_F(ProfileFile, IsRefusedByLineAndKey) {
  const HostLocale locale;  // a program's own reads no number that others do not
  expect_refused(head,
                 {{"colour: red", "line 3: 'key' = 'colour': unknown key"},
                  {"name: twice", "line 3: 'key' = 'name': key given twice"},
                  {"usb: [16d0-14cc]", "line 3: 'usb[0]' = '16d0-14cc'"},
                  {"usb: 16d0:14cc", "line 3: 'usb' = '16d0:14cc': give a list"},
                  {"line: {baud: fast}", "line 3: 'baud' = 'fast': give a whole number from 50"},
                  {"line: {baud: 0x+1c200}", "'baud' = '0x+1c200': give a whole number"},
                  {"line: {baud: 0x}", "'baud' = '0x': give a whole number"},
                  {"line: {speed: 9600}", "line 3: 'key' = 'speed': unknown key"},
                  {"line: {parity: mark}", "'parity' = 'mark'"},
                  {"start: 0g", "line 3: 'start' = '0g'"},
                  {"start: 012", "'start' = '012'"},
                  {"unit: psi", "'unit' = 'psi'"},
                  {"gain: .nan", "'gain' = '.nan': give a number"},
                  {"gain: 1,5", "'gain' = '1,5': give a number"},
                  {"rate_hz: -1", "'rate_hz' = '-1'"}},
                 "\n" + packet);
}

TEST_F(ProfileFile, IsRefusedByTheFieldOfItsPacket) {
  expect_refused(
      head + "packet:\n  - ",
      {{"bytes: aa", "line 4: 'packet': give exactly one field"},
       {"values: u8", "'packet': nothing marks a packet"},
       {"bytes: aa\n  - colour: 3", "line 5: 'packet[1]': unknown field"},
       {"bytes: aa\n  - {values: u8, colour: 3}", "line 5: 'key' = 'colour': unknown key"},
       {"bytes: aa\n  - values: u24", "line 5: 'values' = 'u24'"},
       {"bytes: aa\n  - {values: u16le, stride: 2, at: 1}",
        "line 5: 'packet[1]': a value at byte 1 does not fit"},
       {"bytes: aa\n  - length: f32le\n  - values: u8", "line 5: 'length' = 'f32le'"},
       {"bytes: aa\n  - {length: u8, most: 1}\n  - values: u8",
        "line 5: 'packet[1]': 'most' is 1, but the values take 2 bytes"},
       {"bytes: aa\n  - length: u8\n  - bytes: bb\n  - values: u8",
        "line 6: 'packet[2]': behind 'length', only the end has 'bytes'"},
       {"bytes: aa\n  - values: u8\n  - length: u8",
        "line 5: 'packet[1]': put 'values' or 'parts' behind 'length'"},
       {"bytes: aa\n  - values: u8\n  - checksum: crc16", "line 6: 'packet[2]': a crc needs"},
       {"bytes: aa\n  - values: u8\n  - {checksum: crc8, polynomial: 0x100}",
        "line 6: 'packet[2]': shorten polynomial, init and xor_out to 8 bits"},
       {"bytes: aa\n  - values: u8\n  - {checksum: sum8, from: 3}", "only 3 bytes"},
       {"bytes: aa\n  - values: u8\n  - {checksum: sum8, covers: after}",
        "line 6: 'packet[2]': 'covers: after'"},
       {"bytes: aa\n  - values: u8\n  - checksum: sum8\n  - checksum: sum8",
        "'packet': give 'length', 'time' and 'checksum' at most once"},
       {"bytes: aa\n  - length: u8\n  - values: u8\n  - checksum: sum8\n  - skip: 1",
        "'packet[3]': put 'checksum' before 'length' or at the end"},
       {"bytes: aa\n  - {parts: u8, tags: [{tag: 1, values: 1}]}",
        "carry 1 values, but there are 2 elements"},
       {"bytes: aa\n  - {parts: u8, tags: [{values: 2}]}",
        "line 5: 'tags[0]': key 'tag' is missing"},
       {"bytes: aa\n  - {parts: u8, tags: [{tag: 1, values: 2}, {tag: 2, skip: 9}]}",
        "line 5: 'packet[1]': parts differ in size"},
       {"bytes: aa\n  - length: u8\n  - {parts: u8, tags: [{tag: 1, values: 2}]}",
        "line 5: 'packet[1]': add 'most'"},
       {"bytes: aa\n  - {length: u16le, most: 4097}\n  - {parts: u8, tags: [{tag: 1, values: 2}]}",
        "line 5: 'packet[1]': 'most' is 4097"}},
      "\n");
  const std::string parts = ", {parts: u8, tags: [{tag: 1, values: 2}]}";
  read(head + "packet: [bytes: aa, {length: u16le, most: 4096}" + parts + "]\n");
  read(head + "packet: [bytes: aa, {length: u16le, most: 65536}" + parts + ", checksum: sum8]\n");
}

// Lines of the shipped profiles, changed and put together at random.
TEST(MutatedProfile, IsReadOrRefusedInOneLine) {
  std::mt19937 random(61);
  const std::vector<std::string> boards = shipped_profiles();
  std::vector<std::string> texts;
  std::vector<std::string> lines;
  for (const std::string& name : boards) {
    std::istringstream file(bytes_of(profile_path(name)));
    texts.emplace_back();
    for (std::string line; std::getline(file, line);) {
      if (!line.starts_with('#') && !line.empty()) {  // comments would only take time
        lines.push_back(line + "\n");
        texts.back() += lines.back();
      }
    }
  }
  const std::vector<std::string> words = {
      "0",  "-1",  "65536",  "1e308", ".nan",  "u16le",   "[",  "]",         "{",  "}",
      "*a", "&a ", "tag: 0", "aa",    "bytes", "most: 1", "? ", "!!binary ", "\t", "\xff"};
  int read = 0;
  for (int trial = 0; trial < trials(2000); ++trial) {
    std::string text = texts[random() % texts.size()];
    for (unsigned edits = random() % 4 == 0 ? 3 : 1; edits > 0; --edits) {
      const std::size_t at = random() % (text.size() + 1);
      const std::size_t next_line = text.find('\n', at);
      switch (random() % 3) {
        case 0:
          text.insert(next_line == std::string::npos ? at : next_line + 1,
                      lines[random() % lines.size()]);
          break;
        case 1:
          text.erase(at, random() % 30);
          break;
        default:
          text.replace(at, random() % 6, words[random() % words.size()]);
      }
    }
    try {
      const SerialProfile profile = parse_serial_profile(text, "mutated.yaml");
      Receiver receiver(profile);
      for (int i = 0; i < 4; ++i) {
        receiver.send({random_frame(boards[random() % boards.size()], random)});
      }
      for (const Frame& frame : receiver.frames()) {
        ASSERT_EQ(frame.values.size(), profile.elements_mm.size());
      }
      ++read;
    } catch (const Error& error) {
      ASSERT_EQ(error.fault(), Fault::input);
      const std::string message = error.what();
      ASSERT_TRUE(message.starts_with("mutated.yaml: line ")) << message << "\n" << text;
      ASSERT_EQ(message.find('\n'), std::string::npos) << message;
    }
  }
  EXPECT_GT(read, trials(2000) / 16) << "too few get as far as a deframer";
}

}  // namespace palpate::serial_profile_test
