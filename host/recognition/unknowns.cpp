#include "recognition/unknowns.hpp"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>

#include "io/input_file.hpp"
#include "recognition/recordings.hpp"
#include "recognition/refused_option.hpp"

namespace palpate {

void require_selection(const Request& request) {
  if (const auto& frames = request.frames; frames && frames->begin >= frames->end) {
    refuse_option("frames", fmt::format("{}:{}", frames->begin, frames->end),
                  "selects no touch; give the first touch and, behind it, the one after the last");
  }
  if (request.touches && *request.touches < 1) {
    refuse_option("touches", *request.touches, "give at least 1");
  }
  if (request.touches && request.each_frame) {
    refuse_option("touches",
                  "with `each-frame` every unknown has one touch; leave one of them out");
  }
}

std::vector<Unknown> unknowns_in(const Request& request, const std::optional<Frames>& frames,
                                 const Recording& recording) {
  auto [begin, end] = selected_touches(recording, frames);
  if (request.touches && static_cast<std::size_t>(*request.touches) > end - begin) {
    refuse(recording.path, "has {} touches; `touches {}` is too many", end - begin,
           *request.touches);
  }
  const GroundTruth truth = ground_truth(recording.object, recording.truth);
  if (!request.each_frame) {
    end = request.touches ? begin + static_cast<std::size_t>(*request.touches) : end;
    return {{recording.path, {}, recording.touches(begin, end), truth}};
  }
  std::vector<Unknown> unknowns;
  for (std::size_t i = begin; i < end; ++i) {
    unknowns.push_back({recording.path, i, {recording.touch(i)}, truth});
  }
  return unknowns;
}

std::vector<Unknown> list_unknowns(const Request& request, std::span<const Recording> recordings) {
  require_selection(request);
  std::vector<Unknown> unknowns;
  for (const Recording& recording : recordings) {
    std::ranges::move(unknowns_in(request, request.frames, recording),
                      std::back_inserter(unknowns));
  }
  return unknowns;
}

double largest_reach_mm(std::span<const Touch> touches) {
  double reach = 0.0;
  for (const Touch& touch : touches) {
    reach = std::max(reach, array_reach_mm(touch.elements_mm));
  }
  return reach;
}

double largest_reach_mm(std::span<const Recording> recordings) {
  double reach = 0.0;
  for (const Recording& recording : recordings) {
    reach = std::max(reach, largest_reach_mm(recording.touches(0, recording.size())));
  }
  return reach;
}

}  // namespace palpate
