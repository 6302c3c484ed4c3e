#pragma once

#include <cmath>
#include <filesystem>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "palpate/error.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// Throws Error (Fault::input), "<source>: <message>"; the source is mostly a file, and the message
/// is formatted as by fmt::format().
template <typename... Parts>
[[noreturn]] void refuse(const std::filesystem::path& source,
                         fmt::format_string<const Parts&...> message, const Parts&... parts) {
  throw Error(Fault::input, fmt::format("{}: {}", source.string(), fmt::format(message, parts...)));
}

/// What is wrong with the input that `work` takes, by its Error (Fault::input); none where it
/// throws none. What else it throws is thrown.
template <typename Work>
std::optional<std::string> input_fault_of(const Work& work) {
  try {
    work();
  } catch (const Error& error) {
    if (error.fault() != Fault::input) {
      throw;
    }
    return error.what();
  }
  return {};
}

/// Throws Error (Fault::input), "<name> = <value>: <remedy>", unless it holds.
inline void require(bool sound, const char* name, double value, const char* remedy) {
  if (!sound) {
    throw Error(Fault::input, fmt::format("{} = {}: {}", name, value, remedy));
  }
}

inline bool is_finite(const Pose& pose) {
  return std::isfinite(pose.translation_mm.x) && std::isfinite(pose.translation_mm.y) &&
         std::isfinite(pose.theta_rad);
}

inline void require_finite(const Pose& pose) {
  if (!is_finite(pose)) {
    throw Error(Fault::input,
                fmt::format("pose {}, {}, {}: give finite numbers", pose.translation_mm.x,
                            pose.translation_mm.y, pose.theta_rad));
  }
}

/// Throws Error, "map '<label>': <fault>", where a map is not sound.
inline void require_sound_map(const OccupancyGrid& map) {
  if (const auto fault = fault_of(map)) {
    throw Error(Fault::input, fmt::format("map '{}': {}", map.label, *fault));
  }
}

}  // namespace palpate
