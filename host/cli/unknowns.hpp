#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cli/options.hpp"
#include "recognition/recognition_record.hpp"

namespace CLI {
class App;
}

namespace palpate::cli {

/// The flags that select unknowns from recordings, as given.
struct UnknownFlags {
  std::string frames;
  std::optional<int> touches;
  bool each_frame = false;
};

void add_unknown_flags(CLI::App& command, UnknownFlags& flags);

/// The flags' frames. Throws Error where the flags are no numbers of touches or contradict each
/// other.
std::optional<Frames> frames_of(const UnknownFlags& flags);

/// The unknowns of one recording: views into its memory. Throws Error where it has fewer touches.
/// @param frames the touches to use, or all
std::vector<Unknown> unknowns_in(const UnknownFlags& flags, const std::optional<Frames>& frames,
                                 const Recording& recording);

/// The unknowns that the flags select: views into the recordings' memory. Throws Error.
std::vector<Unknown> list_unknowns(const UnknownFlags& flags,
                                   std::span<const Recording> recordings);

/// The largest reach of any touch's array, which may change from touch to touch; see
/// array_reach_mm().
double reach_mm(std::span<const Touch> touches);
double reach_mm(std::span<const Recording> recordings);

}  // namespace palpate::cli
