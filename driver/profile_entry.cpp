#include "profile_entry.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "number_text.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

// A message stays one line whatever the file holds.
bool is_short_ascii(const std::string& text) {
  return text.size() <= 60 &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= 0x20 && c < 0x7f; });
}

int digit(char c) {
  if (c >= '0' && c <= '9') {
    return c - '0';
  }
  const char lower = static_cast<char>(c | 0x20);
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

}  // namespace

int line_of(const YAML::Mark& mark) { return std::max(mark.line, 0) + 1; }

void ProfileEntry::refuse(std::string_view remedy) const {
  const bool shown = node.IsScalar() && is_short_ascii(node.Scalar());
  throw Error(Fault::input,
              fmt::format("{}: line {}: '{}'{}: {}", file.string(), line_of(node.Mark()), key,
                          shown ? fmt::format(" = '{}'", node.Scalar()) : "", remedy));
}

std::string ProfileEntry::text() const {
  if (!node.IsScalar() || node.Scalar().empty() || !is_short_ascii(node.Scalar())) {
    refuse("give a text of at most 60 ASCII characters");
  }
  return node.Scalar();
}

double ProfileEntry::number(double least, double most) const {
  // Not yaml-cpp's conversion, which reads 1.500 as 1500 where the locale has decimal commas.
  const std::optional<double> value = node.IsScalar() ? number_of(node.Scalar()) : std::nullopt;
  if (!value || *value < least || *value > most) {
    refuse(fmt::format("give a number from {:g} to {:g}", least, most));
  }
  return *value;
}

std::uint32_t ProfileEntry::integer(std::uint32_t least, std::uint32_t most) const {
  std::string_view digits = node.IsScalar() ? std::string_view(node.Scalar()) : "";
  const bool hexadecimal = digits.starts_with("0x");
  digits.remove_prefix(hexadecimal ? 2 : 0);
  std::uint32_t value = 0;
  const auto [end, fault] =
      std::from_chars(digits.data(), digits.data() + digits.size(), value, hexadecimal ? 16 : 10);
  if (fault != std::errc() || end != digits.data() + digits.size() || value < least ||
      value > most) {
    refuse(fmt::format("give a whole number from {} to {}", least, most));
  }
  return value;
}

std::vector<std::uint8_t> ProfileEntry::bytes(std::size_t least) const {
  constexpr std::size_t most = 256;
  std::vector<std::uint8_t> bytes;
  std::string digits = node.IsScalar() ? node.Scalar() : "?";
  std::erase(digits, ' ');
  for (std::size_t i = 0; i < digits.size(); i += 2) {
    const int high = digit(digits[i]);
    const int low = i + 1 < digits.size() ? digit(digits[i + 1]) : -1;
    if (high < 0 || low < 0) {
      refuse("give bytes of two hexadecimal digits each, such as aa 55");
    }
    bytes.push_back(static_cast<std::uint8_t>(16 * high + low));
  }
  if (bytes.size() < least || bytes.size() > most) {
    refuse(fmt::format("give {} to {} bytes", least, most));
  }
  return bytes;
}

NumberType ProfileEntry::number_type() const {
  using Kind = NumberType::Kind;
  return one_of<NumberType>({{"u8", {Kind::unsigned_integer, 1, false}},
                             {"s8", {Kind::signed_integer, 1, false}},
                             {"u16le", {Kind::unsigned_integer, 2, false}},
                             {"u16be", {Kind::unsigned_integer, 2, true}},
                             {"s16le", {Kind::signed_integer, 2, false}},
                             {"s16be", {Kind::signed_integer, 2, true}},
                             {"u32le", {Kind::unsigned_integer, 4, false}},
                             {"u32be", {Kind::unsigned_integer, 4, true}},
                             {"s32le", {Kind::signed_integer, 4, false}},
                             {"s32be", {Kind::signed_integer, 4, true}},
                             {"f32le", {Kind::real, 4, false}},
                             {"f32be", {Kind::real, 4, true}}});
}

glm::dvec2 ProfileEntry::point() const {
  constexpr double most_mm = 1e4;
  const std::vector<ProfileEntry> xy = list("give [x, y]");
  if (xy.size() != 2) {
    refuse("give [x, y]");
  }
  return {xy[0].number(-most_mm, most_mm), xy[1].number(-most_mm, most_mm)};
}

std::vector<ProfileEntry> ProfileEntry::list(const char* remedy) const {
  if (!node.IsSequence()) {
    refuse(remedy);
  }
  std::vector<ProfileEntry> entries;
  for (const YAML::Node& item : node) {
    entries.push_back({file, fmt::format("{}[{}]", key, entries.size()), item});
  }
  return entries;
}

void read_keys(const ProfileEntry& map, const ProfileKeys& readers) {
  std::string known;
  for (const auto& [key, reader] : readers) {
    known += fmt::format("{}{}", known.empty() ? "" : ", ", key);
  }
  if (!map.node.IsMap()) {
    map.refuse(fmt::format("give a map with keys out of {}", known));
  }
  std::set<std::string_view> seen;
  for (const auto& item : map.node) {
    const ProfileEntry name{map.file, map.key, item.first};
    const auto found = std::find_if(readers.begin(), readers.end(), [&](const auto& entry) {
      return item.first.IsScalar() && entry.first == item.first.Scalar();
    });
    if (found == readers.end()) {
      name.refuse(fmt::format("unknown key; the keys are {}", known));
    }
    if (!seen.insert(found->first).second) {
      name.refuse("key given twice; remove one");
    }
    found->second({map.file, std::string(found->first), item.second});
  }
}

}  // namespace palpate
