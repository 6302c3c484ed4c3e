#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace palpate {

/// Names elements by index, such as "element 3 reads", "elements 3, 5 and 7 more read"; at most 8
/// of them.
/// @param one, more the verb for one element and for more elements
inline std::string elements_that(std::span<const std::size_t> indices, std::string_view one,
                                 std::string_view more) {
  constexpr std::size_t most_named = 8;
  const std::size_t named = std::min(indices.size(), most_named);
  std::string text = fmt::format("{} {}", indices.size() == 1 ? "element" : "elements",
                                 fmt::join(indices.first(named), ", "));
  if (named < indices.size()) {
    text += fmt::format(" and {} more", indices.size() - named);
  }
  return fmt::format("{} {}", text, indices.size() == 1 ? one : more);
}

}  // namespace palpate
