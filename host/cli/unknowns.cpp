#include "cli/unknowns.hpp"

#include <algorithm>
#include <iterator>

#include <CLI/CLI.hpp>

#include "cli/recordings.hpp"

namespace palpate::cli {

void add_unknown_flags(CLI::App& command, UnknownFlags& flags) {
  command.add_option("--frames", flags.frames,
                     "Use the touches A to B - 1 of every recording, counted from 0, as A:B");
  command
      .add_option("--touches", flags.touches,
                  "Use the first N touches of every recording [default: all]")
      ->check(require_whole_number);
  command.add_flag("--each-frame", flags.each_frame,
                   "Recognise every touch by itself, as an unknown object of its own");
}

std::optional<Frames> frames_of(const UnknownFlags& flags) {
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
  return frames;
}

std::vector<Unknown> unknowns_in(const UnknownFlags& flags, const std::optional<Frames>& frames,
                                 const Recording& recording) {
  auto [begin, end] = select(recording, frames);
  if (flags.touches && static_cast<std::size_t>(*flags.touches) > end - begin) {
    refuse(recording.path, "has {} touches; --touches {} is too many", end - begin, *flags.touches);
  }
  const GroundTruth truth = ground_truth(recording.object, recording.truth);
  if (!flags.each_frame) {
    end = flags.touches ? begin + static_cast<std::size_t>(*flags.touches) : end;
    return {{recording.path, {}, recording.touches(begin, end), truth}};
  }
  std::vector<Unknown> unknowns;
  for (std::size_t i = begin; i < end; ++i) {
    unknowns.push_back({recording.path, i, {recording.touch(i)}, truth});
  }
  return unknowns;
}

std::vector<Unknown> list_unknowns(const UnknownFlags& flags,
                                   std::span<const Recording> recordings) {
  const std::optional<Frames> frames = frames_of(flags);
  std::vector<Unknown> unknowns;
  for (const Recording& recording : recordings) {
    std::ranges::move(unknowns_in(flags, frames, recording), std::back_inserter(unknowns));
  }
  return unknowns;
}

double reach_mm(std::span<const Touch> touches) {
  double reach = 0.0;
  for (const Touch& touch : touches) {
    reach = std::max(reach, array_reach_mm(touch.elements_mm));
  }
  return reach;
}

double reach_mm(std::span<const Recording> recordings) {
  double reach = 0.0;
  for (const Recording& recording : recordings) {
    reach = std::max(reach, reach_mm(recording.touches(0, recording.size())));
  }
  return reach;
}

}  // namespace palpate::cli
