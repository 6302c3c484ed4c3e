#include "estimation/lattice/still_array.hpp"

#include <algorithm>
#include <utility>

#include "model/contact_readings.hpp"

namespace palpate {

std::span<const StillTouch> StillArray::gather(std::span<const Touch> touches,
                                               std::size_t segment_elements) {
  gathered_.resize(std::max(gathered_.size(), touches.size()));
  for (std::size_t i = 0; i < touches.size(); ++i) {
    StillTouch& still = gathered_[i];
    still.touch = touches[i];
    readings_ = classify(still.touch, contact_, std::move(readings_));
    const auto no_contact = std::count(readings_.begin(), readings_.end(), Reading::no_contact);
    still.by_differences = 2 * static_cast<std::size_t>(no_contact) >= readings_.size();
    still.evidence = gather_evidence(
        still.touch, readings_, still.by_differences ? Reading::no_contact : Reading::unknown,
        lattice_.pivot_mm, segment_elements, std::move(still.evidence));
  }
  return std::span(gathered_).first(touches.size());
}

void StillArray::accumulate(std::span<const StillTouch> touches, DenseLikelihood& likelihood,
                            const DenseBelief& belief,
                            const std::function<void(double)>& progress) {
  double done = 0.0;
  for (const StillTouch& still : touches) {
    // The first touch also makes the memory that a later one may need.
    if (still.by_differences || !no_contact_) {
      const DenseBelief& no_contact = no_contact_at(still.touch, likelihood, belief);
      if (still.by_differences) {
        belief.add(no_contact);
      }
    }
    likelihood.accumulate(still.evidence, belief, {});
    if (progress) {
      progress(++done / static_cast<double>(touches.size()));
    }
  }
}

const DenseBelief& StillArray::no_contact_at(const Touch& touch, DenseLikelihood& likelihood,
                                             const DenseBelief& belief) {
  if (!no_contact_) {
    no_contact_.emplace(belief.uniform());
  }
  readings_.assign(touch.elements_mm.size(), Reading::no_contact);
  everywhere_ = gather_evidence(touch, readings_, Reading::unknown, lattice_.pivot_mm,
                                likelihood.segment_elements(), std::move(everywhere_));
  if (evaluated_ != everywhere_) {
    evaluated_ = {};  // a device that fails leaves it half-way
    no_contact_->clear();
    likelihood.accumulate(everywhere_, *no_contact_, {});
    evaluated_ = everywhere_;
  }
  return *no_contact_;
}

}  // namespace palpate
