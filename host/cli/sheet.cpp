#include "cli/sheet.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "cli/record_table.hpp"
#include "cli/step_words.hpp"
#include "cli/text_table.hpp"
#include "model/printable.hpp"
#include "recognition/record_json.hpp"

namespace palpate::cli {

namespace {

/// The words with the signs of print in the place of those of a terminal.
std::string printed(std::string words) {
  for (const auto& [plain, sign] : {std::pair{"+-", "± "}, std::pair{" deg", "°"}}) {
    for (std::size_t at = words.find(plain); at != words.npos; at = words.find(plain, at)) {
      words.replace(at, std::string_view(plain).size(), sign);
    }
  }
  return words;
}

/// Edge of the squares that stand for elements, mm: 90 % of the pitch, at most 1.8 mm.
double element_edge_mm(std::span<const glm::dvec2> elements_mm) {
  const glm::dvec2& first = elements_mm.front();
  double nearest = 2.0;
  for (const glm::dvec2& other : elements_mm.subspan(1)) {
    nearest = std::min(nearest, std::hypot(other.x - first.x, other.y - first.y));
  }
  return 0.9 * nearest;
}

std::vector<RecognitionSheet::Caption> captions(const RecognitionRecord& record,
                                                const RecognitionTask& task) {
  const RecognitionStep& last = record.last();
  std::vector<RecognitionSheet::Caption> lines;
  const auto add = [&](const std::string& words, bool alarm) {
    if (!words.empty()) {
      lines.push_back({words, alarm});
    }
  };
  const StepSentences words = sentences_of(last, task);
  add(printed(printable(last.decision.because)), !last.decision.act);
  add(printed(words.truth), last.right == false);
  constexpr std::size_t shown = 2;
  const std::vector<BeliefMode> other = other_modes(last);
  std::string others;
  for (std::size_t k = 0; k < std::min(other.size(), shown); ++k) {
    others += fmt::format("{}{:.0f} % {} at {}", k == 0 ? "or " : ", ",
                          100.0 * other[k].probability, printable(task.name_of(other[k].object)),
                          pose_words(other[k].pose.T_robot_object));
  }
  others += other.size() > shown ? fmt::format(", and {} more", other.size() - shown) : "";
  add(printed(others), true);
  if (last.fit && last.fit->verdict != Verdict::does_not_fit) {  // which is a finding
    add(fmt::format("fit: {} (z {:.1f})", verdict_text(last.fit->verdict), last.fit->z),
        last.fit->verdict == Verdict::doubtful);
  }
  for (const std::string& finding : words.findings) {
    add(finding, true);
  }
  if (last.refined) {
    std::string mode = "most probable bin: " + pose_words(last.mode_T_robot_object());
    mode += last.error_mm ? "; error " + error_text(last.error_mm) + " mm" : "";
    add(printed(mode), false);
  }
  return lines;
}

}  // namespace

PlacedBelief belief_of(const Recogniser& recogniser, int object) {
  constexpr double least_share = 1e-6;
  PoseLattice lattice;
  const auto bins = recogniser.likely_bins(std::span(&object, 1), least_share, lattice);
  return bins.front().empty() ? PlacedBelief{.cells = 1, .xy = {0.0}}
                              : placed_belief(lattice, bins.front());
}

RecognitionSheet sheet_of(const RecognitionRecord& record, const Query& unknown,
                          const RecognitionTask& task, PlacedBelief belief) {
  const RecognitionStep& last = record.last();
  RecognitionSheet sheet;
  sheet.title = name_of(record);
  // A long label must leave the pose its room.
  constexpr std::size_t longest_identity = 48;
  const bool decided = !last.decision.because.empty();
  sheet.result = std::string(!decided            ? ""
                             : last.decision.act ? "Act: "
                                                 : "Do not act: ") +
                 shorten_middle(identity_words(last, task), longest_identity) + ": " +
                 printed(pose_words(last.T_robot_object(), sd_at_peak(last)));
  sheet.captions = captions(record, task);
  sheet.map = task.hypotheses[last.mode.object].map;
  sheet.map.symmetry = last.symmetry;
  sheet.element_mm = element_edge_mm(unknown.touches.front().elements_mm);
  sheet.T_object_robot = last.pose();
  if (last.error_mm) {
    sheet.truth = last.truth.T_object_robot;
  }
  sheet.belief = std::move(belief);
  for (std::size_t i = 0; i < last.places.modes.size(); ++i) {
    const BeliefMode& mode = last.places.modes[i];
    sheet.modes.push_back(
        {fmt::format("{} {:.1f} %", printable(task.name_of(mode.object)), 100.0 * mode.probability),
         mode.pose, i == last.places.own});
  }
  sheet.labels = task.labels;
  for (const Touch& touch : unknown.touches) {
    auto& footprint = sheet.footprints_mm.emplace_back();
    for (const glm::dvec2& element : touch.elements_mm) {
      footprint.push_back(touch.T_robot_sensor * element);
    }
  }
  for (const RecognitionStep& step : record.trace) {
    sheet.identity.push_back(step.identity);
  }
  return sheet;
}

}  // namespace palpate::cli
