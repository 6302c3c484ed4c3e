#include "recognition/option_text.hpp"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <system_error>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include "model/number_text.hpp"
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

// The texts that read_option() reads.
std::string text_of(const std::string& text) { return text; }
std::string text_of(bool value) { return value ? "true" : ""; }
template <typename Number>
requires std::is_arithmetic_v<Number> std::string text_of(Number number) {
  return fmt::format("{}", number);
}
std::string text_of(const std::array<double, 2>& range) {
  return fmt::format("{}:{}", range[0], range[1]);
}
std::string text_of(const std::array<int, 3>& counts) {
  return fmt::format("{}x{}x{}", counts[0], counts[1], counts[2]);
}
std::string text_of(const glm::dvec2& point) { return fmt::format("{},{}", point.x, point.y); }
std::string text_of(const Frames& frames) { return fmt::format("{}:{}", frames.begin, frames.end); }
std::string text_of(Automatic /*word*/) { return "auto"; }
std::string text_of(BinWidth width) { return width == BinWidth::fine ? "fine" : "auto"; }
std::string text_of(FilterKind kind) { return name_of(kind); }
std::string text_of(Resampling resampling) {
  return resampling == Resampling::systematic ? "systematic" : "multinomial";
}
template <typename... Values>
std::string text_of(const std::variant<Values...>& value) {
  return std::visit([](const auto& one) { return text_of(one); }, value);
}
template <typename Value>
std::string text_of(const std::optional<Value>& value) {
  return value ? text_of(*value) : "";
}

}  // namespace

Pose parse_pose(const std::string& what, const std::string& text) {
  const auto [x, y, deg] = parse<double, 3>(what, text, ',', "X,Y,DEG, in mm and degrees");
  return {{x, y}, deg * std::numbers::pi / 180.0};
}

void read_option(const std::string& /*what*/, const std::string& text, std::string& value) {
  value = text;
}

void read_option(const std::string& what, const std::string& text, double& value) {
  value = parse<double, 1>(what, text, ' ', "a number")[0];
}

void read_option(const std::string& what, const std::string& text, int& value) {
  value = parse<int, 1>(what, text, ' ', "a whole number")[0];
}

void read_option(const std::string& what, const std::string& text, std::uint64_t& value) {
  value = parse<std::uint64_t, 1>(what, text, ' ', "a whole number")[0];
}

void read_option(const std::string& what, const std::string& text, bool& value) {
  if (text != "true" && text != "false") {
    refuse_text(what, text, "give true or false");
  }
  value = text == "true";
}

void read_option(const std::string& what, const std::string& text, std::array<double, 2>& value) {
  value = parse<double, 2>(what, text, ':', "LOWER:UPPER, such as -10:10");
}

void read_option(const std::string& what, const std::string& text, Frames& value) {
  const auto [begin, end] =
      parse<std::int64_t, 2>(what, text, ':', "A:B, for the touches A to B - 1, counted from 0");
  if (begin < 0 || begin >= end) {
    refuse_text(what, text, "selects no touch; give A:B with A from 0 and below B");
  }
  value = {static_cast<std::size_t>(begin), static_cast<std::size_t>(end)};
}

void read_option(const std::string& what, const std::string& text, Bins& value) {
  if (text == "auto" || text == "fine") {
    value = text == "fine" ? BinWidth::fine : BinWidth::automatic;
  } else {
    value = parse<int, 3>(what, text, 'x', "XxYxTHETA, such as 25x25x16, or auto, or fine");
  }
}

void read_option(const std::string& what, const std::string& text, Pivot& value) {
  if (text == "auto") {
    value = Automatic{};
  } else {
    const auto [x, y] = parse<double, 2>(what, text, ',', "X,Y in mm, or auto");
    value = glm::dvec2(x, y);
  }
}

void read_option(const std::string& what, const std::string& text, NoneWeight& value) {
  if (text == "auto") {
    value = Automatic{};
    return;
  }
  const std::optional<double> weight = number_of(text);
  if (!weight || !(*weight >= 0.0)) {
    refuse_text(what, text, "give a weight from 0, or no value");
  }
  value = *weight;
}

void read_option(const std::string& /*what*/, const std::string& text, FilterKind& value) {
  value = filter_named(text);
}

void read_option(const std::string& /*what*/, const std::string& text, Resampling& value) {
  value = resampling_named(text);
}

std::map<std::string, std::string> option_texts(const Request& request) {
  std::map<std::string, std::string> texts;
  visit_options(request, [&](const char* option, const auto& value) {
    if (std::string text = text_of(value); !text.empty()) {
      texts[option] = std::move(text);
    }
  });
  return texts;
}

Request request_with(const std::map<std::string, std::string>& texts) {
  Request request;
  std::size_t known = 0;
  visit_options(request, [&](const char* option, auto& value) {
    if (const auto found = texts.find(option); found != texts.end()) {
      read_option(fmt::format("`{}`", option), found->second, value);
      ++known;
    }
  });
  if (known < texts.size()) {
    throw Error(Fault::input, "has options that are not known; use a newer palpate");
  }
  return request;
}

}  // namespace palpate
