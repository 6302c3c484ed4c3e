#include "options.hpp"

#include <charconv>
#include <cmath>
#include <numbers>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "atomic_file.hpp"
#include "palpate/error.hpp"

namespace palpate::cli {

namespace {

[[noreturn]] void refuse(const std::string& flag, const std::string& text,
                         const std::string& remedy) {
  throw Error(Fault::input, fmt::format("{} {}: {}", flag, text, remedy));
}

/// The numbers between the separators; none if the text is not a list of finite numbers.
template <typename Number>
std::optional<std::vector<Number>> split_numbers(const std::string& text, char separator) {
  std::vector<Number> numbers;
  const char* at = text.data();
  const char* const end = at + text.size();
  while (true) {
    Number number{};
    const auto [rest, error] = std::from_chars(at, end, number);
    if (error != std::errc{} || !std::isfinite(static_cast<double>(number))) {
      return {};
    }
    numbers.push_back(number);
    if (rest == end) {
      return numbers;
    }
    if (*rest != separator) {
      return {};
    }
    at = rest + 1;
  }
}

template <typename Number>
std::vector<Number> parse(const std::string& flag, const std::string& text, char separator,
                          std::size_t count, const char* form) {
  const auto numbers = split_numbers<Number>(text, separator);
  if (!numbers || numbers->size() != count) {
    refuse(flag, text, fmt::format("give it as {}", form));
  }
  return *numbers;
}

}  // namespace

std::array<double, 2> parse_range(const std::string& flag, const std::string& text) {
  const auto ends = parse<double>(flag, text, ':', 2, "LOWER:UPPER, such as -10:10");
  if (ends[0] > ends[1]) {
    refuse(flag, text, "the range is reversed; write the lower end first");
  }
  return {ends[0], ends[1]};
}

glm::dvec2 parse_point(const std::string& flag, const std::string& text) {
  const auto xy = parse<double>(flag, text, ',', 2, "X,Y in mm");
  return {xy[0], xy[1]};
}

Pose parse_pose(const std::string& flag, const std::string& text) {
  const auto values = parse<double>(flag, text, ',', 3, "X,Y,DEG, in mm and degrees");
  return {{values[0], values[1]}, radians(values[2])};
}

std::array<int, 3> parse_bins(const std::string& flag, const std::string& text) {
  const auto bins = parse<int>(flag, text, 'x', 3, "XxYxTHETA, such as 25x25x16, or auto");
  for (const int count : bins) {
    if (count < 1) {
      refuse(flag, text, "every count must be at least 1");
    }
  }
  return {bins[0], bins[1], bins[2]};
}

Frames parse_frames(const std::string& flag, const std::string& text) {
  const auto ends =
      parse<std::int64_t>(flag, text, ':', 2, "A:B, for the touches A to B - 1, counted from 0");
  if (ends[0] < 0 || ends[0] >= ends[1]) {
    refuse(flag, text, "selects no touch; give A:B with A from 0 and below B");
  }
  return {static_cast<std::size_t>(ends[0]), static_cast<std::size_t>(ends[1])};
}

double require_above(const std::string& flag, double value, double least, bool inclusive) {
  if (!std::isfinite(value) || value < least || (!inclusive && value == least)) {
    refuse(flag, fmt::format("{}", value),
           fmt::format("must be {} {}", inclusive ? "at least" : "above", least));
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

void write_file(const std::filesystem::path& file, std::string_view bytes) {
  AtomicFile target(file);
  target.write(bytes);
  target.commit();
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error || !std::filesystem::is_directory(folder)) {
    throw Error(Fault::input, fmt::format("{}: the folder cannot be made ({}); choose another name",
                                          folder.string(), error.message()));
  }
}

double degrees(double rad) { return rad * 180.0 / std::numbers::pi; }
double radians(double deg) { return deg * std::numbers::pi / 180.0; }

}  // namespace palpate::cli
