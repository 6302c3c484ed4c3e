#include "io/table_columns.hpp"

#include <array>
#include <chrono>
#include <cmath>
#include <utility>

#include "model/printable.hpp"

namespace palpate {

namespace {

constexpr double day_s = 86400.0;

/// Takes numbers of this form, 0 for each digit, from the front of the text; none where it begins
/// otherwise.
std::optional<std::array<int, 3>> take_numbers(std::string_view& text, std::string_view form) {
  std::array<int, 3> numbers{};
  std::size_t at = 0;
  for (std::size_t i = 0; i < form.size(); ++i) {
    const char c = i < text.size() ? text[i] : '\0';
    const bool is_digit = c >= '0' && c <= '9';
    if (form[i] == '0' ? !is_digit : c != form[i]) {
      return {};
    }
    at += is_digit ? 0 : 1;
    numbers[at] = is_digit ? 10 * numbers[at] + (c - '0') : 0;
  }
  text.remove_prefix(form.size());
  return numbers;
}

bool take(std::string_view& text, std::string_view any_of) {
  const bool found = !text.empty() && any_of.find(text.front()) != any_of.npos;
  text.remove_prefix(found ? 1 : 0);
  return found;
}

/// Takes HH:MM or HH:MM:SS with a fraction; none where the text does not begin with it.
std::optional<double> take_clock(std::string_view& text) {
  const auto hours_minutes = take_numbers(text, "00:00");
  const auto whole = take_numbers(text, ":00");
  double seconds = whole ? (*whole)[1] : 0.0;
  if (whole && take(text, ".,")) {
    for (double unit = 0.1; !text.empty() && text.front() >= '0' && text.front() <= '9';
         unit /= 10.0) {
      seconds += unit * (text.front() - '0');
      text.remove_prefix(1);
    }
  }
  constexpr double leap_second = 61.0;
  const auto [hours, minutes, none] = hours_minutes.value_or(std::array{25, 0, 0});
  const bool is_time = hours <= 24 && minutes <= 59 && seconds < leap_second;
  return is_time ? std::optional(hours * 3600.0 + minutes * 60.0 + seconds) : std::nullopt;
}

/// Takes YYYY-MM-DD, or DD.MM.YYYY; the seconds of its midnight since the Unix epoch. None, and
/// nothing is taken, where the text does not begin with a date.
std::optional<double> take_date(std::string_view& text) {
  std::string_view rest = text;
  auto numbers = take_numbers(rest, "0000-00-00");
  numbers = numbers ? numbers : take_numbers(rest, "0000/00/00");
  if (!numbers) {
    numbers = take_numbers(rest, "00.00.0000");
    if (!numbers) {
      return {};
    }
    std::swap((*numbers)[0], (*numbers)[2]);
  }
  using namespace std::chrono;
  const year_month_day date{year((*numbers)[0]), month((*numbers)[1]), day((*numbers)[2])};
  if (!date.ok()) {
    return {};
  }
  text = rest;
  return day_s * sys_days(date).time_since_epoch().count();
}

/// Seconds of a date and time by ISO 8601, such as 2026-11-29T12:41:27.5+01:00, since the Unix
/// epoch (without an offset as of UTC), or of a time of day, such as 12:41:27,5, since midnight;
/// none where the text is neither.
/// @param of_day gets whether it is a time of day
std::optional<double> clock_time_of(std::string_view text, bool& of_day) {
  const auto midnight_s = take_date(text);
  of_day = !midnight_s;
  if (midnight_s && !take(text, "Tt _-")) {
    return {};
  }
  const auto clock_s = take_clock(text);
  if (!clock_s) {
    return {};
  }
  double offset_s = 0.0;
  if (midnight_s && !take(text, "Zz")) {
    const bool behind = text.starts_with('-');
    if (take(text, "+-")) {
      const auto hours = take_numbers(text, "00");
      take(text, ":");
      const auto minutes = take_numbers(text, "00").value_or(std::array{0, 0, 0});
      if (!hours) {
        return {};
      }
      offset_s = ((*hours)[0] * 3600.0 + minutes[0] * 60.0) * (behind ? -1.0 : 1.0);
    }
  }
  return text.empty() ? std::optional(midnight_s.value_or(0.0) + *clock_s - offset_s)
                      : std::nullopt;
}

}  // namespace

double TableTimes::next(std::size_t row) {
  const std::string_view text = table_.text(column_.index);
  double time_s = 0.0;
  if (text.find(':') == text.npos) {
    const double number = table_.require_number(column_.index);
    time_s = column_.unit.convert(number);
    if (std::abs(time_s) > latest_time_s) {
      table_.refuse("column '{}': {} {} is no time; give the unit by `time-unit` ms, us or ns",
                    printable(table_.columns()[column_.index]), number, column_.unit.name);
    }
  } else {
    bool of_day = false;
    const auto clock_s = clock_time_of(text, of_day);
    if (!clock_s) {
      table_.refuse(
          "column '{}': '{}' is no time; write seconds, or as in 2026-11-29T12:41:27.5 or "
          "12:41:27.5",
          printable(table_.columns()[column_.index]), printable(text));
    }
    time_s = *clock_s + (of_day ? days_s_ : 0.0);
    const double days_s = day_s * std::round((last_s_ - time_s) / day_s);
    if (of_day && !first_ && (days_s > 0.0 || days_s_ > 0.0)) {
      days_s_ += days_s;  // over midnight, or a step back over it
      time_s += days_s;
    }
  }
  if (!first_ && time_s < last_s_) {
    steps.push_back({row, table_.line_number(), last_s_, time_s});
  }
  first_ = false;
  last_s_ = time_s;
  return time_s;
}

}  // namespace palpate
