#include "driver/profile_packet.hpp"

#include <algorithm>
#include <charconv>
#include <iterator>
#include <tuple>
#include <utility>

#include <fmt/format.h>

namespace palpate {

namespace {

using Format = PacketFormat;
using Entry = YamlEntry;

constexpr std::uint32_t most_packet_bytes = 65536;
// Out of step, a deframer without checksum may read this many bytes of parts at every byte.
constexpr std::uint32_t most_unchecked_parts_bytes = 4096;

NumberType read_number_type(const Entry& entry) {
  using Kind = NumberType::Kind;
  return entry.one_of<NumberType>({{"u8", {Kind::unsigned_integer, 1, false}},
                                   {"s8", {Kind::signed_integer, 1, false}},
                                   {"u16le", {Kind::unsigned_integer, 2, false}},
                                   {"u16be", {Kind::unsigned_integer, 2, true}},
                                   {"s16le", {Kind::signed_integer, 2, false}},
                                   {"s16be", {Kind::signed_integer, 2, true}},
                                   {"u32le", {Kind::unsigned_integer, 4, false}},
                                   {"u32be", {Kind::unsigned_integer, 4, true}},
                                   {"u64le", {Kind::unsigned_integer, 8, false}},
                                   {"u64be", {Kind::unsigned_integer, 8, true}},
                                   {"s32le", {Kind::signed_integer, 4, false}},
                                   {"s32be", {Kind::signed_integer, 4, true}},
                                   {"f32le", {Kind::real, 4, false}},
                                   {"f32be", {Kind::real, 4, true}}});
}

NumberType read_unsigned_type(const Entry& entry) {
  const NumberType type = read_number_type(entry);
  if (type.kind != NumberType::Kind::unsigned_integer) {
    entry.refuse("give u8, u16le, u16be, u32le, u32be, u64le or u64be");
  }
  return type;
}

/// The place of the next field, which the format takes up.
Format::Place next_place(Format& format, std::size_t bytes) {
  const Format::Place place{format.bytes, bytes};
  format.bytes += bytes;
  return place;
}

// Each reader below appends a field to a format, whose `bytes` are those of the fields so far.

void read_check(const Entry& field, Format& format) {
  using Kind = Checksum::Kind;
  Format::Check& check = format.check.emplace(Format::Check{});
  Checksum& options = check.checksum;
  read_keys(field, {{"checksum",
                     [&](const Entry& e) {
                       const auto kind =
                           e.one_of<std::pair<Kind, std::size_t>>({{"sum8", {Kind::sum, 1}},
                                                                   {"sum16", {Kind::sum, 2}},
                                                                   {"xor8", {Kind::exor, 1}},
                                                                   {"crc8", {Kind::crc, 1}},
                                                                   {"crc16", {Kind::crc, 2}},
                                                                   {"crc32", {Kind::crc, 4}},
                                                                   {"weiss16", {Kind::weiss, 2}}});
                       std::tie(options.kind, options.bytes) = kind;
                     }},
                    {"polynomial", whole_number(options.polynomial, 1)},
                    {"init", whole_number(options.init, 0)},
                    {"xor_out", whole_number(options.xor_out, 0)},
                    {"reflect",
                     [&](const Entry& e) {
                       options.reflect = e.one_of<bool>({{"false", false}, {"true", true}});
                     }},
                    {"order",
                     [&](const Entry& e) {
                       check.big_endian = e.one_of<bool>({{"le", false}, {"be", true}});
                     }},
                    {"from", whole_number(check.from_byte, 0, most_packet_bytes)},
                    {"covers", [&](const Entry& e) {
                       check.after = e.one_of<bool>({{"before", false}, {"after", true}});
                     }}});
  const bool is_crc = options.kind == Kind::crc;
  if (is_crc != (options.polynomial != 0)) {
    field.refuse(is_crc ? "a crc needs 'polynomial', such as 0x1021; add it"
                        : "'polynomial' belongs to a crc; remove it");
  }
  if (!is_crc && options.reflect) {
    field.refuse("'reflect' belongs to a crc; remove it");
  }
  if (options.kind == Kind::weiss && (options.init != 0 || options.xor_out != 0)) {
    field.refuse("weiss16 has its own 'init' and 'xor_out'; remove them");
  }
  const std::uint64_t end = std::uint64_t{1} << (8 * options.bytes);
  if (std::max({options.polynomial, options.init, options.xor_out}) >= end) {
    field.refuse(fmt::format("shorten polynomial, init and xor_out to {} bits", 8 * options.bytes));
  }
  // Bytes in front of the checksum in the shortest packet.
  const std::size_t before = format.length ? format.head_bytes() : format.bytes;
  if (!check.after && check.from_byte >= before) {
    field.refuse(fmt::format("'from' is {}, but only {} bytes precede the checksum; lower it",
                             check.from_byte, before));
  }
  if (check.after && (format.values || format.parts || check.from_byte != 0)) {
    field.refuse("'covers: after' needs a checksum in front of the values, without 'from'");
  }
  check.place = next_place(format, options.bytes);
}

void read_length(const Entry& field, Format& format) {
  Format::Length& length = format.length.emplace(Format::Length{});
  read_keys(field, {{"length", [&](const Entry& e) { length.type = read_unsigned_type(e); }},
                    {"extra", whole_number(length.extra, 0, most_packet_bytes)},
                    {"most", whole_number(length.most, 1, most_packet_bytes)}});
  length.place = next_place(format, length.type.bytes);
}

void read_time(const Entry& field, Format& format) {
  Format::Clock clock;
  read_keys(field, {{"time",
                     [&](const Entry& e) {
                       clock.type = read_number_type(e);
                       if (clock.type.kind == NumberType::Kind::real) {
                         e.refuse("give an integer type, such as u32le");
                       }
                     }},
                    {"tick_s", [&](const Entry& e) { clock.tick_s = e.number(1e-9, 1.0); }}});
  format.time = {next_place(format, clock.type.bytes), clock};
}

void read_values(const Entry& field, Format& format) {
  Format::Values& values = format.values.emplace(Format::Values{});
  read_keys(field, {{"values", [&](const Entry& e) { values.type = read_number_type(e); }},
                    {"stride", whole_number(values.stride_bytes, 1, 256)},
                    {"at", whole_number(values.at_byte, 0, 255)}});
  if (values.stride_bytes == 0) {
    values.stride_bytes = values.at_byte + values.type.bytes;
  }
  if (values.at_byte + values.type.bytes > values.stride_bytes) {
    field.refuse(fmt::format("a value at byte {} does not fit a stride of {}; enlarge 'stride'",
                             values.at_byte, values.stride_bytes));
  }
  values.place = next_place(format, format.elements * values.stride_bytes);
}

Format::Part read_part(const Entry& entry, const NumberType& type, std::size_t elements) {
  Format::Part part;
  std::optional<std::uint8_t> tag;
  std::size_t skip = 0;
  double tick_s = 0.0;
  read_keys(entry, {{"tag", whole_number(tag, 0, 255)},
                    {"mask", whole_number(part.mask, 0, 255)},
                    {"values", whole_number(part.values, 1, static_cast<std::uint32_t>(elements))},
                    {"skip", whole_number(skip, 0, 4096)},
                    {"time",
                     [&](const Entry& e) {
                       part.clock = {read_unsigned_type(e), 0.0};
                     }},
                    {"tick_s", [&](const Entry& e) { tick_s = e.number(1e-9, 1.0); }}});
  if (!tag) {
    entry.refuse("key 'tag' is missing; add the byte that the part begins with");
  }
  part.tag = *tag;
  if ((part.values > 0 ? 1 : 0) + (skip > 0 ? 1 : 0) + (part.clock ? 1 : 0) > 1) {
    entry.refuse("a part has either 'values', 'time' or 'skip'; remove one");
  }
  if (part.clock) {
    part.clock->tick_s = tick_s;
    skip = part.clock->type.bytes;
  }
  part.bytes = 1 + skip + part.values * type.bytes;
  return part;
}

void read_parts(const Entry& field, Format& format) {
  Format::Parts& parts = format.parts.emplace(Format::Parts{});
  std::vector<Entry> tags;
  read_keys(
      field,
      {{"parts", [&](const Entry& e) { parts.type = read_number_type(e); }},
       {"tags", [&](const Entry& e) { tags = e.list("give a list of {tag: ..., values: N}"); }}});
  std::size_t values = 0;
  for (const Entry& tag : tags) {
    Format::Part& part = parts.list.emplace_back(read_part(tag, parts.type, format.elements));
    part.first_element = values;
    values += part.values;
  }
  if (values != format.elements) {
    field.refuse(
        fmt::format("the parts carry {} values, but there are {} elements; correct the "
                    "'values' of the tags or 'elements'",
                    values, format.elements));
  }
  // Without a Length, a packet carries one part.
  const std::size_t bytes = parts.list.front().bytes;
  if (!format.length && !std::ranges::all_of(parts.list, [&](const Format::Part& part) {
        return part.bytes == bytes;
      })) {
    field.refuse("parts differ in size, so that packets need a 'length'; add it");
  }
  parts.place = next_place(format, format.length ? 0 : bytes);
}

Format::Pattern read_pattern(const Entry& field, std::string_view kind, Format& format) {
  Format::Pattern pattern;
  read_keys(field, {{kind, [&](const Entry& e) { pattern.bytes = read_bytes(e); }}});
  pattern.place = next_place(format, pattern.bytes.size());
  return pattern;
}

void read_skip(const Entry& field, Format& format) {
  std::size_t bytes = 0;
  read_keys(field, {{"skip", whole_number(bytes, 1, 4096)}});
  next_place(format, bytes);
}

void read_fixed(const Entry& field, Format& format) {
  format.fixed.push_back(read_pattern(field, "bytes", format));
}

void read_only(const Entry& field, Format& format) {
  format.only.push_back(read_pattern(field, "only", format));
}

/// One key names the field's kind; the other keys are its options, which the kind's reader checks.
struct FieldKind {
  std::string_view key;
  void (*read)(const Entry& field, Format& format);
};

const FieldKind& kind_of(const Entry& field) {
  static constexpr FieldKind all[] = {{"bytes", read_fixed}, {"only", read_only},
                                      {"skip", read_skip},   {"length", read_length},
                                      {"time", read_time},   {"values", read_values},
                                      {"parts", read_parts}, {"checksum", read_check}};
  constexpr const char* kinds = "bytes, only, skip, length, time, values, parts, checksum";
  if (!field.node.IsMap()) {
    field.refuse(fmt::format("give a field such as {{skip: 1}}; the fields are {}", kinds));
  }
  for (const FieldKind& kind : all) {
    const auto is_kind = [&](const auto& item) {
      return item.first.IsScalar() && item.first.Scalar() == kind.key;
    };
    if (std::any_of(field.node.begin(), field.node.end(), is_kind)) {
      return kind;
    }
  }
  field.refuse(fmt::format("unknown field; the fields are {}", kinds));
}

// By default, no packet is larger than the packet with the values.
void set_most(const Entry& entry, Format& format) {
  std::size_t& most = format.length->most;
  const std::size_t middle_bytes = format.tail - format.head_bytes();
  if (most == 0 && format.parts) {
    entry.refuse("add 'most', the largest number of bytes that 'length' counts");
  }
  most = most == 0 ? middle_bytes : most;
  if (format.parts && !format.check && most > most_unchecked_parts_bytes) {
    entry.refuse(
        fmt::format("'most' is {}, but parts without a checksum have at most {} "
                    "bytes; lower it, or add 'checksum'",
                    most, most_unchecked_parts_bytes));
  }
  if (most < middle_bytes) {
    entry.refuse(
        fmt::format("'most' is {}, but the values take {} bytes; enlarge it", most, middle_bytes));
  }
}

}  // namespace

std::optional<std::uint16_t> hexadecimal(std::string_view digits) {
  std::uint16_t number = 0;
  const char* end = digits.data() + digits.size();
  const auto [rest, error] = std::from_chars(digits.data(), end, number, 16);
  return error == std::errc{} && rest == end ? std::optional(number) : std::nullopt;
}

std::vector<std::uint8_t> read_bytes(const YamlEntry& entry, std::size_t least) {
  constexpr std::size_t limit = 256;
  std::vector<std::uint8_t> bytes;
  std::string digits = entry.node.IsScalar() ? entry.node.Scalar() : "?";
  std::erase(digits, ' ');
  for (std::size_t i = 0; i < digits.size(); i += 2) {
    const auto byte = hexadecimal(std::string_view(digits).substr(i, 2));
    if (!byte || digits.size() - i < 2) {
      entry.refuse("give bytes of two hexadecimal digits each, such as aa 55");
    }
    bytes.push_back(static_cast<std::uint8_t>(*byte));
  }
  if (bytes.size() < least || bytes.size() > limit) {
    entry.refuse(fmt::format("give {} to {} bytes", least, limit));
  }
  return bytes;
}

PacketFormat read_packet_format(const YamlEntry& packet, std::size_t elements) {
  constexpr std::size_t most_fields = 64;
  const std::vector<Entry> entries = packet.list("give a list of fields");
  if (entries.empty() || entries.size() > most_fields) {
    packet.refuse(fmt::format("give 1 to {} fields", most_fields));
  }
  std::vector<FieldKind> kinds;
  std::ranges::transform(entries, std::back_inserter(kinds), kind_of);
  const auto count = [&](std::string_view key) {
    return std::ranges::count(kinds, key, &FieldKind::key);
  };
  if (count("values") + count("parts") != 1) {
    packet.refuse("give exactly one field 'values' or 'parts'");
  }
  if (count("length") > 1 || count("time") > 1 || count("checksum") > 1) {
    packet.refuse("give 'length', 'time' and 'checksum' at most once each; remove one");
  }
  if (kinds.front().key != "bytes" && kinds.back().key != "bytes") {
    packet.refuse("nothing marks a packet; begin or end it with 'bytes'");
  }
  const auto length = std::ranges::find(kinds, "length", &FieldKind::key);
  const auto middle = length == kinds.end() ? kinds.begin() : length + 1;
  auto tail = kinds.end();
  while (tail != middle && ((tail - 1)->key == "checksum" || (tail - 1)->key == "bytes")) {
    --tail;
  }

  PacketFormat format;
  format.elements = elements;
  for (auto kind = kinds.begin(); kind != kinds.end(); ++kind) {
    const Entry& entry = entries[static_cast<std::size_t>(kind - kinds.begin())];
    // Behind a Length, a field's place is known only in packets with values, except in the tail.
    if (format.length && kind < tail && kind->key == "bytes") {
      entry.refuse("behind 'length', only the end has 'bytes'; write 'only' instead");
    }
    if (format.length && kind < tail && kind->key == "checksum") {
      entry.refuse("put 'checksum' before 'length' or at the end");
    }
    if (kind < middle && (kind->key == "values" || kind->key == "parts")) {
      entry.refuse("put 'values' or 'parts' behind 'length'");
    }
    kind->read(entry, format);
    if (format.bytes > most_packet_bytes) {
      entry.refuse(fmt::format("a packet is longer than {} bytes; give fewer elements or fields",
                               most_packet_bytes));
    }
    format.tail = kind < tail ? format.bytes : format.tail;
  }
  if (format.length) {
    set_most(entries[static_cast<std::size_t>(length - kinds.begin())], format);
  }
  if (kinds.front().key == "bytes") {
    format.preamble = format.fixed.front().bytes;
  } else {
    format.terminator = format.fixed.back().bytes;
  }
  return format;
}

}  // namespace palpate
