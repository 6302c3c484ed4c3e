#pragma once

#include <yaml-cpp/yaml.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <glm/vec2.hpp>

#include "packet_format.hpp"

namespace palpate {

/// Counted from 1, also where there is no mark, as in an empty file.
int line_of(const YAML::Mark& mark);

/// A node of a profile with what a message about it has to name. What reads its value throws Error
/// (Fault::input): file, line, key, value, remedy.
struct ProfileEntry {
  const std::filesystem::path& file;
  std::string key;
  YAML::Node node;

  [[noreturn]] void refuse(std::string_view remedy) const;

  std::string text() const;
  double number(double least = -1e12, double most = 1e12) const;
  /// A whole number, decimal or 0x...
  std::uint32_t integer(std::uint32_t least = 0,
                        std::uint32_t most = std::numeric_limits<std::uint32_t>::max()) const;
  /// Two hexadecimal digits a byte, such as "aa 55"; at least `least` bytes.
  std::vector<std::uint8_t> bytes(std::size_t least = 1) const;
  NumberType number_type() const;
  glm::dvec2 point() const;
  std::vector<ProfileEntry> list(const char* remedy) const;

  /// The value for one of the names.
  template <class Value>
  Value one_of(const std::vector<std::pair<std::string_view, Value>>& choices) const {
    std::string names;
    for (const auto& [name, value] : choices) {
      if (node.IsScalar() && node.Scalar() == name) {
        return value;
      }
      names.append(names.empty() ? "" : ", ").append(name);
    }
    refuse("give one of " + names);
  }
};

using ProfileKeys =
    std::vector<std::pair<std::string_view, std::function<void(const ProfileEntry&)>>>;

/// Hands each value of a map to its key's reader; keys that are not there, or twice, are refused.
void read_keys(const ProfileEntry& map, const ProfileKeys& readers);

}  // namespace palpate
