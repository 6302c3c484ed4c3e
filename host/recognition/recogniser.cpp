#include "recognition/recogniser.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "estimation/displacement_check.hpp"
#include "palpate/error.hpp"

namespace palpate {

Recogniser::Recogniser(Device* device, const RecognitionTask& task, const FilterResources& search)
    : traits_(traits_of(task.filter)),
      lattice_(task.lattice()),
      contact_(task.contact()),
      auto_pivot_(task.auto_pivot),
      by_place_(task.by_place),
      filter_(make_filter(device, task.hypotheses, task.filter, search)) {}

void Recogniser::reset() {
  filter_->reset();
  evidence_.clear();
  places_.clear();
  pivot_placed_ = false;
  touched_ = false;
  if (auto_pivot_) {
    move_pivot({0.0, 0.0});
  }
}

void Recogniser::move_pivot(const glm::dvec2& pivot_mm) {
  filter_->move_pivot(pivot_mm);
  lattice_.pivot_mm = pivot_mm;
}

void Recogniser::place_pivot(const TouchEvidence& touch) {
  const glm::dvec2 centre_mm = touch.middle_mm();
  if (!(std::abs(centre_mm.x) <= farthest_mm && std::abs(centre_mm.y) <= farthest_mm)) {
    throw Error(Fault::input,
                fmt::format("the first touch in contact has its array at [{}, {}] mm; keep touches "
                            "within {:g} mm of the robot frame's origin, or check the poses' unit",
                            centre_mm.x, centre_mm.y, farthest_mm));
  }
  move_pivot(centre_mm);
}

std::string Recogniser::unresolved_words() const {
  std::optional<std::string> fault = unresolved_by_steps(traits_.touch_sd, lattice_, "touch-sd");
  if (!fault) {
    fault = unresolved_by_steps(traits_.slip_sd, lattice_, "slip-sd");
  }
  for (auto touch = evidence_.begin(); !fault && touch != evidence_.end(); ++touch) {
    fault = unresolved_at(touch->T_robot_sensor, traits_.touch_sd, lattice_, "touch-sd");
  }
  return fault.value_or("");
}

void Recogniser::update(std::span<const Touch> touches,
                        const std::function<void(double)>& progress) {
  // Looks at all touches, so that a bad touch is refused before the pivot moves.
  std::vector<TouchEvidence> more = evidence_of(touches, contact_);
  for (TouchEvidence& touch : by_place_ ? std::span(more) : std::span<TouchEvidence>()) {
    touch = places_.add(touch);
  }
  const auto first = std::ranges::find_if(more, &TouchEvidence::in_contact);
  if (lacks_pivot() && first != more.end()) {
    place_pivot(*first);
    more.insert(more.begin(), evidence_.begin(), evidence_.end());  // it has waited
    filter_->update(more, progress);
    evidence_.clear();
    pivot_placed_ = true;
    touched_ = true;
  } else if (!lacks_pivot()) {
    filter_->update(more, progress);
    touched_ = touched_ || !more.empty();
  }
  std::ranges::move(more, std::back_inserter(evidence_));
}

}  // namespace palpate
