#include "unknowns.hpp"

#include <fmt/format.h>

#include "palpate/error.hpp"
#include "recognition_flags.hpp"
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

}  // namespace

Unknowns read_unknowns(const UnknownsFlags& flags, const Scene& scene,
                       const std::string& scene_file) {
  Unknowns result{.recordings = read_touch_recordings(flags.recordings), .list = {}};
  for (Recording& recording : result.recordings) {
    replace_array(scene, scene_file, recording.path, recording.elements(), recording.elements_mm);
  }
  result.list = list_unknowns(flags, result.recordings);
  return result;
}

}  // namespace palpate::cli
