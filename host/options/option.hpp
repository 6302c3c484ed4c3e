#pragma once

#include <cstdint>
#include <initializer_list>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include <fmt/format.h>

#include "options/request.hpp"
#include "palpate/error.hpp"
#include "palpate/pose.hpp"

namespace palpate {

// The options of a recognition, one row each. Flags of commands, keys of scene files, keywords of
// Python, a batch's task file, --help and messages all follow from the rows: a new option is a
// member of Request, a row, and what reads the member.

/// The numbers that an option takes.
struct NumberLimits {
  static constexpr double infinity = std::numeric_limits<double>::infinity();

  double least = -infinity;
  double most = infinity;
  bool with_least = true;
  bool with_most = true;
};

struct Option {
  /// Its type says which values the option takes, and how their texts look.
  using Member =
      std::variant<std::string Request::*, bool Request::*, std::optional<int> Request::*,
                   std::optional<std::uint64_t> Request::*, std::optional<double> Request::*,
                   std::optional<Range> Request::*, std::optional<Bins> Request::*,
                   std::optional<Pivot> Request::*, std::optional<NoneWeight> Request::*,
                   std::optional<Frames> Request::*, std::optional<FilterKind> Request::*,
                   std::optional<Resampling> Request::*>;

  const char* name;       ///< the flag less "--"; Python has _ for -
  const char* scene_key;  ///< "region.x_mm" is x_mm in region; "" where scenes have none
  const char* group;      ///< heading in --help
  Member member;
  NumberLimits limits;  ///< of each number
  const char* help;
  bool of_selection = false;  ///< which touches of a recording make an unknown, or a record's steps
};

/// All options, in the order of --help.
std::span<const Option> options();
/// @throws Error where no option has the name
const Option& option_named(std::string_view name);

/// Sets the option of the request by its text, such as "25x25x16" or "-10:10".
/// @returns what to give instead, "give ..."; "" where the option is set
std::string set_option(Request& request, const Option& option, const std::string& text);
/// The text that sets the option as it is; "" where it is left out.
std::string option_text(const Request& request, const Option& option);
/// The first of these options that the request has; "" where it has none of them.
std::string_view first_given(const Request& request,
                             std::initializer_list<std::string_view> options);
/// @throws Error naming the first option whose value cannot be meant. Values that set_option() set
/// can.
void require_sound(const Request& request);
/// What gave the option, in the middle of a sentence: "`filter bounded`", "filter: bounded in
/// a.yaml".
std::string origin_of_option(const Request& request, std::string_view name);

/// [option] the texts of all options that are given but for the device.
std::map<std::string, std::string> option_texts(const Request& request);
/// The request with the options of such texts. @throws Error on an option or text that is not known
Request request_with(const std::map<std::string, std::string>& texts);

std::string name_of(FilterKind kind);

/// "X,Y,DEG". @throws Error naming the option and the form wanted
Pose parse_pose(std::string_view option, const std::string& text);
/// "A:B" with A < B. @throws Error naming `what` the text is of, and the form wanted
Frames parse_frames(const std::string& what, const std::string& text);

/// What joins the numbers of an option's text: "25x25x16", "-10:10", "1,2". None where it has one.
std::optional<char> separator_of(const Option& option);

/// Throws Error, "`<option> <value>`: <message>"; the message is formatted as by fmt::format().
template <typename Value, typename... Parts>
[[noreturn]] void refuse_option(std::string_view option, const Value& value,
                                fmt::format_string<const Parts&...> message,
                                const Parts&... parts) {
  throw Error(Fault::input,
              fmt::format("`{} {}`: {}", option, value, fmt::format(message, parts...)));
}

/// Throws Error, "`<option>`: <message>".
[[noreturn]] inline void refuse_option(std::string_view option, std::string_view message) {
  throw Error(Fault::input, fmt::format("`{}`: {}", option, message));
}

/// Throws Error about an option that the request has: "`<option> <value>`: <message>", or "<scene
/// file>: <key> = <value>: <message>" where that gave the option.
template <typename... Parts>
[[noreturn]] void refuse_given(const Request& request, std::string_view option,
                               fmt::format_string<const Parts&...> message, const Parts&... parts) {
  const std::string text = fmt::format(message, parts...);
  const std::string value = option_text(request, option_named(option));
  if (const auto key = request.keys.find(std::string(option)); key != request.keys.end()) {
    throw Error(Fault::input,
                fmt::format("{}: {} = {}: {}", request.scene, key->second, value, text));
  }
  refuse_option(option, value, "{}", text);
}

}  // namespace palpate
