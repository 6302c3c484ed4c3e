#include "recognition/recogniser.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "estimation/displacement_weights.hpp"
#include "model/element_spacing.hpp"
#include "palpate/error.hpp"

namespace palpate {

TouchPlaces::Place TouchPlaces::place_of(const TouchEvidence& touch) {
  Place place{.theta_rad = touch.T_robot_sensor.theta_rad,
              .contacts = static_cast<double>(touch.contacts),
              .force = touch.force};
  const auto n = static_cast<double>(touch.elements_mm.size());
  glm::dvec2 mean_mm{0.0};
  for (const glm::dvec2& element : touch.elements_mm) {
    mean_mm += element / n;
  }
  for (const glm::dvec2& element : touch.elements_mm) {
    const glm::dvec2 from_mean = element - mean_mm;
    place.square_mm2 += glm::dot(from_mean, from_mean) / n;
  }
  place.middle_mm = touch.T_robot_sensor * mean_mm;
  return place;
}

double TouchPlaces::weight_of(const Place& place, const TouchEvidence& touch) const {
  if (places_.empty()) {
    return 1.0;
  }
  const std::optional<ElementSpacing> spacing = spacing_of(touch.elements_mm);
  // A single element is a place of its own alone.
  const double reach_mm = spacing ? spacing->nearest_mm.least : 0.0;
  double weight = 1.0;
  for (const Place& earlier : places_) {
    const glm::dvec2 apart_mm = place.middle_mm - earlier.middle_mm;
    const double turn = 2.0 * std::sin(0.5 * (place.theta_rad - earlier.theta_rad));
    const double square_mm2 = glm::dot(apart_mm, apart_mm) + place.square_mm2 * turn * turn;
    if (square_mm2 > 0.0 && square_mm2 >= reach_mm * reach_mm) {
      continue;
    }
    const double near = square_mm2 > 0.0 ? 1.0 - square_mm2 / (reach_mm * reach_mm) : 1.0;
    const double felt =
        place.contacts > 0.0 ? std::min(1.0, 2.0 * earlier.contacts / place.contacts) : 1.0;
    weight -= earlier.weight * near * felt;
  }
  return std::max(0.0, weight);
}

TouchEvidence TouchPlaces::thinned(const TouchEvidence& touch, double weight) const {
  TouchEvidence some = touch;
  if (weight == 1.0) {
    return some;
  }
  // Multiples of the golden ratio fill [0, 1) evenly, whatever the number of elements.
  constexpr double golden = 0.6180339887498949;
  constexpr double between_touches = 0.7548776662466927;
  const auto touches = static_cast<double>(places_.size());
  for (std::size_t e = 0; e < some.readings.size(); ++e) {
    const double at = golden * static_cast<double>(e) + between_touches * touches;
    if (at - std::floor(at) >= weight) {
      some.readings[e] = Reading::unknown;
    }
  }
  some.contacts = static_cast<std::size_t>(std::ranges::count_if(some.readings, is_contact));
  return some;
}

TouchEvidence TouchPlaces::add(const TouchEvidence& touch) {
  if (!touch.tells()) {
    return touch;  // it takes no weight from others
  }
  Place place = place_of(touch);
  place.weight = weight_of(place, touch);
  if (touch.in_contact()) {
    const auto same = [&](const Place& earlier) {
      return earlier.middle_mm == place.middle_mm && earlier.theta_rad == place.theta_rad &&
             earlier.force == place.force && earlier.contacts == place.contacts;
    };
    ++touches_;
    repeated_ += std::ranges::any_of(places_, same) ? 1 : 0;
    counted_ += place.weight;
  }
  TouchEvidence some = thinned(touch, place.weight);
  if (place.weight > 0.0) {
    places_.push_back(place);
  }
  return some;
}

std::string TouchPlaces::words() const {
  constexpr double most_share = 0.5;
  if (repeated_ > 0) {
    return fmt::format(
        "{} of {} touches equal an earlier one to the digit, and count as one with it: import each "
        "touch once",
        repeated_, touches_);
  }
  if (touches_ > 1 && counted_ <= most_share * static_cast<double>(touches_)) {
    return fmt::format(
        "{} touches lie so close together that they count as {:.1f}: touch places further apart "
        "than the array's elements are",
        touches_, counted_);
  }
  return "";
}

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
