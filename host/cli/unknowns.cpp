#include "unknowns.hpp"

#include <algorithm>

#include "recordings.hpp"

namespace palpate::cli {

std::vector<Unknown> list_unknowns(const UnknownFlags& flags,
                                   std::span<const Recording> recordings) {
  std::optional<Frames> frames;
  if (!flags.frames.empty()) {
    frames = parse_frames("--frames", flags.frames);
  }
  if (flags.touches && *flags.touches < 1) {
    refuse_flag("--touches", *flags.touches, "give at least 1");
  }
  if (flags.touches && flags.each_frame) {
    refuse("--touches", "with --each-frame every unknown has one touch; leave one of them out");
  }
  std::vector<Unknown> unknowns;
  for (const Recording& recording : recordings) {
    auto [begin, end] = select(recording, frames);
    if (flags.touches && static_cast<std::size_t>(*flags.touches) > end - begin) {
      refuse(recording.path, "has {} touches; --touches {} is too many", end - begin,
             *flags.touches);
    }
    const GroundTruth truth = ground_truth(recording.object, recording.truth);
    if (flags.each_frame) {
      for (std::size_t i = begin; i < end; ++i) {
        unknowns.push_back({recording.path, i, {recording.touch(i)}, truth});
      }
    } else {
      end = flags.touches ? begin + static_cast<std::size_t>(*flags.touches) : end;
      unknowns.push_back({recording.path, {}, recording.touches(begin, end), truth});
    }
  }
  return unknowns;
}

double reach_mm(std::span<const Recording> recordings) {
  double reach = 0.0;
  for (const Recording& recording : recordings) {
    for (std::size_t i = 0; i < recording.size(); ++i) {
      reach = std::max(reach, array_reach_mm(recording.touch(i).elements_mm));
    }
  }
  return reach;
}

}  // namespace palpate::cli
