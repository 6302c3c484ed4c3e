#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace palpate::bench {

/// What the commands measure: a document of records, which their tables, charts and pages show.
using Json = nlohmann::ordered_json;

/// Strings as they are, numbers in their shortest form, true and false as yes and no; lists of
/// numbers joined by "x", such as 64x64x244, other lists by "; ".
std::string plain_text(const Json& value);
/// A count such as 100, 17.5 k, 1 M or 1 G.
std::string count_text(double count);
/// Seconds with a unit and a prefix.
std::string seconds_text(double seconds);
}  // namespace palpate::bench
