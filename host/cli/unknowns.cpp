#include "unknowns.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "palpate/error.hpp"
#include "recognition_task.hpp"
#include "recordings.hpp"

namespace palpate::cli {

namespace {

std::vector<Unknown> list_unknowns(const UnknownsFlags& flags,
                                   const std::vector<Recording>& recordings) {
  std::optional<Frames> frames;
  if (!flags.frames.empty()) {
    frames = parse_frames("--frames", flags.frames);
  }
  if (flags.touches && *flags.touches < 1) {
    throw Error(Fault::input, fmt::format("--touches {}: give at least 1", *flags.touches));
  }
  if (flags.touches && flags.each_frame) {
    throw Error(Fault::input,
                "--touches: with --each-frame every unknown has one touch; leave one of them out");
  }
  std::vector<Unknown> unknowns;
  for (const Recording& recording : recordings) {
    auto [begin, end] = select(recording, frames);
    if (flags.touches && static_cast<std::size_t>(*flags.touches) > end - begin) {
      throw Error(Fault::input, fmt::format("{}: has {} touches; --touches {} is too many",
                                            recording.path, end - begin, *flags.touches));
    }
    if (flags.each_frame) {
      for (std::size_t i = begin; i < end; ++i) {
        unknowns.push_back({&recording, i, {recording.touch(i)}});
      }
    } else {
      end = flags.touches ? begin + static_cast<std::size_t>(*flags.touches) : end;
      unknowns.push_back({&recording, {}, recording.touches(begin, end)});
    }
  }
  return unknowns;
}

/// Presses one by one of one large array that never moves share most of the work.
bool array_is_still(const std::vector<Unknown>& unknowns, bool each_frame) {
  constexpr std::size_t large = 256;
  const Touch& first = unknowns.front().touches.front();
  return each_frame && unknowns.size() > 1 && first.elements_mm.size() >= large &&
         std::all_of(unknowns.begin(), unknowns.end(), [&](const Unknown& unknown) {
           return same_placement(unknown.touches.front(), first);
         });
}

}  // namespace

Unknowns read_unknowns(const UnknownsFlags& flags, const Scene& scene,
                       const std::string& scene_file) {
  Unknowns result{.recordings = read_touch_recordings(flags.recordings), .list = {}};
  for (Recording& recording : result.recordings) {
    replace_array(scene, scene_file, recording.path, recording.elements(), recording.elements_mm);
  }
  result.list = list_unknowns(flags, result.recordings);
  result.still_array = array_is_still(result.list, flags.each_frame);
  return result;
}

}  // namespace palpate::cli
