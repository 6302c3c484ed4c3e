#include "options/option.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "model/number_text.hpp"
#include "options/refused_option.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

template <typename Value>
using Words = std::vector<std::pair<Value, const char*>>;

const Words<FilterKind> filter_words{{FilterKind::automatic, "auto"},
                                     {FilterKind::histogram, "histogram"},
                                     {FilterKind::bounded, "bounded"},
                                     {FilterKind::particles, "particles"}};
const Words<Resampling> resampling_words{{Resampling::multinomial, "multinomial"},
                                         {Resampling::systematic, "systematic"}};
const Words<BinWidth> bin_words{{BinWidth::automatic, "auto"}, {BinWidth::fine, "fine"}};

template <typename Value>
std::string word_of(const Words<Value>& words, Value value) {
  return std::ranges::find(words, value, &std::pair<Value, const char*>::first)->second;
}

template <typename Value>
std::optional<Value> value_of(const Words<Value>& words, const std::string& word) {
  for (const auto& [value, name] : words) {
    if (word == name) {
      return value;
    }
  }
  return {};
}

/// The `count` finite numbers between the separators, which are all of the text.
template <typename Number, std::size_t count>
std::optional<std::array<Number, count>> numbers_of(const std::string& text, char separator) {
  const std::vector<std::string_view> parts = split_text(text, separator);
  std::array<Number, count> numbers{};
  for (std::size_t i = 0; i < count; ++i) {
    const auto number = parts.size() == count ? detail::all_of<Number>(parts[i]) : std::nullopt;
    if (!number || !std::isfinite(static_cast<double>(*number))) {
      return {};
    }
    numbers[i] = *number;
  }
  return numbers;
}

constexpr char range_separator = ':';
constexpr char bins_separator = 'x';
constexpr char point_separator = ',';

// read() sets the value by its text, or returns false. wanted() says what texts the value has.

bool read(const std::string& text, std::string& value) {
  value = text;
  return true;
}
std::string wanted(const std::string& /*value*/) { return "a text"; }

bool read(const std::string& text, bool& value) {
  value = text == "true";
  return value || text == "false";
}
std::string wanted(bool /*value*/) { return "true or false"; }

template <typename Number>
requires std::is_arithmetic_v<Number>
bool read(const std::string& text, Number& value) {
  const std::optional<Number> number = detail::all_of<Number>(text);
  value = number.value_or(Number{});
  return number && std::isfinite(static_cast<double>(value));
}
template <typename Number>
requires std::is_arithmetic_v<Number> std::string wanted(Number /*value*/) {
  return std::is_integral_v<Number> ? "a whole number" : "a number";
}

bool read(const std::string& text, Range& value) {
  const auto ends = numbers_of<double, 2>(text, range_separator);
  value = ends.value_or(Range{});
  return ends.has_value();
}
std::string wanted(const Range& /*value*/) { return "LOWER:UPPER, such as -10:10"; }

bool read(const std::string& text, Bins& value) {
  const auto counts = numbers_of<int, 3>(text, bins_separator);
  const auto width = value_of(bin_words, text);
  value = width ? Bins(*width) : Bins(counts.value_or(std::array<int, 3>{}));
  return counts || width;
}
std::string wanted(const Bins& /*value*/) {
  return "XxYxTHETA, such as 25x25x16, or auto, or fine";
}

bool read(const std::string& text, Pivot& value) {
  const auto xy = numbers_of<double, 2>(text, point_separator);
  value = xy ? Pivot(glm::dvec2((*xy)[0], (*xy)[1])) : Pivot(Automatic{});
  return xy || text == "auto";
}
std::string wanted(const Pivot& /*value*/) { return "X,Y in mm, or auto"; }

bool read(const std::string& text, NoneWeight& value) {
  const std::optional<double> weight = number_of(text);
  value = weight ? NoneWeight(*weight) : NoneWeight(Automatic{});
  return weight || text == "auto";
}
std::string wanted(const NoneWeight& /*value*/) { return "a weight from 0, or auto"; }

bool read(const std::string& text, Frames& value) {
  const auto ends = numbers_of<std::int64_t, 2>(text, range_separator);
  if (!ends || (*ends)[0] < 0 || (*ends)[1] < 0) {
    return false;
  }
  value = {static_cast<std::size_t>((*ends)[0]), static_cast<std::size_t>((*ends)[1])};
  return true;
}
std::string wanted(const Frames& /*value*/) {
  return "A:B, for the touches A to B - 1, counted from 0";
}

template <typename Value>
bool read_word(const Words<Value>& words, const std::string& text, Value& value) {
  const std::optional<Value> known = value_of(words, text);
  value = known.value_or(words.front().first);
  return known.has_value();
}
bool read(const std::string& text, FilterKind& value) {
  return read_word(filter_words, text, value);
}
std::string wanted(FilterKind /*value*/) { return "auto, histogram, bounded or particles"; }
bool read(const std::string& text, Resampling& value) {
  return read_word(resampling_words, text, value);
}
std::string wanted(Resampling /*value*/) { return "multinomial or systematic"; }

// The texts that read() reads.
std::string text_of(const std::string& text) { return text; }
std::string text_of(bool value) { return value ? "true" : ""; }
template <typename Number>
requires std::is_arithmetic_v<Number> std::string text_of(Number number) {
  return fmt::format("{}", number);
}
std::string text_of(const Range& range) { return fmt::format("{}:{}", range[0], range[1]); }
std::string text_of(const std::array<int, 3>& counts) {
  return fmt::format("{}x{}x{}", counts[0], counts[1], counts[2]);
}
std::string text_of(const glm::dvec2& point) { return fmt::format("{},{}", point.x, point.y); }
std::string text_of(const Frames& frames) { return fmt::format("{}:{}", frames.begin, frames.end); }
std::string text_of(Automatic /*word*/) { return "auto"; }
std::string text_of(BinWidth width) { return word_of(bin_words, width); }
std::string text_of(FilterKind kind) { return word_of(filter_words, kind); }
std::string text_of(Resampling resampling) { return word_of(resampling_words, resampling); }
template <typename... Values>
std::string text_of(const std::variant<Values...>& value) {
  return std::visit([](const auto& one) { return text_of(one); }, value);
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
requires(!std::is_arithmetic_v<Value> || std::is_same_v<Value, bool>) std::string
    fault(const NumberLimits& /*limits*/, const Value& /*value*/) {
  return "";
}
template <typename Number>
requires(std::is_arithmetic_v<Number> && !std::is_same_v<Number, bool>) std::string
    fault(const NumberLimits& limits, Number number) {
  return within(limits, static_cast<double>(number)) ? "" : wanted(number) + words_of(limits);
}
std::string fault(const NumberLimits& limits, const Range& range) {
  const auto [lower, upper] = range;
  if (!within(limits, lower) || !within(limits, upper)) {
    return fmt::format("numbers within +-{:g}", limits.most);
  }
  return lower > upper ? "the lower end first: the range is reversed" : "";
}
std::string fault(const NumberLimits& limits, const Bins& bins) {
  const auto* counts = std::get_if<std::array<int, 3>>(&bins);
  return counts == nullptr || std::ranges::min(*counts) >= limits.least
             ? ""
             : "at least 1 for every count";
}
std::string fault(const NumberLimits& limits, const Pivot& pivot) {
  const auto* xy = std::get_if<glm::dvec2>(&pivot);
  return xy == nullptr || (within(limits, xy->x) && within(limits, xy->y))
             ? ""
             : fmt::format("numbers within +-{:g}", limits.most);
}
std::string fault(const NumberLimits& limits, const NoneWeight& none) {
  const auto* weight = std::get_if<double>(&none);
  return weight == nullptr || within(limits, *weight) ? "" : wanted(none);
}
std::string fault(const NumberLimits& /*limits*/, const Frames& frames) {
  return frames.begin < frames.end ? "" : "A:B with A from 0 and below B: this selects no touch";
}
template <typename Value>
std::string fault(const NumberLimits& limits, const std::optional<Value>& value) {
  return value ? fault(limits, *value) : "";
}

template <typename Value>
bool read(const std::string& text, std::optional<Value>& value) {
  return read(text, value.emplace());
}
template <typename Value>
std::string wanted(const std::optional<Value>& /*value*/) {
  return wanted(Value{});
}

template <typename Value>
std::string wanted_within(const NumberLimits& /*limits*/, const Value& value) {
  return wanted(value);
}
template <typename Number>
requires std::is_arithmetic_v<Number> std::string wanted_within(
    const NumberLimits& limits, const std::optional<Number>& /*value*/) {
  return wanted(Number{}) + words_of(limits);
}

/// What to give in the place of the value that the request has, or "".
std::string fault_of(const Request& request, const Option& option) {
  const std::string wanted =
      std::visit([&](auto member) { return fault(option.limits, request.*member); }, option.member);
  return wanted.empty() ? "" : "give " + wanted;
}

template <typename Value>
constexpr std::optional<char> separator = {};
template <>
constexpr std::optional<char> separator<std::optional<Bins>> = bins_separator;
template <>
constexpr std::optional<char> separator<std::optional<Range>> = range_separator;
template <>
constexpr std::optional<char> separator<std::optional<Frames>> = range_separator;
template <>
constexpr std::optional<char> separator<std::optional<Pivot>> = point_separator;

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

std::string name_of(FilterKind kind) { return word_of(filter_words, kind); }

std::optional<char> separator_of(const Option& option) {
  return std::visit([]<typename Value>(Value Request::* /*member*/) { return separator<Value>; },
                    option.member);
}

Pose parse_pose(std::string_view option, const std::string& text) {
  const auto numbers = numbers_of<double, 3>(text, point_separator);
  if (!numbers) {
    refuse_option(option, text, "give it as X,Y,DEG, in mm and degrees");
  }
  const auto [x, y, deg] = *numbers;
  return {{x, y}, deg * std::numbers::pi / 180.0};
}

Frames parse_frames(const std::string& what, const std::string& text) {
  Frames frames;
  std::string remedy = read(text, frames) ? fault({}, frames) : wanted(frames);
  if (!remedy.empty()) {
    throw Error(Fault::input, fmt::format("{} {}: give {}", what, text, remedy));
  }
  return frames;
}

}  // namespace palpate
