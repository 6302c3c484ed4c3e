#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "recognition_record.hpp"

namespace palpate::cli {

/// The flags that select unknowns from recordings, as given.
struct UnknownFlags {
  std::string frames;
  std::optional<int> touches;
  bool each_frame = false;
};

/// The unknowns that the flags select: views into the recordings' memory. Throws Error.
std::vector<Unknown> list_unknowns(const UnknownFlags& flags,
                                   std::span<const Recording> recordings);

/// The largest reach of any touch's array, which may change from touch to touch; see
/// array_reach_mm().
double reach_mm(std::span<const Recording> recordings);

}  // namespace palpate::cli
