#include "still_array.hpp"

#include <algorithm>

namespace palpate {

std::vector<StillTouch> StillArray::gather(std::span<const Touch> touches,
                                           std::size_t segment_elements) const {
  std::vector<StillTouch> gathered;
  for (const Touch& touch : touches) {
    const std::vector<Reading> readings = contact_.classify(touch);
    const auto no_contact = std::count(readings.begin(), readings.end(), Reading::no_contact);
    const bool by_differences = 2 * static_cast<std::size_t>(no_contact) >= readings.size();
    gathered.push_back(
        {touch, by_differences,
         gather_evidence(touch, readings, by_differences ? Reading::no_contact : Reading::unknown,
                         lattice_.pivot_mm, segment_elements)});
  }
  return gathered;
}

void StillArray::accumulate(std::span<const StillTouch> touches, DenseLikelihood& likelihood,
                            const DenseBelief& belief,
                            const std::function<void(double)>& progress) {
  double done = 0.0;
  for (const StillTouch& still : touches) {
    if (still.by_differences) {
      belief.add(no_contact_at(still.touch, likelihood, belief));
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
  if (!evaluated_ || pivot_mm_ != lattice_.pivot_mm ||
      !same_placement(touch, {T_robot_sensor_, elements_mm_, {}})) {
    evaluated_ = false;  // a device that fails leaves it half-way
    no_contact_->clear();
    const std::vector<Reading> readings(touch.elements_mm.size(), Reading::no_contact);
    likelihood.accumulate(gather_evidence(touch, readings, Reading::unknown, lattice_.pivot_mm,
                                          likelihood.segment_elements()),
                          *no_contact_, {});
    T_robot_sensor_ = touch.T_robot_sensor;
    elements_mm_.assign(touch.elements_mm.begin(), touch.elements_mm.end());
    pivot_mm_ = lattice_.pivot_mm;
    evaluated_ = true;
  }
  return *no_contact_;
}

}  // namespace palpate
