#include "options/option.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "model/number_text.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

using Counts = std::array<int, 3>;

template <typename Value>
using Named = std::pair<Value, const char*>;

/// The words that a value of the type is one of.
template <typename Value>
constexpr std::array<Named<Value>, 0> words{};
template <>
constexpr std::array<Named<bool>, 2> words<bool>{{{true, "true"}, {false, "false"}}};
template <>
constexpr std::array<Named<Automatic>, 1> words<Automatic>{{{Automatic{}, "auto"}}};
template <>
constexpr std::array<Named<BinWidth>, 2> words<BinWidth>{
    {{BinWidth::automatic, "auto"}, {BinWidth::fine, "fine"}}};
template <>
constexpr std::array<Named<FilterKind>, 4> words<FilterKind>{
    {{FilterKind::automatic, "auto"},
     {FilterKind::histogram, "histogram"},
     {FilterKind::bounded, "bounded"},
     {FilterKind::particles, "particles"}}};
template <>
constexpr std::array<Named<Resampling>, 2> words<Resampling>{
    {{Resampling::multinomial, "multinomial"}, {Resampling::systematic, "systematic"}}};

template <typename Value>
concept Word = !words<Value>.empty();
template <typename Value>
concept Number = std::is_arithmetic_v<Value> && !std::is_same_v<Value, bool>;

/// The character between a value's numbers; none for a value of one number.
template <typename Value>
constexpr std::optional<char> separator = {};
template <>
constexpr std::optional<char> separator<Range> = ':';
template <>
constexpr std::optional<char> separator<Frames> = ':';
template <>
constexpr std::optional<char> separator<Counts> = 'x';
template <>
constexpr std::optional<char> separator<glm::dvec2> = ',';
template <typename Numbers, typename Other>
constexpr std::optional<char> separator<std::variant<Numbers, Other>> = separator<Numbers>;
template <typename Value>
constexpr std::optional<char> separator<std::optional<Value>> = separator<Value>;

/// What a refusal says to give.
template <typename Value>
constexpr const char* wanted = "a text";
template <Number Value>
constexpr const char* wanted<Value> = std::is_integral_v<Value> ? "a whole number" : "a number";
template <>
constexpr const char* wanted<bool> = "true or false";
template <>
constexpr const char* wanted<Range> = "LOWER:UPPER, such as -10:10";
template <>
constexpr const char* wanted<Bins> = "XxYxTHETA, such as 25x25x16, or auto, or fine";
template <>
constexpr const char* wanted<Pivot> = "X,Y in mm, or auto";
template <>
constexpr const char* wanted<NoneWeight> = "a weight from 0, or auto";
template <>
constexpr const char* wanted<Frames> = "A:B, for the touches A to B - 1, counted from 0";
template <>
constexpr const char* wanted<FilterKind> = "auto, histogram, bounded or particles";
template <>
constexpr const char* wanted<Resampling> = "multinomial or systematic";
template <typename Value>
constexpr const char* wanted<std::optional<Value>> = wanted<Value>;

/// The `count` finite numbers that make up the text, with this character between them.
template <typename Value, std::size_t count>
std::optional<std::array<Value, count>> numbers_of(const std::string& text, char between) {
  const std::vector<std::string_view> parts = split_text(text, between);
  std::array<Value, count> numbers{};
  for (std::size_t i = 0; i < count; ++i) {
    const auto number = parts.size() == count ? detail::all_of<Value>(parts[i]) : std::nullopt;
    if (!number || !std::isfinite(static_cast<double>(*number))) {
      return {};
    }
    numbers[i] = *number;
  }
  return numbers;
}

// read() sets the value by its text, or returns false; text_of() is the text that read() reads.

bool read(const std::string& text, std::string& value) {
  value = text;
  return true;
}
std::string text_of(const std::string& text) { return text; }

template <Word Value>
bool read(const std::string& text, Value& value) {
  for (const auto& [known, word] : words<Value>) {
    if (text == word) {
      value = known;
      return true;
    }
  }
  return false;
}
std::string text_of(bool value) { return value ? "true" : ""; }
template <Word Value>
std::string text_of(Value value) {
  return std::ranges::find(words<Value>, value, &Named<Value>::first)->second;
}

template <Number Value>
bool read(const std::string& text, Value& value) {
  const std::optional<Value> number = detail::all_of<Value>(text);
  value = number.value_or(Value{});
  return number && std::isfinite(static_cast<double>(value));
}
template <Number Value>
std::string text_of(Value number) {
  return fmt::format("{}", number);
}

template <typename Value, std::size_t count>
bool read(const std::string& text, std::array<Value, count>& value) {
  const auto numbers = numbers_of<Value, count>(text, *separator<std::array<Value, count>>);
  value = numbers.value_or(value);
  return numbers.has_value();
}
template <typename Value, std::size_t count>
std::string text_of(const std::array<Value, count>& numbers) {
  return fmt::format("{}",
                     fmt::join(numbers, std::string(1, *separator<std::array<Value, count>>)));
}

bool read(const std::string& text, glm::dvec2& value) {
  const auto xy = numbers_of<double, 2>(text, *separator<glm::dvec2>);
  value = xy ? glm::dvec2((*xy)[0], (*xy)[1]) : value;
  return xy.has_value();
}
std::string text_of(const glm::dvec2& point) { return fmt::format("{},{}", point.x, point.y); }

bool read(const std::string& text, Frames& value) {
  const auto ends = numbers_of<std::int64_t, 2>(text, *separator<Frames>);
  if (!ends || (*ends)[0] < 0 || (*ends)[1] < 0) {
    return false;
  }
  value = {static_cast<std::size_t>((*ends)[0]), static_cast<std::size_t>((*ends)[1])};
  return true;
}
std::string text_of(const Frames& frames) { return fmt::format("{}:{}", frames.begin, frames.end); }

template <typename Numbers, typename Other>
bool read(const std::string& text, std::variant<Numbers, Other>& value) {
  return read(text, value.template emplace<Other>()) ||
         read(text, value.template emplace<Numbers>());
}
template <typename Numbers, typename Other>
std::string text_of(const std::variant<Numbers, Other>& value) {
  return std::visit([](const auto& one) { return text_of(one); }, value);
}

template <typename Value>
bool read(const std::string& text, std::optional<Value>& value) {
  return read(text, value.emplace());
}
template <typename Value>
std::string text_of(const std::optional<Value>& value) {
  return value ? text_of(*value) : "";
}

/// " from 0 to 1", " above 0, below 1".
std::string words_of(const NumberLimits& limits) {
  std::string words;
  if (limits.least > -NumberLimits::infinity) {
    words += fmt::format(" {} {}", limits.with_least ? "from" : "above", limits.least);
  }
  if (limits.most < NumberLimits::infinity) {
    words += fmt::format("{} {}", limits.with_most ? " to" : ", below", limits.most);
  }
  return words;
}

bool within(const NumberLimits& limits, double number) {
  return (limits.with_least ? number >= limits.least : number > limits.least) &&
         (limits.with_most ? number <= limits.most : number < limits.most) && std::isfinite(number);
}

// fault() says what to give in the place of a value that was read but cannot be meant, or "".

template <typename Value>
std::string fault(const NumberLimits& /*limits*/, const Value& /*value*/) {
  return "";
}
template <Number Value>
std::string fault(const NumberLimits& limits, const Value& number) {
  return within(limits, static_cast<double>(number)) ? "" : wanted<Value> + words_of(limits);
}
std::string fault(const NumberLimits& limits, const Range& range) {
  const auto [lower, upper] = range;
  if (!within(limits, lower) || !within(limits, upper)) {
    return fmt::format("numbers within +-{:g}", limits.most);
  }
  return lower > upper ? "the lower end first: the range is reversed" : "";
}
std::string fault(const NumberLimits& limits, const Counts& counts) {
  return std::ranges::min(counts) >= limits.least ? "" : "at least 1 for every count";
}
std::string fault(const NumberLimits& limits, const glm::dvec2& point) {
  return within(limits, point.x) && within(limits, point.y)
             ? ""
             : fmt::format("numbers within +-{:g}", limits.most);
}
std::string fault(const NumberLimits& limits, const NoneWeight& none) {
  const auto* weight = std::get_if<double>(&none);
  return weight == nullptr || within(limits, *weight) ? "" : wanted<NoneWeight>;
}
std::string fault(const NumberLimits& /*limits*/, const Frames& frames) {
  return frames.begin < frames.end ? "" : "A:B with A from 0 and below B: this selects no touch";
}
template <typename Numbers, typename Other>
std::string fault(const NumberLimits& limits, const std::variant<Numbers, Other>& value) {
  return std::visit([&](const auto& one) { return fault(limits, one); }, value);
}
template <typename Value>
std::string fault(const NumberLimits& limits, const std::optional<Value>& value) {
  return value ? fault(limits, *value) : "";
}

template <typename Value>
std::string wanted_within(const NumberLimits& /*limits*/, const Value& /*value*/) {
  return wanted<Value>;
}
template <Number Value>
std::string wanted_within(const NumberLimits& limits, const std::optional<Value>& /*value*/) {
  return wanted<Value> + words_of(limits);
}

/// What to give in the place of the value that the request has, or "".
std::string fault_of(const Request& request, const Option& option) {
  const std::string wanted =
      std::visit([&](auto member) { return fault(option.limits, request.*member); }, option.member);
  return wanted.empty() ? "" : "give " + wanted;
}

}  // namespace

std::string set_option(Request& request, const Option& option, const std::string& text) {
  return std::visit(
      [&](auto member) -> std::string {
        const auto before = request.*member;
        std::string fault = read(text, request.*member)
                                ? fault_of(request, option)
                                : "give " + wanted_within(option.limits, before);
        if (!fault.empty()) {
          request.*member = before;
        }
        return fault;
      },
      option.member);
}

std::string option_text(const Request& request, const Option& option) {
  return std::visit([&](auto member) { return text_of(request.*member); }, option.member);
}

const Option& option_named(std::string_view name) {
  const auto found = std::ranges::find(options(), name, &Option::name);
  if (found == options().end()) {
    refuse_option(name, "no option has this name");
  }
  return *found;
}

std::string_view first_given(const Request& request,
                             std::initializer_list<std::string_view> options) {
  const auto* given = std::ranges::find_if(options, [&](std::string_view name) {
    return !option_text(request, option_named(name)).empty();
  });
  return given == options.end() ? "" : *given;
}

void require_sound(const Request& request) {
  for (const Option& option : options()) {
    if (const std::string fault = fault_of(request, option); !fault.empty()) {
      refuse_option(option.name, option_text(request, option), "{}", fault);
    }
  }
}

std::string origin_of_option(const Request& request, std::string_view name) {
  const Option& option = option_named(name);
  const std::string text = option_text(request, option);
  const auto key = request.keys.find(option.name);
  return key == request.keys.end() ? fmt::format("`{} {}`", name, text)
                                   : fmt::format("{}: {} in {}", key->second, text, request.scene);
}

std::map<std::string, std::string> option_texts(const Request& request) {
  std::map<std::string, std::string> texts;
  for (const Option& option : options()) {
    std::string text = option_text(request, option);
    if (!text.empty() && std::string_view(option.name) != "device") {
      texts[option.name] = std::move(text);
    }
  }
  return texts;
}

Request request_with(const std::map<std::string, std::string>& texts) {
  Request request;
  for (const auto& [name, text] : texts) {
    const auto option = std::ranges::find(options(), name, &Option::name);
    if (option == options().end()) {
      throw Error(Fault::input, "has options that are not known; use a newer palpate");
    }
    const std::string fault = set_option(request, *option, text);
    if (!fault.empty()) {
      refuse_option(name, text, "{}", fault);
    }
  }
  return request;
}

std::string name_of(FilterKind kind) { return text_of(kind); }

std::optional<char> separator_of(const Option& option) {
  return std::visit([]<typename Value>(Value Request::* /*member*/) { return separator<Value>; },
                    option.member);
}

Pose parse_pose(std::string_view option, const std::string& text) {
  const auto numbers = numbers_of<double, 3>(text, *separator<glm::dvec2>);
  if (!numbers ||
      std::ranges::any_of(*numbers, [](double n) { return std::abs(n) > farthest_mm; })) {
    refuse_option(option, text, "give it as X,Y,DEG, in mm and degrees, within +-{:g}",
                  farthest_mm);
  }
  const auto [x, y, deg] = *numbers;
  return {{x, y}, deg * std::numbers::pi / 180.0};
}

Frames parse_frames(const std::string& what, const std::string& text) {
  Frames frames;
  std::string remedy = read(text, frames) ? fault({}, frames) : wanted<Frames>;
  if (!remedy.empty()) {
    throw Error(Fault::input, fmt::format("{} {}: give {}", what, text, remedy));
  }
  return frames;
}

}  // namespace palpate
