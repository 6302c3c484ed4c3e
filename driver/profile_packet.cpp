#include "driver/profile_packet.hpp"

#include <algorithm>
#include <charconv>
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

Format::Check read_check(const Entry& field) {
  using Kind = Checksum::Kind;
  Checksum::Parameters options;
  Format::Check check{.checksum = Checksum(options)};
  read_keys(field, {{"checksum",
                     [&](const Entry& e) {
                       const auto kind = e.one_of<Checksum::Parameters>(
                           {{"sum8", {.kind = Kind::sum, .bytes = 1}},
                            {"sum16", {.kind = Kind::sum, .bytes = 2}},
                            {"xor8", {.kind = Kind::exor, .bytes = 1}},
                            {"crc8", {.kind = Kind::crc, .bytes = 1}},
                            {"crc16", {.kind = Kind::crc, .bytes = 2}},
                            {"crc32", {.kind = Kind::crc, .bytes = 4}},
                            {"weiss16", {.kind = Kind::weiss, .bytes = 2}}});
                       options.kind = kind.kind;
                       options.bytes = kind.bytes;
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
  check.checksum = Checksum(options);
  return check;
}

Format::Length read_length(const Entry& field) {
  Format::Length length;
  read_keys(field, {{"length",
                     [&](const Entry& e) {
                       length.type = read_number_type(e);
                       if (length.type.kind != NumberType::Kind::unsigned_integer) {
                         e.refuse("give u8, u16le, u16be, u32le, u32be, u64le or u64be");
                       }
                     }},
                    {"extra", whole_number(length.extra, 0, most_packet_bytes)},
                    {"most", whole_number(length.most, 1, most_packet_bytes)}});
  return length;
}

Format::Time read_time(const Entry& field) {
  Format::Time time;
  read_keys(field, {{"time",
                     [&](const Entry& e) {
                       time.type = read_number_type(e);
                       if (time.type.kind == NumberType::Kind::real) {
                         e.refuse("give an integer type, such as u32le");
                       }
                     }},
                    {"tick_s", [&](const Entry& e) { time.tick_s = e.number(1e-9, 1.0); }}});
  return time;
}

Format::Values read_values(const Entry& field) {
  Format::Values values{.stride_bytes = 0};
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
  return values;
}

Format::Part read_part(const Entry& entry, std::size_t elements) {
  Format::Part part;
  std::optional<std::uint8_t> tag;
  double tick_s = 0.0;
  read_keys(entry, {{"tag", whole_number(tag, 0, 255)},
                    {"mask", whole_number(part.mask, 0, 255)},
                    {"values", whole_number(part.values, 1, static_cast<std::uint32_t>(elements))},
                    {"skip", whole_number(part.skip, 0, 4096)},
                    {"time",
                     [&](const Entry& e) {
                       part.time = {read_number_type(e), 0.0};
                     }},
                    {"tick_s", [&](const Entry& e) { tick_s = e.number(1e-9, 1.0); }}});
  if (!tag) {
    entry.refuse("key 'tag' is missing; add the byte that the part begins with");
  }
  part.tag = *tag;
  if ((part.values > 0 ? 1 : 0) + (part.skip > 0 ? 1 : 0) + (part.time ? 1 : 0) > 1) {
    entry.refuse("a part has either 'values', 'time' or 'skip'; remove one");
  }
  if (part.time) {
    if (part.time->type.kind != NumberType::Kind::unsigned_integer) {
      entry.refuse("'time' is an unsigned integer, such as u64be; correct it");
    }
    part.time->tick_s = tick_s;
    part.skip = part.time->type.bytes;
  }
  return part;
}

Format::Parts read_parts(const Entry& field, std::size_t elements) {
  Format::Parts parts;
  read_keys(field, {{"parts", [&](const Entry& e) { parts.type = read_number_type(e); }},
                    {"tags", [&](const Entry& e) {
                       for (const Entry& part : e.list("give a list of {tag: ..., values: N}")) {
                         parts.parts.push_back(read_part(part, elements));
                       }
                     }}});
  std::size_t values = 0;
  for (const Format::Part& part : parts.parts) {
    values += part.values;
  }
  if (values != elements) {
    field.refuse(
        fmt::format("the parts carry {} values, but there are {} elements; correct the "
                    "'values' of the tags or 'elements'",
                    values, elements));
  }
  return parts;
}

std::vector<std::uint8_t> read_only_bytes(const Entry& field, std::string_view kind) {
  std::vector<std::uint8_t> bytes;
  read_keys(field, {{kind, [&](const Entry& e) { bytes = read_bytes(e); }}});
  return bytes;
}

Format::Skip read_skip(const Entry& field) {
  Format::Skip skip;
  read_keys(field, {{"skip", whole_number(skip.bytes, 1, 4096)}});
  return skip;
}

Format::Field read_field(const Entry& field, std::size_t elements) {
  constexpr const char* kinds = "bytes, only, skip, length, time, values, parts, checksum";
  if (!field.node.IsMap()) {
    field.refuse(fmt::format("give a field such as {{skip: 1}}; the fields are {}", kinds));
  }
  // One key names the field's kind; the other keys are its options, which the kind's reader checks.
  const std::pair<std::string_view, std::function<Format::Field()>> readers[] = {
      {"bytes", [&] { return Format::Fixed{read_only_bytes(field, "bytes")}; }},
      {"only", [&] { return Format::Only{read_only_bytes(field, "only")}; }},
      {"skip", [&] { return read_skip(field); }},
      {"length", [&] { return read_length(field); }},
      {"time", [&] { return read_time(field); }},
      {"values", [&] { return read_values(field); }},
      {"parts", [&] { return read_parts(field, elements); }},
      {"checksum", [&] { return read_check(field); }}};
  for (const auto& reader : readers) {
    const auto is_kind = [&](const auto& item) {
      return item.first.IsScalar() && item.first.Scalar() == reader.first;
    };
    if (std::any_of(field.node.begin(), field.node.end(), is_kind)) {
      return reader.second();
    }
  }
  field.refuse(fmt::format("unknown field; the fields are {}", kinds));
}

template <class Field>
std::size_t count_of(const Format& format) {
  return static_cast<std::size_t>(std::count_if(
      format.fields.begin(), format.fields.end(),
      [](const Format::Field& field) { return std::holds_alternative<Field>(field); }));
}

void check_counts(const Entry& packet, const Format& format) {
  if (count_of<Format::Values>(format) + count_of<Format::Parts>(format) != 1) {
    packet.refuse("give exactly one field 'values' or 'parts'");
  }
  if (count_of<Format::Length>(format) > 1 || count_of<Format::Time>(format) > 1 ||
      count_of<Format::Check>(format) > 1) {
    packet.refuse("give 'length', 'time' and 'checksum' at most once each; remove one");
  }
  if (!std::holds_alternative<Format::Fixed>(format.fields.front()) &&
      !std::holds_alternative<Format::Fixed>(format.fields.back())) {
    packet.refuse("nothing marks a packet; begin or end it with 'bytes'");
  }
}

// Without a Length, a packet carries one part, so that all parts must have one size.
void check_parts(const Entry& field, const Format::Parts& parts, bool counted) {
  for (const Format::Part& part : parts.parts) {
    if (!counted && bytes_of(parts, part) != bytes_of(parts, parts.parts.front())) {
      field.refuse("parts differ in size, so that packets need a 'length'; add it");
    }
  }
}

// Behind a Length, a field's place is known only in packets with values, except in the tail.
void check_places(const std::vector<Entry>& entries, const Format& format) {
  const PacketLayout layout(format);
  for (std::size_t i = 0; i < format.fields.size(); ++i) {
    const Format::Field& field = format.fields[i];
    const bool in_middle = layout.has_length() && i >= layout.middle() && i < layout.tail();
    if (in_middle && std::holds_alternative<Format::Fixed>(field)) {
      entries[i].refuse("behind 'length', only the end has 'bytes'; write 'only' instead");
    }
    if (in_middle && std::holds_alternative<Format::Check>(field)) {
      entries[i].refuse("put 'checksum' before 'length' or at the end");
    }
    if (i < layout.middle() && (std::holds_alternative<Format::Values>(field) ||
                                std::holds_alternative<Format::Parts>(field))) {
      entries[i].refuse("put 'values' or 'parts' behind 'length'");
    }
    if (const auto* check = std::get_if<Format::Check>(&field)) {
      // Bytes in front of the checksum in the shortest packet.
      const std::size_t before =
          layout.offset(layout.has_length() && i >= layout.tail() ? layout.middle() : i);
      if (!check->after && check->from_byte >= before) {
        entries[i].refuse(
            fmt::format("'from' is {}, but only {} bytes precede the checksum; lower it",
                        check->from_byte, before));
      }
      if (check->after && (i >= layout.tail() || check->from_byte != 0)) {
        entries[i].refuse(
            "'covers: after' needs a checksum in front of the values, without 'from'");
      }
    }
    if (const auto* parts = std::get_if<Format::Parts>(&field)) {
      check_parts(entries[i], *parts, layout.has_length());
    }
    if (layout.offset(i + 1) > most_packet_bytes) {
      entries[i].refuse(fmt::format(
          "a packet is longer than {} bytes; give fewer elements or fields", most_packet_bytes));
    }
  }
}

// By default, no packet is larger than the packet with the values.
void set_most(const std::vector<Entry>& entries, Format& format) {
  const PacketLayout layout(format);
  for (std::size_t i = 0; i < format.fields.size(); ++i) {
    if (auto* length = std::get_if<Format::Length>(&format.fields[i])) {
      if (length->most == 0 && layout.has_parts()) {
        entries[i].refuse("add 'most', the largest number of bytes that 'length' counts");
      }
      length->most = length->most == 0 ? layout.middle_bytes() : length->most;
      if (layout.has_parts() && count_of<Format::Check>(format) == 0 &&
          length->most > most_unchecked_parts_bytes) {
        entries[i].refuse(
            fmt::format("'most' is {}, but parts without a checksum have at most {} "
                        "bytes; lower it, or add 'checksum'",
                        length->most, most_unchecked_parts_bytes));
      }
      if (length->most < layout.middle_bytes()) {
        entries[i].refuse(fmt::format("'most' is {}, but the values take {} bytes; enlarge it",
                                      length->most, layout.middle_bytes()));
      }
    }
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
  PacketFormat format;
  format.elements = elements;
  const std::vector<Entry> entries = packet.list("give a list of fields");
  if (entries.empty() || entries.size() > most_fields) {
    packet.refuse(fmt::format("give 1 to {} fields", most_fields));
  }
  for (const Entry& entry : entries) {
    format.fields.push_back(read_field(entry, elements));
  }
  check_counts(packet, format);
  check_places(entries, format);
  set_most(entries, format);
  return format;
}

}  // namespace palpate
