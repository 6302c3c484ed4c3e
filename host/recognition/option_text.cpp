#include "recognition/option_text.hpp"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <system_error>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

namespace {

[[noreturn]] void refuse_text(const std::string& what, const std::string& text,
                              const std::string& remedy) {
  throw Error(Fault::input, fmt::format("{} {}: {}", what, text, remedy));
}

/// The `count` finite numbers between the separators, which are all of the text.
template <typename Number, std::size_t count>
std::array<Number, count> parse(const std::string& what, const std::string& text, char separator,
                                const char* form) {
  std::array<Number, count> numbers{};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t i = 0; i < count; ++i) {
    const auto [rest, error] = std::from_chars(at, end, numbers[i]);
    const bool followed = i + 1 < count ? rest != end && *rest == separator : rest == end;
    if (error != std::errc{} || !std::isfinite(static_cast<double>(numbers[i])) || !followed) {
      refuse_text(what, text, fmt::format("give it as {}", form));
    }
    at = rest + 1;
  }
  return numbers;
}

}  // namespace

std::array<double, 2> parse_range(const std::string& what, const std::string& text) {
  return parse<double, 2>(what, text, ':', "LOWER:UPPER, such as -10:10");
}

glm::dvec2 parse_point(const std::string& what, const std::string& text) {
  const auto [x, y] = parse<double, 2>(what, text, ',', "X,Y in mm");
  return {x, y};
}

Pose parse_pose(const std::string& what, const std::string& text) {
  const auto [x, y, deg] = parse<double, 3>(what, text, ',', "X,Y,DEG, in mm and degrees");
  return {{x, y}, deg * std::numbers::pi / 180.0};
}

std::array<int, 3> parse_bins(const std::string& what, const std::string& text) {
  return parse<int, 3>(what, text, 'x', "XxYxTHETA, such as 25x25x16, or auto, or fine");
}

Frames parse_frames(const std::string& what, const std::string& text) {
  const auto [begin, end] =
      parse<std::int64_t, 2>(what, text, ':', "A:B, for the touches A to B - 1, counted from 0");
  if (begin < 0 || begin >= end) {
    refuse_text(what, text, "selects no touch; give A:B with A from 0 and below B");
  }
  return {static_cast<std::size_t>(begin), static_cast<std::size_t>(end)};
}

}  // namespace palpate
