#pragma once

#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <istream>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace palpate {

/// A node of a YAML file with what a message about it has to name. What reads its value throws
/// Error (Fault::input): file, line, key, value, remedy.
struct YamlEntry {
  const std::filesystem::path& file;
  std::string key;
  YAML::Node node;

  [[noreturn]] void refuse(std::string_view remedy) const;

  /// Printable UTF-8, not empty.
  std::string text() const;
  /// A finite number that satisfies `fits`.
  double number(const std::function<bool(double)>& fits, std::string_view remedy) const;
  double number(double least, double upper_bound) const;
  double number() const;
  /// A whole number, decimal or, where `digits` says so, also hexadecimal after 0x.
  enum class Digits { decimal, also_hexadecimal };
  template <class Integer>
  Integer integer(Integer least, Integer upper_bound = std::numeric_limits<Integer>::max(),
                  Digits digits = Digits::decimal) const {
    return static_cast<Integer>(whole_number(least, upper_bound, digits));
  }
  std::vector<YamlEntry> list(std::string_view remedy) const;
  std::vector<YamlEntry> list(std::size_t count, std::string_view remedy) const;

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

 private:
  std::int64_t whole_number(std::int64_t least, std::int64_t upper_bound, Digits digits) const;
};

/// Hands the document of a YAML file to `read`; its node is null where the file has none.
/// @param key names the document in messages
/// @throws Error (Fault::input), naming the line, on a second document and on text that is no YAML
void read_document(std::istream&& yaml, const std::filesystem::path& file, const std::string& key,
                   const std::function<void(const YamlEntry&)>& read);

using YamlKeys = std::vector<std::pair<std::string_view, std::function<void(const YamlEntry&)>>>;

/// Hands each value of a map to its key's reader; keys without a reader, or twice, are refused.
void read_keys(const YamlEntry& map, const YamlKeys& readers);

}  // namespace palpate
