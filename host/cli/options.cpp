#include "cli/options.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <system_error>

namespace palpate::cli {

namespace {

/// The `count` finite numbers between the separators, which are all of the text.
template <typename Number, std::size_t count>
std::array<Number, count> parse(const std::string& flag, const std::string& text, char separator,
                                const char* form) {
  std::array<Number, count> numbers{};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t i = 0; i < count; ++i) {
    const auto [rest, error] = std::from_chars(at, end, numbers[i]);
    const bool followed = i + 1 < count ? rest != end && *rest == separator : rest == end;
    if (error != std::errc{} || !std::isfinite(static_cast<double>(numbers[i])) || !followed) {
      refuse_flag(flag, text, "give it as {}", form);
    }
    at = rest + 1;
  }
  return numbers;
}

}  // namespace

std::array<double, 2> parse_range(const std::string& flag, const std::string& text) {
  const auto ends = parse<double, 2>(flag, text, ':', "LOWER:UPPER, such as -10:10");
  if (ends[0] > ends[1]) {
    refuse_flag(flag, text, "the range is reversed; write the lower end first");
  }
  return ends;
}

glm::dvec2 parse_point(const std::string& flag, const std::string& text) {
  const auto [x, y] = parse<double, 2>(flag, text, ',', "X,Y in mm");
  return {x, y};
}

Pose parse_pose(const std::string& flag, const std::string& text) {
  const auto [x, y, deg] = parse<double, 3>(flag, text, ',', "X,Y,DEG, in mm and degrees");
  return {{x, y}, radians(deg)};
}

std::array<int, 3> parse_bins(const std::string& flag, const std::string& text) {
  const auto bins = parse<int, 3>(flag, text, 'x', "XxYxTHETA, such as 25x25x16, or auto, or fine");
  if (std::ranges::min(bins) < 1) {
    refuse_flag(flag, text, "every count must be at least 1");
  }
  return bins;
}

Frames parse_frames(const std::string& flag, const std::string& text) {
  const auto [begin, end] =
      parse<std::int64_t, 2>(flag, text, ':', "A:B, for the touches A to B - 1, counted from 0");
  if (begin < 0 || begin >= end) {
    refuse_flag(flag, text, "selects no touch; give A:B with A from 0 and below B");
  }
  return {static_cast<std::size_t>(begin), static_cast<std::size_t>(end)};
}

double require_above(const std::string& flag, double value, double least, bool inclusive) {
  if (!std::isfinite(value) || value < least || (!inclusive && value == least)) {
    refuse_flag(flag, value, "must be {} {}", inclusive ? "at least" : "above", least);
  }
  return value;
}

std::string require_whole_number(const std::string& text) {
  std::uint64_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  const bool octal = text.size() > 1 && text.front() == '0';
  return error == std::errc{} && rest == end && !octal
             ? ""
             : fmt::format("{}: give a whole number, such as 10", text);
}

void require_writable(const std::filesystem::path& file) { const AtomicFile probe(file); }

void write_file(const std::filesystem::path& file, std::string_view bytes,
                AtomicFile::Links links) {
  AtomicFile target(file, links);
  target.write(bytes);
  target.commit();
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error || !std::filesystem::is_directory(folder)) {
    refuse(folder, "the folder cannot be made ({}); choose another name", error.message());
  }
}

double degrees(double rad) { return rad * 180.0 / std::numbers::pi; }
double radians(double deg) { return deg * std::numbers::pi / 180.0; }

}  // namespace palpate::cli
